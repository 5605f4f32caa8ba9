"""Sides of a cut that lie in the air: further out, so that no sliver is left where a wall was meant to go."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from partwright.approximation.profile_parts import with_profile
from partwright.approximation.sketches.ends import BEYOND
from partwright.approximation.sketches.holes import is_empty
from partwright.approximation.sketches.open_turns import (
    beside,
    in_the_air,
    room,
    with_grown_sides,
    with_open_turns,
)
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Box, Extrusion, Field, Revolution
from partwright.fields.profile import Corner, Loop, Profile, Side

_UP = 5  # levels that are looked at
_SLANT = 0.4  # sine of the least angle between a side and one that it is moved along


def with_open_sides(part: Part, distance: Callable[[np.ndarray], np.ndarray], reach: float = BEYOND) -> Part:
    """The cut with sides of its outline moved out where there is nothing behind them, for any copy, and
    without holes that would leave nothing of the shape.

    distance: (N,) of the shape at points (N, 3), unit lengths like the part, negative inside. reach: how far
    a side goes out, or a quarter of that where there is no more room. A box, an extrusion without taper, or
    a revolution; others stay as they are.
    """
    part = _without_islands(part, distance)
    field = part.field
    if isinstance(field, Revolution):
        return with_open_turns(part, field, distance, reach)
    if isinstance(field, Box):
        x, y, height = field.size
        profile = Profile.rectangle(x, y)
    elif isinstance(field, Extrusion) and not field.taper:
        profile, height = field.profile, field.height
    else:
        return part
    levels = np.linspace(-0.48, 0.48, _UP) * height

    def is_open(side: Side, by: float) -> bool:
        flat = beside(side, by)
        local = np.concatenate([np.column_stack([flat, np.full(len(flat), z)]) for z in levels])
        return in_the_air(local, part, distance)

    sides = profile.sides[0]
    out = {side: room(side, is_open, reach) for side in sides}
    if not any(out.values()):
        return part
    if isinstance(field, Extrusion) and any(out[side] for side in sides if side.bulge):
        grown = with_grown_sides(part, field, lambda side: out.get(side, 0.0), distance)
        if grown is not part:
            return centred(grown)
    by = [0.0 if side.bulge else out[side] for side in sides]
    if not any(by):
        return part
    corners = [np.array(corner) for corner in profile.outline]
    try:
        moved = Profile(_moved(corners, by), profile.holes)
    except ParameterError:
        return part
    if isinstance(field, Box):
        lower, upper = moved.bounds()
        width, depth = (upper - lower).tolist()
        return _shifted(part, Box((width, depth, height)), (lower + upper) / 2)
    try:
        return centred(dataclasses.replace(part, field=dataclasses.replace(field, profile=moved)))
    except ParameterError:  # its rims have no room there
        return part


def _without_islands(part: Part, distance: Callable[[np.ndarray], np.ndarray]) -> Part:
    """The cut without those holes of its profile in which there is nothing of the shape: vents in the floor
    of what is hollowed, cut before, would stay as skins."""
    field = part.field
    if not isinstance(field, Extrusion) or field.taper or not field.profile.holes:
        return part

    def is_island(loop: Loop) -> bool:
        island = dataclasses.replace(part, field=Extrusion(Profile(loop), field.height))
        return not is_empty(island, distance)

    kept = tuple(loop for loop in field.profile.holes if is_island(loop))
    if len(kept) == len(field.profile.holes):
        return part
    profile = Profile(field.profile.outline, kept)
    if field.has_rims:
        return dataclasses.replace(part, field=dataclasses.replace(field, profile=profile))
    return dataclasses.replace(with_profile(part, profile), instances=part.instances, name=part.name)


def centred(part: Part) -> Part:
    """The same extrusion with its profile about the part's place."""
    assert isinstance(part.field, Extrusion)
    lower, upper = part.field.profile.bounds()
    middle = (lower + upper) / 2
    profile = part.field.profile.moved(-middle)
    return _shifted(part, dataclasses.replace(part.field, profile=profile), middle)


def _shifted(part: Part, field: Field, by: np.ndarray) -> Part:
    x, y, z = (np.array(part.translation) + rotation_matrix(part.rotation)[:, :2] @ by).tolist()
    return dataclasses.replace(part, field=field, translation=(x, y, z))


def _outwards(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    x, y = (end - start) / np.linalg.norm(end - start)
    return np.array([y, -x])


def _moved(corners: list[np.ndarray], by: list[float]) -> tuple[Corner, ...]:
    """Each side further out by a length: along its neighbours where they are lines, else with a step."""
    count = len(corners)
    result: list[Corner] = []
    for i, corner in enumerate(corners):
        before, after = i - 1, i
        point, bulge = corner[:2], float(corner[2])
        if not by[before] and not by[after]:
            result.append((float(point[0]), float(point[1]), bulge))
            continue
        normals = {
            k: _outwards(corners[k][:2], corners[(k + 1) % count][:2]) for k in (before, after) if by[k]
        }
        if len(normals) == 2:
            both = np.array([normals[before], normals[after]])
            if abs(np.linalg.det(both)) > _SLANT:
                x, y = (point + np.linalg.solve(both, [by[before], by[after]])).tolist()
                result.append((x, y, bulge))
            else:
                result += [(*_along(point, normals[k], by[k]), 0.0) for k in (before, after)]
            continue
        (side, normal), other = next(iter(normals.items())), before if by[after] else after
        way = corners[(other + 1) % count][:2] - corners[other][:2]
        way = way / np.linalg.norm(way)
        lean = float(way @ normal)
        if not corners[other][2] and abs(lean) > _SLANT:
            result.append((*_along(point, way, by[side] / lean), bulge))
        elif side == after:
            result += [(float(point[0]), float(point[1]), 0.0), (*_along(point, normal, by[side]), bulge)]
        else:
            result += [(*_along(point, normal, by[side]), 0.0), (float(point[0]), float(point[1]), bulge)]
    return tuple(result)


def _along(point: np.ndarray, way: np.ndarray, length: float) -> tuple[float, float]:
    x, y = (point + length * way).tolist()
    return x, y
