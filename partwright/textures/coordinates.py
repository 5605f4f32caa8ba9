"""Where on its map a point of a part is, and back: the octahedral fold (Meyer et al. 2010)."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part
from partwright.fields import Field, SuperFrustum
from partwright.rows import crosses, dots, lengths, sums, units

Floats = NDArray[np.float64]

_LEAST = 1e-12
_STEP = 1e-5  # of the longest side, for derivatives


def directions(field: Field, points: NDArray[np.floating]) -> tuple[Floats, NDArray[np.bool_]]:
    """Directions (N, 3), of no certain length, and whether a hollow part's inner side is meant (N,).

    points (N, 3) are in the field's own frame. Of a SuperFrustum, and of all that is one, they are unbent and
    measured in shares of its half extents; of others in shares of their bounds.
    """
    places: Floats = np.asarray(points, dtype=np.float64)
    solid = field.superfrustum()
    if solid is None:
        low, high = field.bounds()
        half = np.where(np.isfinite(high - low), (high - low) / 2, 1.0)
        centre = np.where(np.isfinite(high + low), (high + low) / 2, 0.0)
        return (places - centre) / np.maximum(half, _LEAST), np.zeros(len(places), bool)
    unbent = places.copy()
    if solid.bulge > 0:
        unbent[:, 0], unbent[:, 2] = _unbent(solid, places[:, 0], places[:, 2])
    half = np.array(solid.size) / 2 + solid.dilation
    inner = _is_inner(solid, unbent) if solid.hollow else np.zeros(len(places), bool)
    return unbent / np.maximum(half, _LEAST), inner


def is_hollow(field: Field) -> bool:
    """Whether its map has an inner side."""
    solid = field.superfrustum()
    return solid is not None and solid.hollow


def folded(directions: Floats, sign: Floats | None = None) -> Floats:
    """Places (N, 2) in [0, 1]^2 of directions (N, 3): the middle is +z, the corners are -z.

    sign (N, 3): of the octants that are meant, for directions on the boundary of several.
    """
    sign = np.where(directions < 0, -1.0, 1.0) if sign is None else sign
    n = directions / np.maximum(sums(np.abs(directions))[:, None], _LEAST)
    flat = np.where(sign[:, 2:] < 0, (1 - np.abs(n[:, 1::-1])) * sign[:, :2], n[:, :2])
    return np.asarray(flat / 2 + 0.5)


def frames(
    field: Field, points: Floats, normals: Floats, sign: Floats | None = None
) -> tuple[Floats, Floats]:
    """Tangents (N, 3), of unit length along the map's rows, and whether up the map is normal x tangent (N,),
    1, or against it, -1, at points (N, 3) of the field's own frame with unit normals (N, 3).

    sign: as of `folded`.
    """
    towards, _ = directions(field, points)
    sign = np.where(towards < 0, -1.0, 1.0) if sign is None else sign
    low, high = field.bounds()
    step = _STEP * float(np.max(np.subtract(high, low)))
    start = folded(towards, sign)
    slope = np.stack(
        [(folded(directions(field, points + move)[0], sign) - start) / step for move in step * np.eye(3)],
        axis=2,
    )
    slope -= (slope @ normals[:, :, None]) * normals[:, None]
    across = crosses(slope[:, 1], normals)
    across *= np.where(dots(across, slope[:, 0]) < 0, -1.0, 1.0)[:, None]
    across = units(across)
    turned = dots(crosses(normals, across), slope[:, 1])
    return across, np.where(turned < 0, -1.0, 1.0)


def of_nearest_copy(part: Part, points: Floats, *vectors: Floats) -> list[Floats]:
    """Points (N, 3), and vectors (N, 3) there, in the frame of the part, or of its copy that is nearest."""
    poses = [copy.pose.inverse() for copy in part.copies]
    own = [pose(points) for pose in poses]
    nearest = np.zeros(len(points), np.int64)
    if len(own) > 1:
        off = [np.abs(part.field(np.ascontiguousarray(one, np.float32))) for one in own]
        nearest = np.argmin(off, axis=0)
    every, origin = np.arange(len(points)), np.zeros((1, 3))
    turned = [np.stack([pose(one) - pose(origin) for pose in poses])[nearest, every] for one in vectors]
    return [np.stack(own)[nearest, every], *turned]


def _unbent(solid: SuperFrustum, x: Floats, z: Floats) -> tuple[Floats, Floats]:
    """Across and along the axis (docs/superfrustum.md): the arc as if it were straight."""
    angle = solid.bulge * math.pi / 2
    s, k, h = math.sin(angle), math.cos(angle), solid.size[2] / 2 + _LEAST
    end = np.abs(z) - h
    over = x * s + end * k
    towards, up = k * h - x * s, np.abs(z) * s
    across = ((x * x + z * z - h * h) * s - 2 * x * k * h) / (np.hypot(towards, up) + h)
    along = h / angle * np.arctan2(up, np.maximum(towards, 0))
    across = np.where(over <= 0, across, end * s - x * k)
    along = np.where(over <= 0, along, h + over)
    return across, np.where(z < 0, -along, along)


def _is_inner(solid: SuperFrustum, unbent: Floats) -> NDArray[np.bool_]:
    """Whether points are nearer to the inner edge of the profile than to the outer one."""
    half_x, half_y, half_z = np.array(solid.size) / 2
    m = min(half_x, half_y)
    radius = solid.roundness * m
    off = np.abs(unbent[:, :2]) - (half_x, half_y) + radius
    q = lengths(np.maximum(off, 0)) + np.minimum(np.maximum(off[:, 0], off[:, 1]), 0) - radius
    t = np.clip((unbent[:, 2] / max(half_z, _LEAST) + 1) / 2, 0, 1)
    outer = m * (solid.taper - 1) * t
    bottom, top = m * (solid.onion - 1), m * (solid.taper * solid.onion - 1)
    return np.asarray(q < (outer + bottom + (top - bottom) * t) / 2)
