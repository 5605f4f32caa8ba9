"""The kinds of quadric that are looked for: hypotheses from a few oriented points, and fits to many."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from partwright.capri import quadric_rows as rows
from partwright.capri.quadric_rows import Row
from partwright.rows import crosses, dots, lengths

_MAX_RADIUS = 4.0  # radius, unit frame
_MIN_CURVATURE_RATIO = 0.02  # smaller curvatures, as a share of the largest, are none
_MAX_SLAB_SLOPE = 0.1  # slope along a slab that still is one; a quadric's own is 1
_GEOMETRIC_FIT_POINTS = 300  # points that a geometric fit looks at


@dataclass(frozen=True)
class MinimalSets:
    """Oriented points (N, 3), (N, 3), and for each of M hypotheses the indices of a seed (M,), of two mates
    near it (2, M), and of the patch around it (M, K)."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    seeds: NDArray[np.int64]
    mates: NDArray[np.int64]
    patches: NDArray[np.int64]

    def of(self, which: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return self.points[which], self.normals[which]


def _planes(draw: MinimalSets) -> list[Row]:
    return [rows.plane(n, float(n @ p)) for p, n in zip(*draw.of(draw.seeds), strict=True)]


def _spheres(draw: MinimalSets) -> list[Row]:
    """The centre is where the lines along the two normals pass closest."""
    p, n = draw.of(draw.seeds)
    q, m = draw.of(draw.mates[0])
    s, t, ok = _closest_approach(p, n, q, m)
    centre = (p + s[:, None] * n + q + t[:, None] * m) / 2
    radius = (np.abs(s) + np.abs(t)) / 2
    ok &= (radius < _MAX_RADIUS) & (radius > 1e-3) & (s * t > 0)
    return [rows.sphere(centre[i], float(radius[i])) for i in np.flatnonzero(ok)]


def _cylinders(draw: MinimalSets) -> list[Row]:
    """The axis is across both normals."""
    p, n = draw.of(draw.seeds)
    q, m = draw.of(draw.mates[0])
    axis = np.cross(n, m)
    length = np.linalg.norm(axis, axis=1)
    ok = length > 0.05
    axis /= np.maximum(length, 1e-9)[:, None]
    across = (q - p) - ((q - p) * axis).sum(axis=1, keepdims=True) * axis
    s, t, crossing = _closest_approach(p, n, p + across, m)
    centre = (p + s[:, None] * n + p + across + t[:, None] * m) / 2
    radius = (np.abs(s) + np.abs(t)) / 2
    ok &= crossing & (radius < _MAX_RADIUS) & (radius > 1e-3) & (s * t > 0)
    return [rows.cylinder(centre[i], axis[i], float(radius[i])) for i in np.flatnonzero(ok)]


def _cones(draw: MinimalSets) -> list[Row]:
    """The apex is where the three tangent planes meet; the axis has the same angle to the three normals."""
    p, n = draw.of(np.stack([draw.seeds, *draw.mates], axis=1))
    made = []
    for at, planes in zip(p, n, strict=True):
        if abs(np.linalg.det(planes)) < 1e-3:
            continue
        apex = np.linalg.solve(planes, (at * planes).sum(axis=1))
        axis = np.linalg.solve(planes, np.ones(3))
        row = _cone_row(apex, axis / np.linalg.norm(axis), at)
        if row is not None:
            made.append(row)
    return made


def _cone_row(
    apex: NDArray[np.float64], axis: NDArray[np.float64], points: NDArray[np.float64]
) -> Row | None:
    """A cone with this apex and axis through points; None where it is nearly a plane, line or cylinder."""
    rays = points - apex
    reach = np.linalg.norm(rays, axis=1)
    if reach.min() < 1e-6 or reach.max() > _MAX_RADIUS:
        return None
    along = rays @ axis
    if not (np.all(along > 0) or np.all(along < 0)):
        return None
    angle = float(np.arctan2(np.linalg.norm(np.cross(rays, axis), axis=1).sum(), np.abs(along).sum()))
    if not 0.05 < angle < 1.5:
        return None
    return rows.cone(apex, axis, angle, float(np.abs(along).mean() / np.cos(angle)))


def _quadrics(draw: MinimalSets) -> list[Row]:
    """Fitted to whole patches, half as many as seeds."""
    patches = draw.patches[::2]
    at, n = draw.points[patches], draw.normals[patches]
    fits = [rows.fitted(p, m, 2) for p, m in zip(at, n, strict=True)]
    return [row for row in fits if row is not None and not _slab(row)]


def _fit_quadric(row: Row, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Row | None:
    found = rows.fitted(points, normals)
    return None if found is None or _slab(found) else found


def _slab(row: Row) -> bool:
    """Whether a quadric is two parallel planes, or nearly: each of them is found by itself."""
    form, slope, _ = rows.split(row)
    bent, axes = np.linalg.eigh(form)
    order = np.argsort(np.abs(bent))
    flat = np.abs(bent[order[1]]) < _MIN_CURVATURE_RATIO * np.abs(bent[order[2]])
    return bool(flat and np.abs(slope @ axes[:, order[:2]]).max() < _MAX_SLAB_SLOPE)


def _closest_approach(
    p: NDArray[np.float64], n: NDArray[np.float64], q: NDArray[np.float64], m: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """s, t (N,) that bring p + s n and q + t m closest, and whether the lines are not parallel."""
    w, b = p - q, dots(n, m)
    d, e = dots(n, w), dots(m, w)
    bottom = 1 - b * b
    ok = bottom > 2e-3
    bottom = np.where(ok, bottom, 1.0)
    return (b * e - d) / bottom, (e - b * d) / bottom, ok


def _fit_plane(row: Row, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Row | None:
    centre = points.mean(axis=0)
    normal = np.linalg.eigh(np.cov(points.T))[1][:, 0]
    normal = normal if normal @ row[rows.LINEAR] > 0 else -normal
    return rows.plane(normal, float(normal @ centre))


def _fit_sphere(row: Row, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Row | None:
    """Least squares of |p|^2 = 2 c p + r^2 - |c|^2."""
    solved = np.linalg.lstsq(np.c_[2 * points, np.ones(len(points))], (points**2).sum(axis=1))[0]
    square = float(solved[3] + solved[:3] @ solved[:3])
    return rows.sphere(solved[:3], np.sqrt(square)) if 0 < square < _MAX_RADIUS**2 else None


def _fit_cylinder(row: Row, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Row | None:
    """The axis is where the normals are not; around it a circle; then all of it geometrically."""
    values, vectors = np.linalg.eigh(normals.T @ normals)
    axis = vectors[:, 0]
    if values[1] < 1e-3 * values[2]:
        return None
    flat = points @ vectors[:, 1:]
    solved = np.linalg.lstsq(np.c_[2 * flat, np.ones(len(flat))], (flat**2).sum(axis=1))[0]
    square = float(solved[2] + solved[:2] @ solved[:2])
    if not 0 < square < _MAX_RADIUS**2:
        return None
    start = np.r_[vectors[:, 1:] @ solved[:2], axis, np.sqrt(square)]
    centre, axis, radius = _geometric_fit(start, _cylinder_residuals, points)
    return rows.cylinder(centre, axis, radius) if 1e-3 < radius < _MAX_RADIUS else None


def _cylinder_residuals(x: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    axis = x[3:6] / np.linalg.norm(x[3:6])
    return lengths(crosses(points - x[:3], axis)) - x[6]


def _cone_residuals(x: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    axis, rays = x[3:6] / np.linalg.norm(x[3:6]), points - x[:3]
    across = lengths(crosses(rays, axis))
    return np.asarray(across * np.cos(x[6]) - np.abs(rays @ axis) * np.sin(x[6]))


def _geometric_fit(
    start: NDArray[np.float64],
    off: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
    points: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Place (3,), axis (3,) and radius or angle that bring points (N, 3) closest to the surface."""
    few = points[:: max(1, len(points) // _GEOMETRIC_FIT_POINTS)]
    x = least_squares(off, start, args=(few,), method="lm", max_nfev=80).x
    return x[:3], x[3:6] / np.linalg.norm(x[3:6]), float(x[6])


def _fit_cone(row: Row, points: NDArray[np.float64], normals: NDArray[np.float64]) -> Row | None:
    """The apex is the least-squares meeting point of all tangent planes; then all of it geometrically."""
    apex = np.linalg.lstsq(normals, (points * normals).sum(axis=1))[0]
    centred = normals - normals.mean(axis=0)
    axis = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    rays = points - apex
    angle = np.arctan2(np.linalg.norm(np.cross(rays, axis), axis=1).mean(), np.abs(rays @ axis).mean())
    apex, axis, _ = _geometric_fit(np.r_[apex, axis, angle], _cone_residuals, points)
    return _cone_row(apex, axis, points)


# kind: hypotheses from seeds and mates, and the fit to all points that agree. The simplest kind comes first.
HYPOTHESES = {
    "plane": _planes,
    "cylinder": _cylinders,
    "sphere": _spheres,
    "cone": _cones,
    "quadric": _quadrics,
}
LEAST_SQUARES_FITS = {
    "plane": _fit_plane,
    "cylinder": _fit_cylinder,
    "sphere": _fit_sphere,
    "cone": _fit_cone,
    "quadric": _fit_quadric,
}
KINDS = tuple(HYPOTHESES)
