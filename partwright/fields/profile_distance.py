"""The signed distance in the plane to a profile: the compiled kernel's, and the same in readable form.

`reference` is what tests compare the kernel with, and what torch tensors are answered by: it is
differentiable by the points and, where they are a tensor, by the corners.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from partwright import _kernel
from partwright.fields.operations import is_tensor, library
from partwright.fields.profile import STRAIGHT, Profile, Side, arc_pieces

_TINY = 1e-30  # keeps roots away from 0, where they have no slope


def profile_distance(profile: Profile, points: Any, counts: np.ndarray | None = None) -> Any:
    """Signed distance (N,) at points (N, 2), negative inside; float64, or the tensor's own kind.

    counts: (V,) which sides bound anything; all of them by default.
    """
    counts = _all(profile) if counts is None else counts
    if is_tensor(points):
        return reference(points.new_tensor(profile.corners), profile.starts, points, counts)
    flat = np.ascontiguousarray(points, dtype=np.float64)
    return _kernel.profile_distances(profile.corners, profile.starts, counts.astype(np.uint8), flat, 0)


def profile_gradients(
    profile: Profile, points: np.ndarray, upstream: np.ndarray, counts: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives (V, 3) of sum(upstream * distance) by x, y and bulge of the corners, and (N, 2) of each
    distance by its point, by the kernel."""
    counts = _all(profile) if counts is None else counts
    flat = np.ascontiguousarray(points, dtype=np.float64)
    weights = np.ascontiguousarray(upstream, dtype=np.float64)
    starts = profile.starts
    return _kernel.profile_gradients(profile.corners, starts, counts.astype(np.uint8), flat, weights, 0)


def _all(profile: Profile) -> np.ndarray:
    return np.ones(len(profile.corners), dtype=bool)


def reference(corners: Any, starts: np.ndarray, points: Any, counts: np.ndarray) -> Any:
    """As `profile_distance`, of corners (V, 3), an array or a tensor.

    The nearest point of a side is its foot, or one of its ends; inside is where a ray towards +x meets the
    sides an odd number of times. Arcs are cut at their highest and lowest points for that.
    """
    xp = library(points)
    nearest: Any = None
    inside = points[:, 0] != points[:, 0]
    for first, last in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        for i in range(first, last):
            a, b = corners[i], corners[i + 1 if i + 1 < last else first]
            if abs(_plain(a[2])) <= STRAIGHT:
                square, crossed = _line(a[:2], b[:2], points)
            else:
                square, crossed = _arc(a, b[:2], points)
            inside = inside ^ crossed
            if counts[i]:
                nearest = square if nearest is None else xp.minimum(nearest, square)
    distance = xp.sqrt(nearest + _TINY)
    return xp.where(inside, -distance, distance)


def _line(a: Any, b: Any, points: Any) -> tuple[Any, Any]:
    """Squared distance, and whether the ray meets it."""
    xp, way, off = library(points), b - a, points - a
    share = xp.clip((off @ way) / (way @ way), 0.0, 1.0)
    square = ((off - share[:, None] * way) ** 2).sum(-1)
    x, y = points[:, 0], points[:, 1]
    meets = (a[1] <= y) != (b[1] <= y)
    rise = way[1] if _plain(way[1]) != 0.0 else 1.0
    return square, meets & (x < a[0] + (y - a[1]) / rise * way[0])


def _arc(a: Any, b: Any, points: Any) -> tuple[Any, Any]:
    xp, start, bulge = library(points), a[:2], a[2]
    half, k = (b - start) / 2, (1 - bulge * bulge) / (2 * bulge)
    normal = xp.stack([-half[1], half[0]])
    centre = (start + b) / 2 + k * normal
    chord = xp.sqrt((half * half).sum())
    radius = chord * (1 + bulge * bulge) / (2 * abs(bulge))
    off = points - centre
    reach = xp.sqrt((off * off).sum(-1) + _TINY)
    side = 1.0 if _plain(bulge) > 0 else -1.0
    middle = -side * normal / chord
    cosine = float(np.cos(2 * np.arctan(abs(_plain(bulge)))))
    within = off @ middle >= reach * cosine
    ends = xp.minimum(((points - start) ** 2).sum(-1), ((points - b) ** 2).sum(-1))
    return xp.where(within, (reach - radius) ** 2, ends), _arc_crossed(a, b, centre, radius, points)


def _arc_crossed(a: Any, b: Any, centre: Any, radius: Any, points: Any) -> Any:
    ax, ay, bulge, bx, by, cx, cy, r = (_plain(v) for v in (*a, *b, *centre, radius))
    side = Side((ax, ay), (bx, by), bulge, (cx, cy), r, 4 * math.atan(bulge))
    x, y = points[:, 0], points[:, 1]
    crossed, beyond = x != x, (x - cx) ** 2 + (y - cy) ** 2
    for low, high, right in arc_pieces(side):
        hit = ((x < cx) | (beyond < r * r)) if right else ((x < cx) & (beyond > r * r))
        crossed = crossed ^ ((low <= y) & (y < high) & hit)
    return crossed


def _plain(value: Any) -> float:
    """As a number that no derivative is asked of."""
    return float(value.detach() if is_tensor(value) else value)
