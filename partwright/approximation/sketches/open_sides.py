"""Sides of a cut that lie in the air: further out, so that no sliver is left where a wall was meant to go."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from partwright.approximation.sketches.ends import BEYOND, STEPS
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import Box, Extrusion
from partwright.fields.profile import Corner, Profile

_ALONG, _UP = 9, 5  # points along a side, and levels, that are looked at
_INSET = 0.04  # of a side's length, at its ends
_SLANT = 0.4  # sine of the least angle between a side and one that it is moved along


def with_open_sides(part: Part, distance: Callable[[np.ndarray], np.ndarray]) -> Part:
    """The cut with straight sides of its outline moved out where there is nothing behind them, for any copy.

    distance: (N,) of the shape at points (N, 3), unit lengths like the part, negative inside. A box or an
    extrusion without taper; others stay as they are.
    """
    field = part.field
    if isinstance(field, Box):
        x, y, height = field.size
        profile = Profile.rectangle(x, y)
    elif isinstance(field, Extrusion) and not field.taper:
        profile, height = field.profile, field.height
    else:
        return part
    corners = [np.array(corner) for corner in profile.outline]
    open_ = [
        not corner[2] and _is_open(part, profile, i, height, distance) for i, corner in enumerate(corners)
    ]
    if not any(open_):
        return part
    try:
        moved = Profile(_moved(corners, open_), profile.holes)
    except ParameterError:
        return part
    lower, upper = moved.bounds()
    middle = (lower + upper) / 2
    frame = rotation_matrix(part.rotation)
    x, y, z = (np.array(part.translation) + frame[:, :2] @ middle).tolist()
    if isinstance(field, Box):
        width, depth = (upper - lower).tolist()
        return dataclasses.replace(part, field=Box((width, depth, height)), translation=(x, y, z))
    try:
        centred = dataclasses.replace(field, profile=moved.moved(-middle))
    except ParameterError:  # its rims have no room there
        return part
    return dataclasses.replace(part, field=centred, translation=(x, y, z))


def _is_open(
    part: Part, profile: Profile, side: int, height: float, distance: Callable[[np.ndarray], np.ndarray]
) -> bool:
    start, end = (np.array(profile.outline[k % len(profile.outline)][:2]) for k in (side, side + 1))
    share = np.linspace(_INSET, 1 - _INSET, _ALONG)
    levels = np.linspace(-0.48, 0.48, _UP) * height
    outwards = _outwards(start, end)
    flat = np.concatenate([start + share[:, None] * (end - start) + step * outwards for step in STEPS])
    local = np.concatenate([np.column_stack([flat, np.full(len(flat), z)]) for z in levels])
    return all(
        bool((distance(local @ rotation_matrix(copy.rotation).T + copy.translation) > 0).all())
        for copy in part.copies
    )


def _outwards(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    x, y = (end - start) / np.linalg.norm(end - start)
    return np.array([y, -x])


def _moved(corners: list[np.ndarray], open_: list[bool]) -> tuple[Corner, ...]:
    """Each open side further out: along its neighbours where they are lines, else with a step."""
    count = len(corners)
    result: list[Corner] = []
    for i, corner in enumerate(corners):
        before, after = i - 1, i
        point, bulge = corner[:2], float(corner[2])
        if not open_[before] and not open_[after]:
            result.append((float(point[0]), float(point[1]), bulge))
            continue
        normals = {
            k: _outwards(corners[k][:2], corners[(k + 1) % count][:2]) for k in (before, after) if open_[k]
        }
        if len(normals) == 2:
            both = np.array([normals[before], normals[after]])
            if abs(np.linalg.det(both)) > _SLANT:
                x, y = (point + np.linalg.solve(both, [BEYOND, BEYOND])).tolist()
                result.append((x, y, bulge))
            else:
                result += [(*_along(point, normals[k], BEYOND), 0.0) for k in (before, after)]
            continue
        (side, normal), other = next(iter(normals.items())), before if open_[after] else after
        way = corners[(other + 1) % count][:2] - corners[other][:2]
        way = way / np.linalg.norm(way)
        lean = float(way @ normal)
        if not corners[other][2] and abs(lean) > _SLANT:
            result.append((*_along(point, way, BEYOND / lean), bulge))
        elif side == after:
            result += [(float(point[0]), float(point[1]), 0.0), (*_along(point, normal, BEYOND), bulge)]
        else:
            result += [(*_along(point, normal, BEYOND), 0.0), (float(point[0]), float(point[1]), bulge)]
    return tuple(result)


def _along(point: np.ndarray, way: np.ndarray, length: float) -> tuple[float, float]:
    x, y = (point + length * way).tolist()
    return x, y
