"""Closed meshes of what is turned about an axis, and of what lies below a graph."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from manifold3d import Manifold

from partwright.meshing.manifolds import closed

_FEWEST, _MOST = 12, 720  # corners of a full circle
_ROUNDS = 12  # halvings of a curve's pieces


def corners_of_circle(radius: float, tolerance: float) -> int:
    """How many corners, a multiple of 4, keep a circle's chords within the tolerance."""
    turn = math.acos(max(-1.0, 1 - tolerance / radius)) if radius > tolerance else math.pi / 2
    return 4 * math.ceil(min(max(math.pi / turn, _FEWEST), _MOST) / 4)


def revolve(profile: np.ndarray, corners: int, stretch: tuple[float, float] = (1.0, 1.0)) -> Manifold:
    """The profile (K, 2) of radii and heights turned about z; an end on the axis is a pole.

    The profile runs from bottom to top, from axis to axis; one that never meets the axis is a closed loop,
    counter-clockwise with the radius to the right. stretch: of x and y.
    """
    radius, height = profile[:, 0], profile[:, 1]
    angle = np.arange(corners) * (2 * np.pi / corners)
    circle = np.stack([np.cos(angle) * stretch[0], np.sin(angle) * stretch[1]], axis=1)
    loop = radius.min() > 0
    ring = slice(None) if loop else slice(1, -1)
    rings = np.concatenate(
        [
            radius[ring, None, None] * circle,
            np.broadcast_to(height[ring, None, None], (len(radius[ring]), corners, 1)),
        ],
        axis=2,
    )
    count = len(rings)
    index = np.arange(count * corners).reshape(count, corners)
    low, high = (index, np.roll(index, -1, axis=0)) if loop else (index[:-1], index[1:])
    faces = quads(low, np.roll(low, -1, axis=1), np.roll(high, -1, axis=1), high)
    vertices = rings.reshape(-1, 3)
    if not loop:
        bottom, top = len(vertices), len(vertices) + 1
        vertices = np.concatenate([vertices, [[0, 0, height[0]], [0, 0, height[-1]]]])
        faces = np.concatenate([faces, _fan(index[0][::-1], bottom), _fan(index[-1], top)])
    return closed(vertices, faces)


def under_graph(across: np.ndarray, along: np.ndarray, top: np.ndarray, bottom: float) -> Manifold:
    """Between the plane z = bottom and the heights top (U, V) over the grid across (U,) x along (V,)."""
    u, v = top.shape
    flat = np.stack(np.meshgrid(across, along, indexing="ij"), axis=-1).reshape(-1, 2)
    upper = np.column_stack([flat, top.ravel()])
    lower = np.column_stack([flat, np.full(len(flat), bottom)])
    index = np.arange(u * v).reshape(u, v)
    lid = quads(index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    rim = np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])
    after = np.roll(rim, -1)
    wall = quads(rim + u * v, after + u * v, after, rim)
    return closed(np.concatenate([upper, lower]), np.concatenate([lid, lid[:, ::-1] + u * v, wall]))


def subdivided(curve: Callable[[np.ndarray], np.ndarray], start: np.ndarray, tolerance: float) -> np.ndarray:
    """Points (K, D) of a curve of one parameter, so close that its chords are within the tolerance."""
    parameter = start
    points = curve(parameter)
    for _ in range(_ROUNDS):
        middle = (parameter[1:] + parameter[:-1]) / 2
        between = curve(middle)
        chord = points[1:] - points[:-1]
        length = np.maximum((chord**2).sum(axis=1), 1e-300)
        share = np.clip(((between - points[:-1]) * chord).sum(axis=1) / length, 0, 1)
        error = np.linalg.norm(between - points[:-1] - share[:, None] * chord, axis=1)
        coarse = np.flatnonzero(error > tolerance)
        if not len(coarse):
            break
        parameter = np.insert(parameter, coarse + 1, middle[coarse])
        points = np.insert(points, coarse + 1, between[coarse], axis=0)
    return points


def quads(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Two triangles (F, 3) for each of the corners a, b, c, d, counter-clockwise seen from outside."""
    a, b, c, d = (corner.ravel() for corner in (a, b, c, d))
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _fan(ring: np.ndarray, pole: int) -> np.ndarray:
    return np.stack([ring, np.roll(ring, -1), np.full(len(ring), pole)], axis=1)
