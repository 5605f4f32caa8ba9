"""Paths of straight runs and bends: corners with the radius in which each is taken, as tubes are bent."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.operations import is_tensor, library

NEAR = 1e-9
"""Of a path's length: feet so little beyond the ends of runs and bends, which meet there, count."""
_TINY = 1e-30
_LEAST_SINE = 1e-12  # of a turn, that nothing is divided by less than
_STRAIGHT = 1e-7  # radians: a corner that turns by less has no bend
_SHARPEST = math.radians(175)  # a corner that turns by more lies too far out to say where the bend is


class Run(NamedTuple):
    """A straight piece of the path from `start` to `end`, (3,) each."""

    start: np.ndarray
    end: np.ndarray

    @property
    def length(self) -> float:
        return math.dist(self.start, self.end)

    def at(self, share: np.ndarray) -> np.ndarray:
        """(K, 3) places at shares (K,) of the way."""
        return np.asarray(self.start + share[:, None] * (self.end - self.start))

    def directions(self, share: np.ndarray) -> np.ndarray:
        """(K, 3) unit tangents there."""
        return np.tile((self.end - self.start) / self.length, (len(share), 1))

    def squared(self, points: Any, near: float) -> Any:
        """(N,) squared distance at points (N, 3) whose foot lies on the run, infinite at others."""
        xp, length = library(points), self.length
        off = points - like(points, self.start)
        along = off @ like(points, (self.end - self.start) / length)
        across = (off * off).sum(-1) - along * along
        there = (along >= -near) & (along <= length + near)
        return xp.where(there, xp.clip(across, 0.0, None), math.inf)


class Bend(NamedTuple):
    """An arc of the path, from where unit vector `outwards` (3,) points from its centre towards `along`, the
    path's direction there, by `angle` radians."""

    centre: np.ndarray
    outwards: np.ndarray
    along: np.ndarray
    radius: float
    angle: float

    @property
    def length(self) -> float:
        return self.radius * self.angle

    @property
    def axis(self) -> np.ndarray:
        """(3,) unit vector about which the path turns."""
        return np.cross(self.outwards, self.along)

    def turned(self, vector: np.ndarray) -> np.ndarray:
        """The vector (3,) as the bend turns it from its beginning to its end."""
        cosine, sine = math.cos(self.angle), math.sin(self.angle)
        level = float(self.axis @ vector) * self.axis
        return np.asarray(level + cosine * (vector - level) + sine * np.cross(self.axis, vector))

    def at(self, share: np.ndarray) -> np.ndarray:
        turn = share[:, None] * self.angle
        spoke = np.cos(turn) * self.outwards + np.sin(turn) * self.along
        return np.asarray(self.centre + self.radius * spoke)

    def directions(self, share: np.ndarray) -> np.ndarray:
        turn = share[:, None] * self.angle
        return np.asarray(np.cos(turn) * self.along - np.sin(turn) * self.outwards)

    def squared(self, points: Any, near: float) -> Any:
        """As of a run."""
        xp = library(points)
        off = points - like(points, self.centre)
        x, y = off @ like(points, self.outwards), off @ like(points, self.along)
        reach = xp.sqrt(x * x + y * y + _TINY)
        beyond = y * math.cos(self.angle) - x * math.sin(self.angle)
        there = (y >= -near) & (beyond <= near)
        above = xp.clip((off * off).sum(-1) - x * x - y * y, 0.0, None)
        return xp.where(there, (reach - self.radius) ** 2 + above, math.inf)


def bent_path(corners: np.ndarray) -> tuple[Run | Bend, ...]:
    """The pieces of a path, in order, by its corners (K, 4): x, y, z and the radius of the bend there. Each
    goes over smoothly into the next.

    Raises:
        ParameterError: neighbours are the same point, or a bend does not fit between its own or turns by
            more than 175 degrees.
    """
    places, bends = corners[:, :3], corners[:, 3]
    steps = np.diff(places, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    near = NEAR * float(lengths.sum())
    short = np.flatnonzero(lengths <= near)
    if len(short):
        raise ParameterError(f"pipe: path[{short[0]}] and the corner after it are the same point")
    ways = steps / lengths[:, None]
    found: list[Run | Bend] = []
    start, left = places[0], float(lengths[0])
    for i in range(1, len(places) - 1):
        before, after = ways[i - 1], ways[i]
        turn = _turn(before, after)
        if turn < _STRAIGHT:
            left += float(lengths[i])
            continue
        if turn > _SHARPEST:
            raise ParameterError(
                f"pipe: it turns by {math.degrees(turn):.3g} degrees at path[{i}]; expected 175 at most; "
                "half a turn is two corners"
            )
        reach = float(bends[i]) * math.tan(turn / 2)
        _check_fits(i, reach, left, near)
        begin = places[i] - reach * before
        if left - reach > near:
            found.append(Run(start, begin))
        found.append(bend_between(before, after, begin, float(bends[i])))
        start, left = places[i] + reach * after, float(lengths[i]) - reach
        _check_fits(i, reach, float(lengths[i]), near)
    if left > near:
        found.append(Run(start, places[-1]))
    return tuple(found)


def bend_between(before: np.ndarray, after: np.ndarray, begin: np.ndarray, radius: float) -> Bend:
    """The bend from one direction (3,) to another, unit vectors, that begins at a place (3,)."""
    inwards = after - float(after @ before) * before
    inwards = inwards / max(float(np.linalg.norm(inwards)), _LEAST_SINE)
    return Bend(begin + radius * inwards, -inwards, before, radius, _turn(before, after))


def bent_corners(corners: np.ndarray) -> np.ndarray:
    """The corners (K, 4) without those between the ends at which the path goes straight on."""
    ways = np.diff(corners[:, :3], axis=0)
    turns = [_turn(before, after) for before, after in pairwise(ways)]
    return corners[[True, *(turn >= _STRAIGHT for turn in turns), True]]


def _turn(before: np.ndarray, after: np.ndarray) -> float:
    """Radians between two directions."""
    return math.atan2(float(np.linalg.norm(np.cross(before, after))), float(before @ after))


def perpendicular(vector: np.ndarray) -> np.ndarray:
    """A unit vector (3,) across another."""
    across = np.cross(vector, np.eye(3)[int(np.abs(vector).argmin())])
    return np.asarray(across / np.linalg.norm(across))


def _check_fits(i: int, reach: float, left: float, near: float) -> None:
    if reach > left + near:
        raise ParameterError(
            f"pipe: the bend of path[{i}] takes {reach:.6g} of each side, where {left:.6g} is left; "
            "expected a smaller bend"
        )


def with_fitting_bends(corners: np.ndarray, share: float) -> np.ndarray:
    """Corners (K, 4) with bends a little smaller where those at the ends of a leg take more than it has, by
    at most this share of it: as corners that were rounded do. What lacks more stays as it is."""
    places, bends = corners[:, :3], corners[:, 3].copy()
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    tangents = _tangents(places)
    for k, length in enumerate(lengths.tolist()):
        taken = float(bends[k] * tangents[k] + bends[k + 1] * tangents[k + 1])
        if length < taken <= (1 + share) * length:
            bends[k : k + 2] *= length / taken * (1 - 1e-12)
    return np.column_stack([places, bends])


def _tangents(places: np.ndarray) -> np.ndarray:
    """(K,) of half the angle by which a path turns at each corner (K, 3): what a bend of radius 1 takes of
    the legs beside it."""
    steps = np.diff(places, axis=0)
    ways = steps / np.maximum(np.linalg.norm(steps, axis=1), 1e-300)[:, None]
    sine = np.linalg.norm(np.cross(ways[:-1], ways[1:]), axis=1)
    turns = np.arctan2(sine, (ways[:-1] * ways[1:]).sum(axis=1))
    return np.concatenate([[0.0], np.tan(turns / 2), [0.0]])


def taken_of_legs(corners: np.ndarray) -> np.ndarray:
    """(K,) what the bend at each corner of a path (K, 4) takes of the legs beside it."""
    return np.asarray(_tangents(corners[:, :3]) * corners[:, 3])


def lacking(corners: np.ndarray) -> np.ndarray:
    """(K - 1,) by how much each leg of a path (K, 4) is too short for the bends at its ends."""
    taken = taken_of_legs(corners)
    lengths = np.linalg.norm(np.diff(corners[:, :3], axis=0), axis=1)
    return np.asarray(taken[:-1] + taken[1:] - lengths)


def like(points: Any, values: np.ndarray) -> Any:
    """Values as what points are: of their kind, precision and device."""
    return points.new_tensor(values) if is_tensor(points) else values
