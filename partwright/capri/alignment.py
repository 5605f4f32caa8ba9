"""Directions made exact: planes and cylinders that are nearly parallel to a larger plane become parallel.

A cylinder's axis is fitted from the points of its wall; a short hole leaves it a tenth of a degree of play.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from partwright.capri import quadric_rows as rows
from partwright.capri.detection import DetectedQuadric, support
from partwright.capri.oriented_points import OrientedPoints
from partwright.capri.quadric_rows import Row

_MAX_ANGLE_SINE = np.sin(np.radians(1.0))
_MIN_SUPPORT_SHARE = 0.98  # share of the support that must be left

Array = NDArray[np.float64]


def aligned(found: list[DetectedQuadric], surface: OrientedPoints) -> list[DetectedQuadric]:
    """The finds in their order; a direction within a degree of a coordinate axis, or else of a larger plane's
    normal, is that direction where the points still bear it out."""
    directions = list(np.eye(3))
    by_size = sorted(range(len(found)), key=lambda i: (found[i].kind != "plane", -len(found[i].inliers)))
    result = list(found)
    for i in by_size:
        one = found[i]
        if one.kind not in _REFITS:
            continue
        points, normals = surface.points[one.inliers], surface.normals[one.inliers]
        own = _direction(one)
        to = _nearest(own, directions)
        if to is not None:
            row = _REFITS[one.kind](to, points)
            reached = support(row, points, normals)
            if reached >= _MIN_SUPPORT_SHARE * one.support:
                result[i] = replace(one, row=row, support=reached)
        elif one.kind == "plane":
            directions.append(own)
    return result


def _direction(one: DetectedQuadric) -> Array:
    """A plane's normal; a cylinder's axis."""
    form, slope, _ = rows.split(one.row)
    return slope if one.kind == "plane" else np.asarray(np.linalg.eigh(form)[1][:, 0])


def _nearest(own: Array, directions: list[Array]) -> Array | None:
    """The first direction that is nearly parallel, on the side of `own`."""
    for to in directions:
        if np.linalg.norm(np.cross(own, to)) < _MAX_ANGLE_SINE:
            return to if own @ to > 0 else -to
    return None


def _plane(normal: Array, points: Array) -> Row:
    return rows.plane(normal, float((points @ normal).mean()))


def _cylinder(axis: Array, points: Array) -> Row:
    """By the circle that fits the points best across the axis, |p|^2 = 2 c p + r^2 - |c|^2."""
    across = np.linalg.svd(axis[None])[2][1:].T
    flat = points @ across
    solved = np.linalg.lstsq(np.c_[2 * flat, np.ones(len(flat))], (flat**2).sum(axis=1))[0]
    radius = np.sqrt(max(float(solved[2] + solved[:2] @ solved[:2]), 1e-12))
    return rows.cylinder(across @ solved[:2], axis, float(radius))


_REFITS = {"plane": _plane, "cylinder": _cylinder}
