"""How far within a profile's walls the corners of faces lie that lean on them.

The nearest place of the outline does not tell: at a corner that goes inwards, where chamfers are mitred, it
is the corner itself, and in a narrow rib the wall across. So each face is measured from the wall that it
faces away from, as if that went on. `profile_distance` has the nearest of all sides alone; here each side's
distance is asked for, to choose among those that face as the face does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from partwright.fields.profile import Profile

_FACING = 0.95  # cosine between the ways that a face and its wall face
_BLOCK = 200_000  # pairs of faces and walls at a time
_SHORT = 1e-12  # lengths and radii that nothing is divided by


def depth_in_own_walls(profile: Profile, flat: np.ndarray, facing: np.ndarray) -> np.ndarray:
    """(F, 3) of the corners (F, 3, 2) of faces that face ways (F, 2), unit vectors in the plane, away from
    the solid; nan of faces that face as no wall does."""
    walls = _Walls.of(profile)
    result = np.full(flat.shape[:2], np.nan)
    step = max(1, _BLOCK // len(walls.start))
    for first in range(0, len(flat), step):
        rows = slice(first, first + step)
        middles = flat[rows].mean(axis=1)
        alike = walls.facing(middles, facing[rows]) > _FACING
        own = np.argmin(np.where(alike, walls.apart(middles), np.inf), axis=1)
        result[rows] = np.where(alike.any(axis=1, keepdims=True), walls.depth(flat[rows], own), np.nan)
    return result


@dataclass(frozen=True, eq=False)
class _Walls:
    """Sides of a profile: start, end, centre (S, 2), of lines the start; middle (S, 2) of its way; radius and
    turn (S,), the latter -1 where an arc runs clockwise; half: cosine of half its angle; is_arc (S,)."""

    start: np.ndarray
    end: np.ndarray
    centre: np.ndarray
    middle: np.ndarray
    radius: np.ndarray
    turn: np.ndarray
    half: np.ndarray
    is_arc: np.ndarray

    @classmethod
    def of(cls, profile: Profile) -> _Walls:
        sides = [side for loop in profile.sides for side in loop]
        sweep = np.array([side.sweep for side in sides])
        return cls(
            np.array([side.start for side in sides]),
            np.array([side.end for side in sides]),
            np.array([side.centre or side.start for side in sides]),
            np.array([side.middle for side in sides]),
            np.array([side.radius for side in sides]),
            np.where(sweep > 0, 1.0, -1.0),
            np.cos(np.abs(sweep) / 2),
            np.array([side.centre is not None for side in sides]),
        )

    def apart(self, places: np.ndarray) -> np.ndarray:
        """(F, S) how far places (F, 2) are from each."""
        off = places[:, None] - self.start
        share = np.clip(np.einsum("fsi,si->fs", off, self._along), 0, self._length)
        from_line = np.linalg.norm(off - share[..., None] * self._along, axis=2)
        spoke = places[:, None] - self.centre
        reach = np.linalg.norm(spoke, axis=2)
        towards = _units(self.middle - self.centre)
        within = np.einsum("fsi,si->fs", spoke, towards) >= self.half * reach - 1e-9
        ends = np.minimum(np.linalg.norm(off, axis=2), np.linalg.norm(places[:, None] - self.end, axis=2))
        return np.where(self.is_arc, np.where(within, np.abs(reach - self.radius), ends), from_line)

    def facing(self, places: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """(F, S) cosine between ways (F, 2) and those that the sides face, of arcs as seen from places."""
        spoke = _units(places[:, None] - self.centre)
        as_arc = self.turn * np.einsum("fsi,fi->fs", spoke, ways)
        return np.where(self.is_arc, as_arc, ways @ self._outwards.T)

    def depth(self, points: np.ndarray, own: np.ndarray) -> np.ndarray:
        """(F, 3) how far points (F, 3, 2) lie within the sides own (F,), as if these went on."""
        line = -np.einsum("fki,fi->fk", points - self.start[own][:, None], self._outwards[own])
        reach = np.linalg.norm(points - self.centre[own][:, None], axis=2)
        arc = self.turn[own][:, None] * (self.radius[own][:, None] - reach)
        return np.where(self.is_arc[own][:, None], arc, line)

    @property
    def _length(self) -> np.ndarray:
        return np.linalg.norm(self.end - self.start, axis=1)

    @property
    def _along(self) -> np.ndarray:
        return _units(self.end - self.start)

    @property
    def _outwards(self) -> np.ndarray:
        along = self._along
        return np.column_stack([along[:, 1], -along[:, 0]])


def _units(ways: np.ndarray) -> np.ndarray:
    return ways / np.maximum(np.linalg.norm(ways, axis=-1, keepdims=True), _SHORT)
