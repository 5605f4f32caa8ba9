"""Balls that contain triangles exactly, and what these go around, with little beside it.

Balls that fill the solid, what they lack counting more than what they add, share out its points: each goes
to the ball that has least to grow for it, and the ball becomes the smallest around its own. A point then goes
to the ball that it is deepest in, so that balls only become smaller. Last, triangles that run out of one ball
into another are cut until each piece lies in one of them, or is small; such a piece enlarges the ball that
has least to grow for it. Balls are convex: where the corners of a piece are, the piece is.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.ball_filling import Balls, Place, filling_balls
from partwright.approximation.smallest_ball import smallest_ball
from partwright.robots.enclosing import halves

if TYPE_CHECKING:
    from manifold3d import Manifold

_Measure = Callable[[np.ndarray, float], np.ndarray]  # distances to a centre, and the radius
_SEGMENTS = 48  # of a sphere, where volumes are measured

# where balls begin, and what they lack over what they add: the cover of least volume is taken
_BEGINNINGS: tuple[tuple[Place, float], ...] = (
    ("in", 1.0),
    ("anywhere", 3.0),
    ("anywhere", 10.0),
    ("anywhere", 30.0),
)
_SHRUNK = 40  # times that points are shared out by depth
_LEAST = 1e-3  # by less of all radii it is not worth to go on
_FINE = 4e-3  # of the size: edges of pieces that are cut no further
_MOST = 400_000  # pieces that are cut further
_ROUNDING = 1e-7  # of the size


def covering_balls(
    solid: Manifold, points: np.ndarray, triangles: np.ndarray, count: int, seed: int
) -> Balls:
    """(N, 4) centres and radii of at most `count` balls.

    They contain all triangles (T, 3, 3), and the points (N, 3) of the solid, of its surface and within.
    """
    size = float(np.ptp(points, axis=0).max())
    found = []
    for place, firmness in _BEGINNINGS:
        balls = _shrunk(points, filling_balls(solid, count, place, firmness, seed))
        balls = _grown(balls, triangles, _FINE * size)
        found.append(np.column_stack([balls[:, :3], balls[:, 3] + _ROUNDING * size]))
    return min(found, key=lambda balls: float(balls_solid(balls).volume()))


def balls_solid(balls: Balls) -> Manifold:
    """The balls as one solid, each of facets that have its volume; without those that have next to none."""
    from manifold3d import Manifold, OpType

    balls = balls[balls[:, 3] > _LEAST * balls[:, 3].max()]
    same = math.cbrt(4 / 3 * math.pi / Manifold.sphere(1.0, _SEGMENTS).volume())
    placed = [Manifold.sphere(same * r, _SEGMENTS).translate((x, y, z)) for x, y, z, r in balls.tolist()]
    return Manifold.batch_boolean(placed, OpType.Add)


def _shrunk(points: np.ndarray, balls: Balls) -> Balls:
    """Balls about as these that contain all points, none larger than its share of them asks for."""
    balls = _around(points, _owners(points, balls, _growth), balls)
    for _ in range(_SHRUNK):
        before = balls[:, 3].sum()
        balls = _around(points, _owners(points, balls, _power), balls)
        if balls[:, 3].sum() > (1 - _LEAST) * before:
            break
    return balls


def outside_of_balls(points: np.ndarray, balls: Balls) -> np.ndarray:
    """(N,) how far points are outside of all balls; negative inside."""
    return _lowest(balls, lambda centre, radius: np.linalg.norm(points - centre, axis=1) - radius)[0]


def _around(points: np.ndarray, owner: np.ndarray, balls: Balls) -> Balls:
    """The smallest ball around the points that each one owns; those without any are left out."""
    order = np.argsort(owner, kind="stable")
    owners, first = np.unique(owner[order], return_index=True)
    found = []
    for i, own in zip(owners, np.split(points[order], first[1:]), strict=True):
        centre, radius = smallest_ball(own)
        here = float(np.linalg.norm(own - balls[i, :3], axis=1).max())
        found.append([*centre, radius] if radius < here else [*balls[i, :3], here])
    return np.array(found)


def _growth(far: np.ndarray, radius: float) -> np.ndarray:
    return far - radius


def _power(far: np.ndarray, radius: float) -> np.ndarray:
    return far**2 - radius**2


def _owners(points: np.ndarray, balls: Balls, measure: _Measure) -> np.ndarray:
    """(N,) the ball by whose distance and radius the measure of a point is least."""
    return _lowest(balls, lambda centre, radius: measure(np.linalg.norm(points - centre, axis=1), radius))[1]


def _lowest(balls: Balls, value: Callable[[np.ndarray, float], np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The least value (N,) that any ball gives, by its centre and radius, and which ball (N,) does."""
    best, owner = np.full(1, np.inf), np.zeros(1, int)
    for i, (x, y, z, radius) in enumerate(balls.tolist()):
        found = value(np.array((x, y, z)), radius)
        best, owner = np.minimum(best, found), np.where(found < best, i, owner)
    return best, owner


def _sticking_out(triangles: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    return np.asarray(np.linalg.norm(triangles - centre, axis=2).max(axis=1) - radius)


def _grown(balls: Balls, triangles: np.ndarray, fine: float) -> Balls:
    """The balls, enlarged so that they contain all triangles."""
    balls = balls.copy()
    left = triangles
    while len(left):
        beyond, owner = _lowest(balls, partial(_sticking_out, left))
        left, owner, beyond = (each[beyond > 0] for each in (left, owner, beyond))
        edges = np.linalg.norm(left - np.roll(left, 1, axis=1), axis=2)
        joins = (edges.max(axis=1, initial=0.0) <= fine) | (len(left) > _MOST)
        np.maximum.at(balls[:, 3], owner[joins], balls[owner[joins], 3] + beyond[joins])
        left = halves(left[~joins], edges[~joins].argmax(axis=1))
    return balls
