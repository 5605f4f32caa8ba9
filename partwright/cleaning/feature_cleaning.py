"""`clean` for assemblies with extrusions and revolutions: faces, centres and radii at plain numbers.

Along each axis of a frame, faces that nearly coincide become one level and centres another, radii that are
nearly alike one radius, and each of them the plainest number within the tolerance. A profile then meets them
all at once, and its smooth corners stay smooth; where the outline would move too far, some are left out.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.plain_numbers import plain_move
from partwright.assembly import Assembly, Part
from partwright.cleaning.dimensions import dimensions, reaches, values, with_values
from partwright.cleaning.feature_levels import Key, Level, Lying, levels, lying, sides_of, sizes, with_place
from partwright.cleaning.grid import Grid
from partwright.cleaning.hole_standards import is_drawn_in_inches, standard_hole
from partwright.cleaning.model import with_leaves
from partwright.cleaning.outline_equations import (
    Equation,
    Solver,
    bend_at,
    centred,
    coordinate,
    round_of,
    smooth,
)
from partwright.errors import CancelledError, ParameterError
from partwright.fields import Extrusion, Field, Pipe, Revolution, Swept
from partwright.fields.extrusion import RIMS
from partwright.fields.profile import Profile, circle, circle_of
from partwright.methods import Cancellation

Floats = NDArray[np.float64]
T = TypeVar("T")
_Holes = Callable[[float, float], tuple[str, float] | None]
"""The standard hole of a diameter, within a tolerance."""

_SMOOTH = np.radians(3.0)  # corners that turn by less were smooth
_ROUNDED = 1 / 3  # tolerances that rounding may move a number: many are rounded at once
_ROUNDED_OFF = 1e-2  # of a leg of a pipe, that its bends may take more than it has when they are rounded
_OF_A_WALL = 1 / 60  # of a tube's wall, that its radius or the wall itself may move
_FURTHER = 2.0  # tolerances that a corner may go, which two sides move
_DIGITS = 13


@dataclass(frozen=True)
class _Targets:
    """What numbers are to be."""

    levels: dict[tuple[int, int, Key], float]
    """By part, local axis and key: along the frame."""
    sizes: dict[tuple[int, Key], float]
    """By part and key."""


def cleaned_features(assembly: Assembly, tolerance: float, grid: Grid, cancel: Cancellation) -> Assembly:
    """The assembly with plain numbers, no surface moved by more than twice the tolerance."""
    frames: list[Floats] = [np.eye(3)]
    parts = [lying(part, frames, tolerance) for part in assembly.parts]
    holes = partial(standard_hole, unit=assembly.unit, inches=is_drawn_in_inches(assembly))
    targets = _targets(parts, tolerance, grid, holes)
    made = []
    for index, one in enumerate(parts):
        if cancel.requested:
            raise CancelledError("cancelled before the assembly was clean; it stays as it was")
        try:
            made.append(_with_plain_moves(_cleaned(index, one, targets, tolerance, grid), tolerance, grid))
        except ParameterError:  # its numbers would leave nothing of it
            made.append(one.part)
    return with_leaves(assembly, made)


def same_numbers(a: Assembly, b: Assembly, grid: Grid) -> bool:
    """Whether all numbers of the same parts are the same but for rounding."""
    near = 1e3 * grid.same
    return all(
        np.allclose(one.translation, other.translation, atol=near)
        and np.allclose(np.abs(np.dot(one.rotation, other.rotation)), 1.0, atol=1e-9)
        and _same_field(one.field, other.field, near)
        and all(
            np.allclose(m.translation, n.translation, atol=near)
            for m, n in zip(one.instances, other.instances, strict=True)
        )
        for one, other in zip(a.parts, b.parts, strict=True)
    )


def _same_field(one: Field, other: Field, near: float) -> bool:
    if isinstance(one, Pipe) and isinstance(other, Pipe):
        first, second = ([p.radius, p.thickness, *p.corners.ravel()] for p in (one, other))
        return bool(np.allclose(first, second, rtol=0, atol=near))
    if not isinstance(one, Swept) or not isinstance(other, Swept):
        return one == other or bool(np.allclose(values(one), values(other), atol=near))
    lengths = [
        np.array([getattr(field, name) for name in ("height", *RIMS)] if isinstance(field, Extrusion) else [])
        for field in (one, other)
    ]
    corners = np.abs(one.profile.corners - other.profile.corners)
    same = np.allclose(lengths[0], lengths[1], rtol=0, atol=near)
    return same and bool((corners <= [near, near, 1e-5]).all())


def _targets(parts: Sequence[Lying], tolerance: float, grid: Grid, holes: _Holes) -> _Targets:
    found = [level for i, one in enumerate(parts) for level in levels(i, one, tolerance)]
    places: dict[tuple[int, int, Key], float] = {}
    sorts: dict[tuple[int, int, str], list[Level]] = {}
    for one in found:
        frame = next(k for k, other in enumerate(parts) if other.frame is parts[one.part].frame)
        sorts.setdefault((frame, one.axis, one.kind), []).append(one)
    for members in sorts.values():
        for group in groups(members, lambda one: one.value, tolerance):
            value = _plain([one.value for one in group], tolerance, grid)
            places |= {(one.part, one.local, one.key): value for one in group}
    radii: dict[tuple[int, Key], float] = {}
    measured = [size for i, one in enumerate(parts) for size in sizes(i, one, tolerance)]
    for whole in (True, False):
        alike = [size for size in measured if size.whole == whole]
        for same in groups(alike, lambda one: one.value, tolerance):
            radius = _plain_radius([one.value for one in same], whole, tolerance, grid, holes)
            radii |= {(one.part, one.key): radius for one in same}
    return _Targets(places, radii)


def groups(members: Sequence[T], value: Callable[[T], float], reach: float) -> list[list[T]]:
    """Those within `reach` of one another, parted at the widest gaps until they are."""
    pending, found = [sorted(members, key=value)], []
    while pending:
        group = pending.pop()
        if not group:
            continue
        if value(group[-1]) - value(group[0]) <= reach:
            found.append(group)
            continue
        gaps = np.diff([value(one) for one in group])
        at = int(gaps.argmax()) + 1
        pending += [group[:at], group[at:]]
    return found


def _plain(given: Sequence[float], tolerance: float, grid: Grid) -> float:
    """The plainest number near the middle of them; where they are one and plain enough, it."""
    low, high = min(given), max(given)
    middle, limit = (low + high) / 2, _ROUNDED * tolerance
    if high - low <= 10 * grid.same and _kept(middle, limit):
        return float(f"{middle:.12g}") + 0.0
    return next(grid.nearest(middle, limit), middle)


def _kept(value: float, limit: float) -> bool:
    """Whether it is a multiple of a step as coarse as the limit lets one find."""
    power = 10.0 ** np.floor(np.log10(0.8 * limit))
    step = next(f * power for f in (1, 2, 5, 10) if f * power >= 0.8 * limit * (1 - 1e-9))
    return bool(abs(value - round(value / step) * step) <= 1e-9 * max(abs(value), step))


def _plain_radius(given: Sequence[float], whole: bool, tolerance: float, grid: Grid, holes: _Holes) -> float:
    """As `_plain`; what goes all around by its diameter, which may be one of a standard hole."""
    if not whole:
        return _plain(given, tolerance, grid)
    low, high = 2 * min(given), 2 * max(given)
    standard = holes((low + high) / 2, 2 * tolerance - (high - low) / 2)
    plain = _plain([low, high], 2 * tolerance, grid)
    if standard is not None and abs(standard[1] - (low + high) / 2) <= abs(plain - (low + high) / 2):
        return standard[1] / 2
    return plain / 2


def _cleaned(index: int, one: Lying, targets: _Targets, tolerance: float, grid: Grid) -> Part:
    field = one.part.field
    at = one.at.copy()
    wanted = {(local, key): value for (part, local, key), value in targets.levels.items() if part == index}
    for local in range(3):
        k, _ = one.axis(local)
        ends = [wanted.get((local, ("end", end))) for end in (0, 1)]
        if ends[0] is not None and ends[1] is not None and ends[0] != ends[1]:
            at[k] = sum(ends) / 2  # type: ignore[arg-type]
        else:
            at[k] = wanted.get((local, ("place",)), at[k])
    if isinstance(field, Swept):
        free = (0, 1) if isinstance(field, Extrusion) else (2,)
        for local in free:  # the profile goes back by as much
            k, _ = one.axis(local)
            at[k] = _plain([at[k]], tolerance, grid)
        at = _tidy_place(at, grid)
        return with_place(one, at, field=_swept(index, one, at, wanted, targets, tolerance, grid))
    if isinstance(field, Pipe):
        at = _tidy_place(np.array([_plain([v], tolerance, grid) for v in at.tolist()]), grid)
        return with_place(one, at, field=_pipe(index, one, field, at, wanted, targets, grid))
    numbers = values(field)
    for k in range(len(numbers)):
        numbers[k] = targets.sizes.get((index, ("number", k)), numbers[k])
    return with_place(one, _tidy_place(at, grid), field=_with_ends(field, numbers, wanted))


def _tidy_place(at: Floats, grid: Grid) -> Floats:
    """Without the dust of rounding."""
    digits = 4 - round(np.log10(grid.step)) + 4
    return np.array([round(v, digits) + 0.0 for v in at.tolist()])


def _with_ends(field: Field, numbers: Floats, wanted: dict[tuple[int, Key], float]) -> Field:
    """The solid between the levels of its ends. numbers: its own, radii already as they are to be."""
    reach = reaches(field)
    if reach is None:
        return field
    for local in range(3):
        ends = [wanted.get((local, ("end", end))) for end in (0, 1)]
        own = [k for k in np.flatnonzero(reach[local]) if _is_length(field, int(k))]
        if None not in ends and len(own) == 1:
            rest = reach[local] @ numbers - reach[local, own[0]] * numbers[own[0]]
            numbers[own[0]] = (abs(ends[1] - ends[0]) / 2 - rest) / reach[local, own[0]]  # type: ignore[operator]
    return with_values(type(field), np.array([float(f"{n:.{_DIGITS}g}") for n in numbers]))


def _is_length(field: Field, index: int) -> bool:
    return dimensions(type(field))[index].attribute in ("size", "height")


def _swept(
    index: int,
    one: Lying,
    at: Floats,
    wanted: dict[tuple[int, Key], float],
    targets: _Targets,
    tolerance: float,
    grid: Grid,
) -> Swept:
    field = one.part.field
    assert isinstance(field, Extrusion | Revolution)
    turned = isinstance(field, Revolution)
    axes: tuple[int | None, ...] = (None, 2) if turned else (0, 1)
    moved = one.turn.T @ (one.at - at)
    shift = (0.0, float(moved[2])) if turned else (float(moved[0]), float(moved[1]))
    profile = field.profile.moved(shift)

    def local(axis: int, value: float) -> float:
        k, sign = one.axis(axis)
        return sign * (value - float(at[k]))

    profile = _with_circles(profile, axes, wanted, local, targets.sizes, index)
    solver = Solver(profile, _FURTHER * tolerance)
    size = profile.size
    lines: list[Equation] = []
    rounds: list[Equation] = []
    centres: list[Equation] = []
    for k, axis in enumerate(axes):
        for (own, key), value in wanted.items():
            if own != axis or axis is None:
                continue
            if key[0] == "side":
                lines += [coordinate(int(c), k, local(axis, value)) for c in key[1:]]
            elif key[0] == "arc":
                centres.append(centred(int(key[1]), int(key[2]), k, local(axis, value)))
    for (part, key), radius in targets.sizes.items():
        if part == index and key[0] == "arc":
            rounds.append(round_of(int(key[1]), int(key[2]), radius))
        elif part == index and key[0] == "turned":
            lines += [coordinate(int(c), 0, radius) for c in key[1:]]
    if turned:
        on_axis = [
            coordinate(c, 0, 0.0) for c in np.flatnonzero(profile.corners[:, 0] < 1e-9 * size).tolist()
        ]
        solver.take(on_axis)
    smooths = [
        smooth(a, b, c, size)
        for loop in range(len(profile.loops))
        if circle_of(profile.loops[loop]) is None
        for (a, b), (_, c) in _pairs(dataclasses.replace(field, profile=profile), loop)
        if abs(bend_at(profile.corners, a, b, c)) < _SMOOTH and profile.corners[[a, b], 2].any()
    ]
    for equations in (lines, smooths, rounds, centres):
        solver.take(equations)
    corners = solver.profile.corners
    left = solver.free()
    solver.take([coordinate(c, k, _plain([float(corners[c, k])], tolerance, grid)) for c, k in left])
    made = _tidied(solver.profile)
    if isinstance(field, Revolution):
        return dataclasses.replace(field, profile=made)
    ends = [wanted.get((2, ("end", end))) for end in (0, 1)]
    rims = {name: targets.sizes.get((index, ("rim", name)), getattr(field, name)) for name in RIMS}
    height = field.height
    if ends[0] is not None and ends[1] is not None and ends[0] != ends[1]:
        height = float(f"{abs(ends[1] - ends[0]):.{_DIGITS}g}")
    return dataclasses.replace(field, profile=made, height=height, **rims)


def _pipe(
    index: int,
    one: Lying,
    field: Pipe,
    at: Floats,
    wanted: dict[tuple[int, Key], float],
    targets: _Targets,
    grid: Grid,
) -> Pipe:
    """With its corners at the levels that they are to be at, and of a tube no number that moves by more than
    its wall allows."""
    most = field.thickness * _OF_A_WALL if field.thickness else np.inf

    def near(target: float, own: float) -> float:
        return target if abs(target - own) <= most else next(grid.nearest(own, most), own)

    path = []
    for i, (*_, bend) in enumerate(field.path):
        place = []
        for local in range(3):
            k, sign = one.axis(local)
            own = float(one.at[k]) + sign * field.path[i][local]
            there = near(wanted[local, ("corner", i)], own)
            place.append(float(f"{sign * (there - float(at[k])):.{_DIGITS}g}"))
        path.append((place[0], place[1], place[2], near(targets.sizes.get((index, ("bend", i)), bend), bend)))
    radius = near(targets.sizes[index, ("radius",)], field.radius)
    wall = near(targets.sizes.get((index, ("thickness",)), 0.0), field.thickness)
    made = dataclasses.replace(field, radius=radius, thickness=wall)
    return made.with_corners(np.array(path), _ROUNDED_OFF)


def _pairs(field: Swept, loop: int) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    """Sides of a loop and those that follow."""
    sides = list(sides_of(field, loop))
    return list(zip(sides, sides[1:] + sides[:1], strict=True))


def _with_circles(
    profile: Profile,
    axes: Sequence[int | None],
    wanted: dict[tuple[int, Key], float],
    local: Callable[[int, float], float],
    radii: dict[tuple[int, Key], float],
    index: int,
) -> Profile:
    """With circles about their centres, of their radii."""
    loops = []
    for number, loop in enumerate(profile.loops):
        whole = circle_of(loop)
        if whole is not None:
            x, y = (
                c if axis is None else local(axis, wanted.get((axis, ("circle", number)), np.nan))
                for c, axis in zip(whole[1], axes, strict=True)
            )
            radius = radii.get((index, ("circle", number)), whole[0])
            loop = circle(radius, (x, y)) if np.isfinite([x, y]).all() else loop
        loops.append(loop)
    return Profile.of_loops(loops)


def _tidied(profile: Profile) -> Profile:
    """Without the dust of rounding."""

    def tidy(value: float) -> float:
        return round(value, max(0, _DIGITS - 1 - int(np.ceil(np.log10(profile.size))))) + 0.0

    loops = [tuple((tidy(x), tidy(y), b) for x, y, b in loop) for loop in profile.loops]
    return Profile.of_loops(loops)


def _with_plain_moves(part: Part, tolerance: float, grid: Grid) -> Part:
    """Copies that are shifted, also after quarter turns, go by plain lengths."""

    def number(value: float) -> float:
        return _plain([value], tolerance, grid) if value else 0.0

    return dataclasses.replace(part, instances=tuple(plain_move(move, number) for move in part.instances))
