"""Equal parts that a shift, a mirror or a turn takes to one another become one part with instances."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part, Similarity
from partwright.cleaning.dimensions import turned_freely
from partwright.cleaning.fold import siblings
from partwright.cleaning.grid import Grid
from partwright.cleaning.model import Model, quaternion_of
from partwright.cleaning.orientations import Frames, aligned, angle
from partwright.cleaning.patterns import Circle, circles, same_numbers

Floats = NDArray[np.float64]

_TURNED = 1e-4  # degrees


def collapsed(model: Model, frames: Frames, grid: Grid) -> Assembly:
    """The assembly with a part fewer for each that repeats another; numbers free of rounding's dust."""
    rounds = list(circles(model, model.vector, frames, 10 * grid.same))
    assembly = model.assembly
    gone: set[int] = set()
    for leaf, part in enumerate(model.leaves):
        if leaf in gone:
            continue
        repeats = _repeats(model, frames, rounds, leaf, grid.same)
        gone |= set(repeats)
        copies = [c for one in (leaf, *repeats) for c in np.flatnonzero(model.leaf_of == one).tolist()]
        assembly = assembly.replace_part(part.name, _joined(model, frames, rounds, copies, grid))
        for one in repeats:
            assembly = assembly.without(model.leaves[one].name)
    return assembly


def _repeats(model: Model, frames: Frames, rounds: Sequence[Circle], leaf: int, same: float) -> list[int]:
    """Later leaves that repeat it, directly or by way of one another."""
    alike = [
        other
        for group in siblings(model.assembly)
        if leaf in group
        for other in group
        if other > leaf
        and model.leaves[other].blend == 0
        and same_numbers(model.leaves[leaf], model.leaves[other], same)
    ]
    found = [leaf]
    for one in found:  # grows on the way
        found += [
            other
            for other in alike
            if other not in found and _repeated(model, frames, rounds, one, other, same)
        ]
    return sorted(found[1:])


def _repeated(
    model: Model, frames: Frames, rounds: Sequence[Circle], leaf: int, other: int, same: float
) -> bool:
    """Whether copies of the two share a circle, or all of their place but along an axis."""
    freely = turned_freely(model.leaves[leaf].field)
    for a in np.flatnonzero(model.leaf_of == leaf).tolist():
        for b in np.flatnonzero(model.leaf_of == other).tolist():
            if any(a in circle.copies and b in circle.copies for circle in rounds):
                return True
            if angle(model.rotations[a], model.rotations[b], freely) > _TURNED:
                continue
            apart = model.vector[model.places(a)] - model.vector[model.places(b)]
            for frame in frames.rotations:
                shared = np.abs(frame.T @ apart) <= 10 * same
                if aligned(frame, model.rotations[a], freely) is not None and shared.sum() >= 2:
                    return True
    return False


def _joined(
    model: Model, frames: Frames, rounds: Sequence[Circle], copies: Sequence[int], grid: Grid
) -> Part:
    """One part of all these copies, the one at the plainest place first."""
    leaf = model.leaves[int(model.leaf_of[copies[0]])]
    places = {c: [tidy(x, grid) for x in model.vector[model.places(c)].tolist()] for c in copies}
    base = min(copies, key=lambda c: -sum(grid.plain(x) for x in places[c]))
    circle = next((one for one in rounds if base in one.copies), None)
    if circle is not None and circle.copies[0] in copies:
        base = circle.copies[0]
    x, y, z = places[base]
    part = dataclasses.replace(leaf, translation=(x, y, z), rotation=_quaternion(model.rotations[base]))
    others = [c for c in copies if c != base]
    moves = [_move(model, frames, circle, base, c, places, grid) for c in others]
    return dataclasses.replace(part, instances=tuple(moves))


def _move(
    model: Model,
    frames: Frames,
    circle: Circle | None,
    base: int,
    copy: int,
    places: dict[int, list[float]],
    grid: Grid,
) -> Similarity:
    """From the base to a copy: around their circle, else a shift where they are turned alike, else what is
    between the two."""
    turn = model.rotations[copy] @ model.rotations[base].T
    if circle is not None and copy in circle.copies and base in circle.copies:
        steps = circle.copies.index(copy) - circle.copies.index(base)
        turn = circle.turn(frames, steps)
    shift = np.array(places[copy]) - turn @ np.array(places[base])
    x, y, z = (tidy(value, grid) for value in shift.tolist())
    return Similarity(1.0, _quaternion(turn), (x, y, z))


def tidy(value: float, grid: Grid) -> float:
    """Without the dust of rounding: twelve digits, and nothing for next to nothing."""
    return 0.0 if abs(value) < grid.same else float(f"{value:.12g}")


def _quaternion(rotation: Floats) -> tuple[float, float, float, float]:
    w, x, y, z = (0.0 if abs(v) < 1e-15 else v for v in quaternion_of(rotation))
    return w, x, y, z


def unchanged(given: Model, made: Assembly, grid: Grid) -> bool:
    """Whether the assembly is the given one but for rounding and turns that its fields do not show."""
    if [part.name for part in given.leaves] != [part.name for part in made.parts]:
        return False
    other = Model.of(made)
    if not np.array_equal(given.leaf_of, other.leaf_of):
        return False
    if not all(same_numbers(a, b, 10 * grid.same) for a, b in zip(given.leaves, other.leaves, strict=True)):
        return False
    for c in range(len(given.leaf_of)):
        freely = given.freely(c)
        apart = np.abs(given.vector[given.places(c)] - other.vector[other.places(c)])
        if apart.max() > 10 * grid.same or angle(given.rotations[c], other.rotations[c], freely) > _TURNED:
            return False
    return True
