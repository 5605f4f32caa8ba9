"""How far within a profile's walls the corners of faces lie that lean on them.

The nearest place of the outline does not tell: at a corner that goes inwards, where chamfers are mitred, it
is the corner itself, and in a narrow rib the wall across. So each face is measured from the wall that it
faces away from, as if that went on.
"""

from __future__ import annotations

import numpy as np

from partwright.fields.profile import Profile

_FACING = 0.95  # cosine between the ways that a face and its wall face
_BLOCK = 200_000  # pairs of faces and walls at a time


def depth_in_own_walls(profile: Profile, flat: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """(F, 3) of the corners (F, 3, 2) of faces that face ways (F, 2), unit vectors in the plane, away from
    the solid; nan of faces that face as no wall does."""
    sides = [side for loop in profile.sides for side in loop]
    start, end = np.array([s.start for s in sides]), np.array([s.end for s in sides])
    radius, sweep = np.array([s.radius for s in sides]), np.array([s.sweep for s in sides])
    centre = np.array([s.centre or s.start for s in sides])
    middle = np.array([s.middle for s in sides])
    is_arc = np.array([s.centre is not None for s in sides])
    along = end - start
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-12)
    along = along / length[:, None]
    outwards = np.column_stack([along[:, 1], -along[:, 0]])
    turn = np.where(sweep > 0, 1.0, -1.0)
    half = np.cos(np.minimum(np.abs(sweep) / 2, np.pi))
    towards = middle - centre
    towards = towards / np.maximum(np.linalg.norm(towards, axis=1), 1e-12)[:, None]

    result = np.full(flat.shape[:2], np.nan)
    step = max(1, _BLOCK // len(sides))
    for first in range(0, len(flat), step):
        rows = slice(first, first + step)
        points, way = flat[rows], facing[rows]
        place = points.mean(axis=1)
        # (F, S): how far the face's middle is from each side, and how much it faces as that does.
        off = place[:, None] - start
        share = np.clip(np.einsum("fsi,si->fs", off, along), 0, length)
        from_line = np.linalg.norm(off - share[..., None] * along, axis=2)
        spoke = place[:, None] - centre
        reach = np.maximum(np.linalg.norm(spoke, axis=2), 1e-12)
        within = np.einsum("fsi,si->fs", spoke, towards) >= half * reach - 1e-9
        ends = np.minimum(np.linalg.norm(off, axis=2), np.linalg.norm(place[:, None] - end, axis=2))
        apart = np.where(is_arc, np.where(within, np.abs(reach - radius), ends), from_line)
        as_arc = turn * np.einsum("fsi,fi->fs", spoke, way) / reach
        alike = np.where(is_arc, as_arc, way @ outwards.T) > _FACING
        apart = np.where(alike, apart, np.inf)
        own = np.argmin(apart, axis=1)
        deep_line = -np.einsum("fki,fi->fk", points - start[own][:, None], outwards[own])
        deep_arc = (turn * radius)[own][:, None] - turn[own][:, None] * np.linalg.norm(
            points - centre[own][:, None], axis=2
        )
        deep = np.where(is_arc[own][:, None], deep_arc, deep_line)
        result[rows] = np.where(np.isfinite(apart.min(axis=1))[:, None], deep, np.nan)
    return result
