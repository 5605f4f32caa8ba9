"""Quadrics as rows of ten numbers, many at once: values, gradients, first-order distances, makers.

A row (10,) holds the coefficients of x^2, y^2, z^2, x, y, z, 1 (CAPRI-Net, eq. 1), then xy, yz, zx; f <= 0
is inside. Rows made here have |grad f| = 1 on the surface (on a cone: where it was fitted), so values near it
are distances in the unit frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright.rows import lengths

Row = NDArray[np.float64]
Points = NDArray[np.floating]

# Columns of a row.
SQUARES, LINEAR, CONSTANT, CROSS = slice(0, 3), slice(3, 6), 6, slice(7, 10)

_MIN_GRADIENT = 1e-9


def monomials(points: Points) -> NDArray[np.float64]:
    """(N, 10) of points (N, 3): Q of section 3.1, with the three cross terms."""
    x, y, z = np.asarray(points, dtype=np.float64).T
    return np.stack([x * x, y * y, z * z, x, y, z, np.ones_like(x), x * y, y * z, z * x], axis=1)


def values(rows: NDArray[np.float64], points: Points) -> NDArray[np.float64]:
    """f (N, M) of M rows at points (N, 3): D = Q P (section 3.1)."""
    return np.asarray(monomials(points) @ np.atleast_2d(rows).T)


def gradients(row: Row, points: Points) -> NDArray[np.float64]:
    """grad f (N, 3) of one row at points (N, 3)."""
    form, slope, _ = split(row)
    return np.asarray(2 * np.asarray(points, dtype=np.float64) @ form + slope)


def distances(row: Row, points: Points) -> NDArray[np.float64]:
    """First-order distance f / |grad f| (N,) of one row at points (N, 3)."""
    slope = lengths(gradients(row, points))
    return np.asarray(values(row, points)[:, 0] / np.maximum(slope, _MIN_GRADIENT))


def split(row: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Symmetric form A (3, 3), slope b (3,) and constant c of f = p^T A p + b p + c."""
    a, b, c, d, e, f, g, h, i, j = np.asarray(row, dtype=np.float64)
    return np.array([[a, h / 2, j / 2], [h / 2, b, i / 2], [j / 2, i / 2, c]]), np.array([d, e, f]), float(g)


def joined(form: NDArray[np.float64], slope: ArrayLike, constant: float) -> Row:
    """The inverse of `split`."""
    m = form
    d, e, f = np.asarray(slope, dtype=np.float64)
    cross = (2 * m[0, 1], 2 * m[1, 2], 2 * m[2, 0])
    return np.array([m[0, 0], m[1, 1], m[2, 2], d, e, f, constant, *cross])


def plane(normal: ArrayLike, offset: float) -> Row:
    """Half-space n p <= offset; n is a unit vector and points out of it."""
    return joined(np.zeros((3, 3)), normal, -offset)


def sphere(centre: ArrayLike, radius: float) -> Row:
    return _about(np.eye(3), centre, radius)


def cylinder(point: ArrayLike, axis: ArrayLike, radius: float) -> Row:
    """Round cylinder around the line through `point` along the unit vector `axis`."""
    u = np.asarray(axis, dtype=np.float64)
    return _about(np.eye(3) - np.outer(u, u), point, radius)


def cone(apex: ArrayLike, axis: ArrayLike, angle: float, height: float) -> Row:
    """Double cone of half angle `angle` (radians); |grad f| is 1 at the distance `height` from the apex."""
    u, p = np.asarray(axis, dtype=np.float64), np.asarray(apex, dtype=np.float64)
    form = np.cos(angle) ** 2 * np.eye(3) - np.outer(u, u)
    form /= 2 * height * np.sin(angle) * np.cos(angle)
    return joined(form, -2 * form @ p, float(p @ form @ p))


def normalised(row: Row, points: Points) -> Row:
    """The row scaled so that |grad f| is 1 on average at points (N, 3) of its surface."""
    slope = float(np.mean(np.linalg.norm(gradients(row, points), axis=1)))
    return row / max(slope, _MIN_GRADIENT)


def fitted(points: Points, normals: Points, rounds: int = 8) -> Row | None:
    """The quadric with f = 0 and grad f along the normals at points (N, 3) in least squares.

    Values and slopes weigh alike at the scale of the patch; the slopes' lengths are those of the round
    before, on average 1. Curvatures against the dominant way are flattened out, so that f <= 0 or f >= 0 is
    convex (a, b, c >= 0 in section 3.1, for any axes). None for a flat patch.
    """
    centre = points.mean(axis=0)
    local = points - centre
    size = float(np.sqrt((local**2).sum(axis=1).mean()))
    if size < 1e-9:
        return None
    local = local / size
    x, y, z = local.T
    none, one = np.zeros_like(x), np.ones_like(x)
    slopes = np.concatenate(
        [
            np.stack([2 * x, none, none, one, none, none, none, y, none, z], axis=1),
            np.stack([none, 2 * y, none, none, one, none, none, x, z, none], axis=1),
            np.stack([none, none, 2 * z, none, none, one, none, none, y, x], axis=1),
        ]
    )
    system = np.concatenate([monomials(local), slopes])
    square = system.T @ system + 1e-9 * len(points) * np.eye(10)
    length = one
    for _ in range(rounds):
        target = np.concatenate([none, (length[:, None] * normals).T.ravel()])
        found = np.linalg.solve(square, system.T @ target)
        length = np.maximum((gradients(found, local) * normals).sum(axis=1), 0.1)
        length /= length.mean()
    form, slope, constant = split(found)
    bent, axes = np.linalg.eigh(form)
    bent = np.maximum(bent, 0.0) if bent.sum() > 0 else np.minimum(bent, 0.0)
    if np.abs(bent).max() < 1e-3:
        return None
    sign = 1.0 if bent.sum() > 0 else -1.0
    form = axes @ np.diag(bent) @ axes.T
    constant -= float(values(joined(form, slope, constant), local).mean())
    form /= size
    moved = float(centre @ form @ centre - slope @ centre) + constant * size
    return sign * joined(form, slope - 2 * form @ centre, moved)


def is_plane(rows: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(M,) whether rows (M, 10) have no quadratic term."""
    rows = np.atleast_2d(rows)
    quadratic = np.concatenate([rows[:, SQUARES], rows[:, CROSS]], axis=1)
    return np.asarray(np.abs(quadratic).max(axis=1) == 0)


def expressible(rows: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(M,) whether the paper's eq. 1 can hold rows (M, 10): no cross terms, a, b, c >= 0."""
    rows = np.atleast_2d(rows)
    plain = np.abs(rows[:, CROSS]).max(axis=1) < 1e-6
    return np.asarray(plain & (rows[:, SQUARES] >= -1e-9).all(axis=1))


def _about(form: NDArray[np.float64], centre: ArrayLike, radius: float) -> Row:
    p = np.asarray(centre, dtype=np.float64)
    form = form / (2 * radius)
    return joined(form, -2 * form @ p, float(p @ form @ p) - radius / 2)
