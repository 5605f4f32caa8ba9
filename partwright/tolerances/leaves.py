"""An assembly's numbers as a vector, and how its distances move with them.

The chain rule in two halves: how the tree's fold weighs each copy of each leaf at a point, in closed form,
and how a copy's own distance moves with its leaf's numbers, by central differences in the kernel. So any tree
of SuperFrusta, named solids, extrusions, revolutions and pipes will do: blends, differences, and repeats
whose copies move as one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.rows import rows
from partwright.assembly.similarity import rotation_matrix
from partwright.assembly.tree import Node
from partwright.errors import ParameterError
from partwright.fields import Extrusion, Field, Pipe, Revolution, SuperFrustum, Swept, kernel
from partwright.fields.columns import ROTATION_STEP, TRANSLATION_STEP, Tangent
from partwright.fields.operations import SHARP
from partwright.fields.profile_growth import grown_profile
from partwright.fields.superfrustum import tightest_bulge

_POSE = Tangent.SX  # numbers of the pose come first, as in the kernel's steps; a SuperFrustum's are those
_WIDTH, _HEIGHT, _BULGE = (entry - _POSE for entry in (Tangent.SX, Tangent.SZ, Tangent.BULGE))
_PROPORTIONS = Tangent.ROUNDNESS - _POSE
_STEP = 2e-3
# A SuperFrustum's roundness (or 1), dilation, taper, bulge and onion that are these stay: a box stays a box.
_PLAIN = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
_LONGEST_STEP = 0.05
_ALONG = 1e-9

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Slope:
    """How an assembly's distance F at points moves with its numbers."""

    value: Floats
    """(N,) F itself."""
    by_number: Floats
    """(N, P) its derivatives by the free numbers of all leaves, leaf by leaf."""


def copies_at(parts: Sequence[Part], points: NDArray[np.float32]) -> Floats:
    """(C, N) distances of the copies of all parts at points (N, 3), part by part."""
    rest = [part for part in parts if not isinstance(part.field, Swept | Pipe)]
    found = iter(kernel.evaluate_parts(rows(rest), points).astype(np.float64) if rest else ())
    values = []
    for part in parts:
        for copy in part.copies:
            if isinstance(part.field, Swept | Pipe):
                local = (points - np.array(copy.translation)) @ rotation_matrix(copy.rotation)
                values.append(np.asarray(part.field(local), np.float64))
            else:
                values.append(next(found))
    return np.stack(values)


def free_numbers(part: Part) -> NDArray[np.bool_]:
    """Which of a leaf's numbers may move: its place, its turn unless it stands along the axes, its lengths,
    of a SuperFrustum's other numbers those that are not plain, and last its blend unless that is 0."""
    free = np.ones(_POSE + len(numbers(part.field)) + 1, bool)
    turn = rotation_matrix(part.rotation)
    free[ROTATION_STEP] = (np.abs(turn - np.rint(turn)) > _ALONG).any()
    free[-1] = part.blend > SHARP
    if isinstance(part.field, Pipe):
        free[_POSE:-1] = numbers(part.field) > 0  # what is solid gets no wall
    if isinstance(part.field, SuperFrustum):
        free[Tangent.ROUNDNESS : Tangent.BLEND] = numbers(part.field)[_PROPORTIONS:] != _PLAIN
        free[Tangent.ROUNDNESS] &= part.field.roundness != 1
    return free


def numbers(field: Field) -> Floats:
    """The field's numbers in the order of its declaration, triples flattened.

    Of a profile that is moved or turned, how much further out it lies than it does, which is 0, and the
    height: its corners keep what they are to one another. Of a pipe radius and wall: it keeps its path."""
    if isinstance(field, Swept):
        return np.array([0.0, field.height] if isinstance(field, Extrusion) else [0.0])
    if isinstance(field, Pipe):
        return np.array([field.radius, field.thickness])
    return np.concatenate([np.atleast_1d(getattr(field, f.name)) for f in fields(field)])  # type: ignore[arg-type]


def with_numbers(field: Field, values: Floats) -> Field:
    """The field with other numbers.

    Raises:
        ParameterError: they are out of its range.
    """
    if isinstance(field, Extrusion):
        profile = grown_profile(field.profile, float(values[0])) if values[0] else field.profile
        return replace(field, profile=profile, height=float(values[1]))
    if isinstance(field, Revolution):
        return replace(field, profile=field.grown_profile(float(values[0]))) if values[0] else field
    if isinstance(field, Pipe):
        return replace(field, radius=float(values[0]), thickness=float(values[1]))
    new, at = {}, 0
    for entry in fields(field):  # type: ignore[arg-type]
        old = getattr(field, entry.name)
        width = len(old) if isinstance(old, tuple) else 1
        taken = tuple(values[at : at + width].tolist())
        new[entry.name], at = taken if isinstance(old, tuple) else taken[0], at + width
    return replace(field, **new)  # type: ignore[type-var]


def moved(part: Part, step: Floats) -> Part:
    """The leaf after a step of all its numbers: place, turn about the local axes, field, blend.

    A step that would leave the field's range is halved, three times at most; then the leaf stays.
    """
    step = np.clip(step, -_LONGEST_STEP, _LONGEST_STEP)
    for _ in range(4):
        try:
            return _moved(part, step)
        except ParameterError:
            step = step / 2
    return part


def _moved(part: Part, step: Floats) -> Part:
    values = numbers(part.field) + step[_POSE:-1]
    if isinstance(part.field, SuperFrustum):
        values = np.clip(values, 0.0, [math.inf] * 3 + [1.0, math.inf, 2.0, 1.0, 1.0])
        values[_BULGE] = min(values[_BULGE], tightest_bulge(values[_WIDTH], values[_HEIGHT]))
    angle = float(np.linalg.norm(step[ROTATION_STEP]))
    half = np.sinc(angle / (2 * math.pi)) / 2
    turn = Similarity(1.0, (math.cos(angle / 2), *(half * step[ROTATION_STEP]).tolist()))
    pose = part.pose @ turn
    place = np.array(part.translation) + step[TRANSLATION_STEP]
    return replace(
        part,
        field=with_numbers(part.field, values),
        translation=tuple(place.tolist()),
        rotation=pose.rotation if angle > 0 else part.rotation,
        blend=max(0.0, part.blend + float(step[-1])),
    )


@dataclass(frozen=True)
class Share:
    """How a node's distance at points moves with one copy in it."""

    by_value: Floats
    """(N,) derivative by the copy's own distance."""
    by_blend: Floats
    """(N,) derivative by its blend."""

    def __mul__(self, factor: Floats) -> Share:
        return Share(self.by_value * factor, self.by_blend * factor)


def fold(node: Node, values: Iterator[Floats]) -> tuple[Floats, list[Share]]:
    """Distance (N,) of a node by those of its leaves' copies, depth first, and each copy's share in it."""
    if node.is_part and not node.instances:
        value = next(values)
        return value, [Share(np.ones_like(value), np.zeros_like(value))]
    result, shares = np.empty(0), []
    for i, child in enumerate(node.operands):
        value, inner = fold(child, values)
        if i == 0:
            result, shares = value, inner
            continue
        # all three are a smooth minimum of plus or minus their arguments
        operation = node.operation
        a, b = (1.0, 1.0) if operation == "union" else (-1.0, -1.0 if operation == "intersection" else 1.0)
        result, share, fillet = _smooth_minimum(a * result, b * value, child.blend)
        result = a * result
        shares = [one * share for one in shares] + [one * (a * b * (1 - share)) for one in inner]
        if isinstance(child, Part):
            shares[-1] = Share(shares[-1].by_value, a * fillet)
    return result, shares


def _smooth_minimum(a: Floats, b: Floats, k: float) -> tuple[Floats, Floats, Floats]:
    """min(a, b) - max(k - |a - b|, 0)^2 / 4k, its derivative by a (that by b is 1 less it), and by k."""
    if k <= SHARP:
        return np.minimum(a, b), (a <= b).astype(np.float64), np.zeros_like(a)
    share = np.clip(0.5 + (b - a) / (2 * k), 0.0, 1.0)
    mixed = share * (1 - share)
    return share * a + (1 - share) * b - k * mixed, share, -mixed


def weigh(assembly: Assembly, points: NDArray[np.float32]) -> tuple[Floats, Floats]:
    """F (N,) at points (N, 3), and its derivative (L, N) by each leaf's distance, all copies added."""
    copies = copies_at(assembly.parts, points)
    value, shares = fold(assembly, iter(copies))
    firsts = np.cumsum([0, *(len(part.copies) for part in assembly.parts[:-1])])
    return value, np.add.reduceat(np.stack([share.by_value for share in shares]), firsts, axis=0)


def slope(assembly: Assembly, points: NDArray[np.float32], free: list[NDArray[np.bool_]]) -> Slope:
    """F and its derivatives at points (N, 3); `free` marks each leaf's numbers that may move."""
    copies = copies_at(assembly.parts, points)
    value, shares = fold(assembly, iter(copies))
    columns, at = [np.empty((len(points), 0))], 0
    for part, may in zip(assembly.parts, free, strict=True):
        mine = shares[at : at + len(part.copies)]
        at += len(mine)
        if may[:-1].any():
            weight = np.stack([share.by_value for share in mine])
            columns.append(np.einsum("cn,pcn->np", weight, _leaf_slope(part, points, may, len(mine))))
        if may[-1]:
            columns.append(np.sum([share.by_blend for share in mine], axis=0)[:, None])
    return Slope(value, np.concatenate(columns, axis=1))


def _leaf_slope(part: Part, points: NDArray[np.float32], may: NDArray[np.bool_], count: int) -> Floats:
    """(P, copies, N) derivatives of a leaf's copies by its free numbers but the blend.

    One-sided at the end of a range."""
    ends, width = [], []
    for number in np.flatnonzero(may[:-1]):
        step = np.zeros(len(may))
        step[number] = _STEP
        pair = [_moved_or_same(part, step), _moved_or_same(part, -step)]
        ends += pair
        if number < _POSE or (isinstance(part.field, Swept) and number == _POSE):
            width.append(_STEP * sum(end is not part for end in pair))
        else:
            width.append(_apart(pair[0], pair[1], int(number) - _POSE))
    values = copies_at(ends, points)
    high, low = np.moveaxis(values.reshape(len(width), 2, count, -1), 1, 0)
    return np.asarray((high - low) / np.maximum(width, _STEP / 10)[:, None, None])


def _apart(high: Part, low: Part, number: int) -> float:
    return float(numbers(high.field)[number] - numbers(low.field)[number])


def _moved_or_same(part: Part, step: Floats) -> Part:
    try:
        return _moved(part, step)
    except ParameterError:
        return part
