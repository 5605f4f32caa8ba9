"""The faces of a part, each of which can be moved outwards or inwards by itself: ends, walls, the sides of a
profile, a round wall by its radius."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Box, Cylinder, Extrusion, Revolution
from partwright.fields.profile import Loop, Profile, Side
from partwright.fields.profile_offset import kept_bulge, parallels_cross, turn_between

Floats = NDArray[np.float64]

_SHARP = 1e-3  # of the sum of two unit normals at a corner


@dataclass(frozen=True)
class Face:
    """beyond: (N,) how far points (N, 3) of the part's own frame lie beyond it, negative within. moved: the
    part with it so much further out.

    `moved` raises ParameterError where it cannot.
    """

    beyond: Callable[[Floats], Floats]
    moved: Callable[[float], Part]


def faces_of(part: Part) -> Iterator[Face]:
    """Of a box, a cylinder, an extrusion with upright walls or a revolution; none of others."""
    field = part.field
    if isinstance(field, Box):
        for axis in range(3):
            for sign in (-1.0, 1.0):
                yield _wall_of_box(part, field, axis, sign)
    elif isinstance(field, Cylinder):
        yield _round_wall(part, field)
        yield from _ends(part, field)
    elif isinstance(field, Extrusion) and not field.taper:
        yield from _sides(part, field, lambda points: points[:, :2])
        if not field.has_rims:
            yield from _ends(part, field)
    elif isinstance(field, Revolution):
        yield from _sides(part, field, _half_plane)


def _half_plane(points: Floats) -> Floats:
    return np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])


def _wall_of_box(part: Part, field: Box, axis: int, sign: float) -> Face:
    def beyond(points: Floats) -> Floats:
        return sign * points[:, axis] - field.size[axis] / 2

    def moved(by: float) -> Part:
        x, y, z = (side + by * (k == axis) for k, side in enumerate(field.size))
        return _shifted(replace(part, field=Box((x, y, z))), axis, sign * by / 2)

    return Face(beyond, moved)


def _round_wall(part: Part, field: Cylinder) -> Face:
    def beyond(points: Floats) -> Floats:
        return np.asarray(np.hypot(points[:, 0], points[:, 1]) - field.radius)

    return Face(beyond, lambda by: replace(part, field=replace(field, radius=field.radius + by)))


def _ends(part: Part, field: Cylinder | Extrusion) -> Iterator[Face]:
    def beyond(sign: float, points: Floats) -> Floats:
        return sign * points[:, 2] - field.height / 2

    def moved(sign: float, by: float) -> Part:
        longer = replace(part, field=replace(field, height=field.height + by))
        return _shifted(longer, 2, sign * by / 2)

    for sign in (-1.0, 1.0):
        yield Face(partial(beyond, sign), partial(moved, sign))


def _shifted(part: Part, axis: int, by: float) -> Part:
    x, y, z = (np.array(part.translation) + by * rotation_matrix(part.rotation)[:, axis]).tolist()
    return replace(part, translation=(x, y, z))


def _sides(part: Part, field: Extrusion | Revolution, seen: Callable[[Floats], Floats]) -> Iterator[Face]:
    """seen: points (N, 2) of the profile's plane for those (N, 3) of the part's frame."""

    def beyond(side: Side, points: Floats) -> Floats:
        return beyond_side(side, seen(points))

    def moved(loop: int, k: int, by: float) -> Part:
        return replace(part, field=replace(field, profile=with_side_moved(field.profile, loop, k, by)))

    for loop, sides in enumerate(field.profile.sides):
        for k, side in enumerate(sides):
            yield Face(partial(beyond, side), partial(moved, loop, k))


def beyond_side(side: Side, points: Floats) -> Floats:
    """(N,) how far points (N, 2) lie beyond a side's line or circle, on its right."""
    if side.centre is None:
        x, y = side.direction()
        return np.asarray((points - np.array(side.start)) @ np.array([y, -x]))
    off = np.linalg.norm(points - np.array(side.centre), axis=1) - side.radius
    return off if side.sweep > 0 else -off


def with_side_moved(profile: Profile, loop: int, k: int, by: float) -> Profile:
    """The profile with a side so much further out, parallel to where it was; those beside it go as far.

    Raises:
        ParameterError: they do not meet it, or the outline crosses itself then.
    """
    sides = profile.sides[loop]
    before, side, after = sides[k - 1], sides[k], sides[(k + 1) % len(sides)]
    if len(sides) < 3:
        raise ParameterError("profile: a circle has no side to be moved by itself")
    start = _crossing(before, side, 0.0, -by)
    end = _crossing(side, after, -by, 0.0)
    places = [one.start for one in sides]
    places[k], places[(k + 1) % len(sides)] = start, end
    bulges = [one.bulge for one in sides]
    for i, depth in ((k - 1, 0.0), (k, -by), ((k + 1) % len(sides), 0.0)):
        first, last = places[i], places[(i + 1) % len(sides)]
        bulges[i] = kept_bulge(sides[i], first, last, depth, True)
    moved: Loop = tuple((*place, bulge) for place, bulge in zip(places, bulges, strict=True))
    loops = [*profile.loops[:loop], moved, *profile.loops[loop + 1 :]]
    return Profile.of_loops(loops)


def with_corners_moved(part: Part, loop: int, corners: Collection[int], by: float) -> Part:
    """An extrusion or a revolution with corners of its profile so much further out, each along its bisector;
    the sides beside them turn about their other ends, or go along.

    Raises:
        ParameterError: the outline crosses itself then.
    """
    field = part.field
    assert isinstance(field, Extrusion | Revolution)
    sides, moved = field.profile.sides[loop], list(field.profile.loops[loop])
    for k in corners:
        x, y = (sides[k - 1].direction(at_end=True) + sides[k].direction()).tolist()
        inwards = np.array([-y, x])
        length = float(np.linalg.norm(inwards))
        if length < _SHARP:
            raise ParameterError("profile: a tip has no bisector to be moved along")
        x, y = (sides[k].start - by * inwards / length).tolist()
        moved[k] = x, y, moved[k][2]
    loops = field.profile.loops
    profile = Profile.of_loops((*loops[:loop], tuple(moved), *loops[loop + 1 :]))
    return replace(part, field=replace(field, profile=profile))


def without_corners(part: Part, loop: int, first: int, count: int) -> Part:
    """An extrusion or a revolution whose profile goes straight from before some corners to after them.

    Raises:
        ParameterError: the outline crosses itself then, or hardly one is left.
    """
    field = part.field
    assert isinstance(field, Extrusion | Revolution)
    loops = field.profile.loops
    own = [*loops[loop][first:], *loops[loop][:first]][count:]
    if len(own) < 3:
        raise ParameterError("profile: too few corners would be left of a loop")
    x, y, _ = own[-1]
    profile = Profile.of_loops((*loops[:loop], (*own[:-1], (x, y, 0.0)), *loops[loop + 1 :]))
    return replace(part, field=replace(field, profile=profile))


def _crossing(before: Side, after: Side, deep: float, deeper: float) -> tuple[float, float]:
    """Where two neighbours meet, each so deep within: the place that is nearer to their corner."""
    turn = 1.0 if turn_between(before, after) > 0 else -1.0
    return parallels_cross(before, after, deep, deeper, turn)
