"""Learned parts that stay: their surface, too, which the model makes beside the other parts'.

Their numbers are kept to the bit; the surface is held within a limit by constraints at points of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from partwright.assembly import Assembly
from partwright.assembly.joint import is_joint
from partwright.goals.composite import Composite
from partwright.goals.contacts import part_surface
from partwright.goals.parameters import Parameters

_POINTS = 32  # of each part's surface, well apart, at which it is held
_SHARE = 0.5  # of the limit that they may use: between them it moves a little further
# A tenth of the longest side counts as much as all of it does of a contact: the limit is so much smaller.
WEIGHT = 10.0


@dataclass(frozen=True)
class Held:
    """A leaf that stays: points (K, 3) on its surface, of which the first `_POINTS` are well apart, and its
    distance (K,) there at the start."""

    part: int
    points: np.ndarray
    distance: np.ndarray


def held_parts(assembly: Assembly, moves: Sequence[bool]) -> list[Held]:
    """The learned leaves that do not move, but are of one shape with some that do. moves: of each leaf."""
    keys = [_shape_of(assembly, i) for i in range(len(assembly))]
    moving = {key for key, own in zip(keys, moves, strict=True) if own}
    found = []
    for i, key in enumerate(keys):
        if key is None or moves[i] or key not in moving:
            continue
        points = well_apart_first(part_surface(assembly, i), _POINTS)
        if len(points):
            found.append(Held(i, points, assembly.part_distances(points)[i]))
    return found


def broken_by(held: Sequence[Held], assembly: Assembly, limit: float, longest: float) -> list[float]:
    """By how much each point of `held_parts` is further off than the limit (a share of the longest side):
    outwards, then inwards."""
    rows: list[float] = []
    for off in _moved(held, assembly, _POINTS):
        for side in (off, -off):
            rows += (WEIGHT * (side / longest - _SHARE * limit)).tolist()
    return rows


def gradients(held: Sequence[Held], parameters: Parameters, longest: float) -> np.ndarray:
    """(2 K, D) derivatives of `broken_by`."""
    theta = torch.tensor(parameters.values, requires_grad=True)
    composite, rows = Composite(parameters), []
    for one in held:
        points = torch.tensor(one.points[:_POINTS])
        distance = composite.part(one.part, points, theta)
        each = [torch.autograd.grad(d, theta, retain_graph=True)[0].numpy() for d in distance]
        rows += [*each, *(-row for row in each)]
    return WEIGHT / longest * np.array(rows).reshape(-1, len(parameters))


def moved(held: Sequence[Held], assembly: Assembly, longest: float) -> dict[str, float]:
    """How far the surface of each part has moved at most, as a share of the longest side, over all points."""
    names = [assembly.parts[one.part].name for one in held]
    far = [float(np.abs(off).max()) / longest for off in _moved(held, assembly, None)]
    return dict(zip(names, far, strict=True))


def _moved(held: Sequence[Held], assembly: Assembly, most: int | None) -> list[np.ndarray]:
    if not held:
        return []
    distance = assembly.part_distances(np.concatenate([one.points[:most] for one in held]))
    ends = np.cumsum([len(one.points[:most]) for one in held])
    pieces = np.split(distance, ends[:-1], axis=1)
    return [piece[one.part] - one.distance[:most] for one, piece in zip(held, pieces, strict=True)]


def _shape_of(assembly: Assembly, index: int) -> object:
    part = assembly.parts[index]
    return part.field.shape_key if is_joint(part) else None


def well_apart_first(points: np.ndarray, count: int) -> np.ndarray:
    """The points (K, 3) with so many first that are each the furthest from all before it."""
    if not len(points):
        return points
    chosen, away = [0], np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.concatenate([points[chosen], np.delete(points, chosen, axis=0)])
