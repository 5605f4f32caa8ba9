"""The largest native solid of a kind, along given axes, within a convex polytope.

It is within where its support along the normal of each face is no more than the face's offset. Of boxes,
cylinders, capsules and balls the support is linear in centre and sizes, and the logarithm of the volume is
concave: one convex programme, solved with a logarithmic barrier (Boyd and Vandenberghe 2004, section 11.3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from partwright.fields import Box, Capsule, Cylinder, Field, Sphere

_GAP = 1e-3  # of the logarithm of the volume: how much less than the largest may be found
_STEEPER = 10.0  # times, from one barrier to the next
_STEPS, _HALVINGS = 30, 40  # of Newton's method for each barrier, and of one step
_SMALL = 0.1  # of the largest that fits around the given point, where it begins
_BETTER = 1e-8  # of a step: what it has to gain to be gone on with


@dataclass(frozen=True)
class _Form:
    """reach: of normals (F, 3) in the solid's axes the support of each size, (F, K). volume: powers (P,) and
    sums of sizes (P, K), of whose product the volume is a multiple. field: of sizes (K,)."""

    reach: Callable[[np.ndarray], list[np.ndarray]]
    powers: tuple[float, ...]
    sums: tuple[tuple[float, ...], ...]
    field: Callable[..., Field]


_FORMS: dict[type[Field], _Form] = {
    Box: _Form(
        lambda n: list(np.abs(n.T) / 2),
        (1, 1, 1),
        ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
        lambda *size: Box(size),
    ),
    Cylinder: _Form(
        lambda n: [np.hypot(n[:, 0], n[:, 1]), np.abs(n[:, 2]) / 2], (2, 1), ((1, 0), (0, 1)), Cylinder
    ),
    Capsule: _Form(lambda n: [np.ones(len(n)), np.abs(n[:, 2]) / 2], (2, 1), ((1, 0), (4 / 3, 1)), Capsule),
    Sphere: _Form(lambda n: [np.ones(len(n))], (3,), ((1,),), Sphere),
}
LARGEST = tuple(_FORMS)
"""Kinds whose largest can be found."""


def largest_within(
    kind: type[Field], frame: np.ndarray, normals: np.ndarray, offsets: np.ndarray, inside: np.ndarray
) -> tuple[Field, np.ndarray]:
    """The field of one of `LARGEST`, and its centre (3,).

    frame: (3, 3), columns the axes. normals, offsets: (F, 3), (F,) of the faces. inside: (3,), a point of the
    polytope.
    """
    form = _FORMS[kind]
    local = normals @ frame
    room = offsets - normals @ inside
    scale = float(room.min())
    reach = np.column_stack(form.reach(local))
    count = reach.shape[1]
    faces = np.column_stack([local, reach])
    above = np.column_stack([np.zeros((count, 3)), -np.eye(count)])  # no size is less than nothing
    rows, limits = np.concatenate([faces, above]), np.concatenate([room / scale, np.zeros(count)])
    sums = np.column_stack([np.zeros((len(form.sums), 3)), np.array(form.sums, float)])
    start = np.concatenate([np.zeros(3), np.full(count, _SMALL / reach.sum(axis=1).max())])
    found = _maximised(np.array(form.powers, float), sums, rows, limits, start)
    centre, sizes = inside + scale * (frame @ found[:3]), scale * found[3:]
    return form.field(*sizes.tolist()), centre


def _maximised(
    powers: np.ndarray, sums: np.ndarray, rows: np.ndarray, limits: np.ndarray, x: np.ndarray
) -> np.ndarray:
    """Where the sum of powers times log(sums @ x) is largest, with rows @ x no more than the limits; begun at
    an x where it is less."""

    def value(at: np.ndarray, weight: float) -> float:
        slack, terms = limits - rows @ at, sums @ at
        if slack.min() <= 0 or terms.min() <= 0:
            return -np.inf
        return float(weight * (powers @ np.log(terms)) + np.log(slack).sum())

    weight = 1.0
    while True:
        for _ in range(_STEPS):
            slack, terms = limits - rows @ x, sums @ x
            slope = weight * (powers / terms) @ sums - (1 / slack) @ rows
            bend = weight * (sums.T * (powers / terms**2)) @ sums + (rows.T / slack**2) @ rows
            step = np.linalg.solve(bend, slope)
            gain = float(slope @ step)
            if gain < _BETTER * max(weight, 1.0):
                break
            here, share = value(x, weight), 1.0
            for _ in range(_HALVINGS):
                if value(x + share * step, weight) >= here + 0.1 * share * gain:
                    break
                share /= 2
            else:
                break
            x = x + share * step
        if len(limits) / weight < _GAP:
            return x
        weight *= _STEEPER
