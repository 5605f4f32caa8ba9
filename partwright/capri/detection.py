"""Surfaces of a shape as quadrics: efficient RANSAC (Schnabel, Wahl & Klein 2007) on oriented points.

Planes come from one point and its normal, spheres and cylinders from two, cones from three close points. The
hypothesis that most points bear out, by distance and by normal, is refitted to them, by every kind in turn,
and the best is taken out; again and again, until what is left bears out nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from partwright.capri import quadric_rows as rows
from partwright.capri.oriented_points import OrientedPoints
from partwright.capri.quadric_kinds import HYPOTHESES, LEAST_SQUARES_FITS, MinimalSets
from partwright.capri.quadric_rows import Row
from partwright.rows import dots, lengths

_HYPOTHESES_PER_KIND = 48  # hypotheses of each kind in one draw
_PROBE_POINTS = 1500  # points that sift hypotheses
_MAX_REFITTED = 6
INLIER_DISTANCE = 0.006  # unit frame: how far from its quadric a point may lie
_CLOSE_INLIER_SHARE = 0.125  # share of the tolerance at which the kinds are told apart
_MIN_NORMAL_COSINE = np.cos(np.radians(18.0))  # and by how much its normal may differ
_NEAR_NEIGHBOURS, _ALL_NEIGHBOURS = 6, 60  # neighbours among which partners are drawn
_SIMPLICITY_PRIOR = {
    "plane": 1.0,
    "cylinder": 0.95,
    "sphere": 0.92,
    "cone": 0.9,
    "quadric": 0.75,
}  # rather the simpler
_PATCH_POINTS = 40  # points of a patch that a general quadric is fitted to
_MAX_REFITS = 3
_MAX_FRUITLESS_DRAWS = 6  # draws without a find that end the search
_MAX_QUADRICS = 250
_MIN_INLIERS = 8  # points of a fit


@dataclass(frozen=True)
class DetectedQuadric:
    """A quadric found on a surface: its row (10,), kind, and the points (K,) (indices) that bear it out.

    outward: whether the points' normals point out of f <= 0, as on a boss; on a hole's wall they do not.
    support: how well they bear it out, at the tolerance and more closely: a narrow chamfer is within the
    tolerance of a sphere, but closer to its cone.
    """

    row: Row
    kind: str
    inliers: NDArray[np.int64]
    outward: bool
    support: float


def detect(
    surface: OrientedPoints, kinds: tuple[str, ...], least: int, seed: int, tolerance: float = INLIER_DISTANCE
) -> list[DetectedQuadric]:
    """Quadrics of these kinds (of `KINDS`) that `least` points bear out."""
    rng = np.random.default_rng(seed)
    points, normals = surface.points, surface.normals
    neighbours = cKDTree(points).query(points, min(_ALL_NEIGHBOURS + 1, len(points)))[1][:, 1:]
    left = np.ones(len(points), dtype=bool)
    found: list[DetectedQuadric] = []
    stale = 0
    while stale < _MAX_FRUITLESS_DRAWS and left.sum() >= least and len(found) < _MAX_QUADRICS:
        best = _best_of_draw(points, normals, neighbours, left, kinds, rng, tolerance)
        if best is None or len(best.inliers) < least:
            stale += 1
            continue
        stale = 0
        left[best.inliers] = False
        found.append(best)
    return found


def _best_of_draw(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    left: NDArray[np.bool_],
    kinds: tuple[str, ...],
    rng: np.random.Generator,
    tolerance: float,
) -> DetectedQuadric | None:
    """The best of one draw of hypotheses, refitted."""
    free = np.flatnonzero(left)
    seeds = rng.choice(free, _HYPOTHESES_PER_KIND)
    mates = np.stack([_partners(seeds, neighbours, left, rng) for _ in range(2)])
    draw = MinimalSets(points, normals, seeds, mates, neighbours[seeds, :_PATCH_POINTS])
    probe = rng.choice(free, min(_PROBE_POINTS, len(free)), replace=False)
    scored: list[tuple[float, Row, str]] = []
    for kind in kinds:
        made = HYPOTHESES[kind](draw)
        if len(made) == 0:
            continue
        support = _SIMPLICITY_PRIOR[kind] * _support(made, points[probe], normals[probe], tolerance).sum(
            axis=1
        )
        scored += [(float(score), row, kind) for score, row in zip(support, made, strict=True)]
    scored.sort(key=lambda entry: -entry[0])
    best = _best([(row, kind) for _, row, kind in scored[:_MAX_REFITTED]], points, normals, free, tolerance)
    if best is None or len(best.inliers) < _MIN_INLIERS:  # of a plane, those that face its way may be few
        return best
    at, across = points[best.inliers], normals[best.inliers]
    others = [(kind, LEAST_SQUARES_FITS[kind](best.row, at, across)) for kind in kinds if kind != best.kind]
    other = _best([(r, k) for k, r in others if r is not None], points, normals, free, tolerance)
    return other if other is not None and _score(other) > _score(best) else best


def _best(
    given: list[tuple[Row, str]],
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    free: NDArray[np.int64],
    tolerance: float,
) -> DetectedQuadric | None:
    """The best of rows of these kinds after they are refitted."""
    fits = [_refitted(row, kind, points, normals, free, tolerance) for row, kind in given]
    return max((one for one in fits if one is not None), key=_score, default=None)


def _score(one: DetectedQuadric) -> float:
    return one.support * _SIMPLICITY_PRIOR[one.kind]


def _partners(
    seeds: NDArray[np.int64],
    neighbours: NDArray[np.int64],
    left: NDArray[np.bool_],
    rng: np.random.Generator,
) -> NDArray[np.int64]:
    """A partner for each seed among its neighbours, which is free itself where one of four tries is."""
    width = neighbours.shape[1]
    tries = rng.integers(
        0, np.where(rng.random(len(seeds)) < 0.4, min(_NEAR_NEIGHBOURS, width), width), (4, len(seeds))
    )
    chosen = neighbours[seeds[None], tries]
    first = np.argmax(left[chosen], axis=0)
    return np.asarray(chosen[first, np.arange(len(seeds))])


def _support(
    made: list[Row], points: NDArray[np.float64], normals: NDArray[np.float64], tolerance: float
) -> NDArray[np.float64]:
    """(M, N) how well points bear out the quadrics: 1 on them, falling with the square of the distance to 0
    at the tolerance (Torr & Zisserman 2000), and 0 where the normals do not agree up to sign."""
    value = rows.values(np.stack(made), points).T
    slope = np.stack([rows.gradients(row, points) for row in made])
    length = np.maximum(lengths(slope), 1e-9)
    along = np.abs(dots(slope, normals))
    near = 1 - (value / (tolerance * length)) ** 2
    return np.where(along > _MIN_NORMAL_COSINE * length, np.maximum(near, 0.0), 0.0)


def _refitted(
    row: Row,
    kind: str,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    free: NDArray[np.int64],
    tolerance: float,
) -> DetectedQuadric | None:
    """The row fitted to the free points that agree with it, and those again."""
    found = _support([row], points[free], normals[free], tolerance)[0]
    for _ in range(_MAX_REFITS):
        inliers = free[found > 0]
        if len(inliers) < _MIN_INLIERS:
            return None
        better = LEAST_SQUARES_FITS[kind](row, points[inliers], normals[inliers])
        if better is None:
            break
        again = _support([better], points[free], normals[free], tolerance)[0]
        if again.sum() < found.sum():
            break
        row, found = better, again
    inliers = free[found > 0]
    signs = (rows.gradients(row, points[inliers]) * normals[inliers]).sum(axis=1)
    outward = bool(np.sum(np.sign(signs)) >= 0)
    same = inliers[(signs > 0) == outward] if kind == "plane" else inliers
    return DetectedQuadric(
        row, kind, same, outward, support(row, points[inliers], normals[inliers], tolerance)
    )


def support(
    row: Row, points: NDArray[np.float64], normals: NDArray[np.float64], tolerance: float = INLIER_DISTANCE
) -> float:
    """How well oriented points (N, 3), (N, 3) bear out a quadric, at the tolerance and more closely."""
    return float(
        sum(_support([row], points, normals, t).sum() for t in (tolerance, _CLOSE_INLIER_SHARE * tolerance))
    )
