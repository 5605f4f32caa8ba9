"""Points on the surfaces of SuperFrusta, straight from their parameters (docs/superfrustum.md).

A thin tab lies between the points of any lattice; on the surface of its part it cannot hide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from partwright.fields.columns import ROTATION, TRANSLATION, Column
from partwright.fields.kernel import Rows

Floats = NDArray[np.float64]

_ALONG = np.linspace(0, 1, 13)  # of an edge of the profile
_ACROSS = np.array([0.0, 0.35, 0.7, 0.95])  # of a face at either end, from its rim to its middle
# A quarter of the section's outline: shares of the straight side, of the arc, and of the other side.
_SIDE, _ARC = np.array([0.2, 0.6, 1.0]), np.array([15.0, 30.0, 45.0, 60.0, 75.0])
_STRAIGHT = 1e-6  # bulges below are none
_LEAST = 1e-12


def surface_points(rows: Rows) -> Floats:
    """Points (M, K, 3) of each part's own surface, over a thousand each, of a solid part some on its axis."""
    params = rows.astype(np.float64)
    q, z = _profile(params)
    x, y = _outline(params, q)
    bent_x, bent_z = _bent(params, x, np.broadcast_to(z[:, :, None], x.shape))
    turn = Rotation.from_quat(params[:, ROTATION], scalar_first=True).as_matrix()[..., None, None]
    points = np.empty((*x.shape, 3))
    for i, offset in enumerate(params[:, TRANSLATION].T):  # by columns: rows of three are slow to loop over
        turned = turn[:, i, 0] * bent_x + turn[:, i, 1] * y + turn[:, i, 2] * bent_z
        points[..., i] = turned + offset[:, None, None]
    return points.reshape(len(rows), -1, 3)


def _profile(params: Floats) -> tuple[Floats, Floats]:
    """The profile's edges as offsets q (M, P) from the section's outline and heights z (M, P), dilated."""
    half = params[:, Column.SZ] / 2
    inner = np.minimum(params[:, Column.SX], params[:, Column.SY]) / 2
    taper, onion, dilation = (params[:, c] for c in (Column.TAPER, Column.ONION, Column.DILATION))
    # A hole that the dilation closes leaves its middle, the axis.
    hollow = np.maximum(1, taper) * inner * onion > dilation
    outer = np.stack([np.zeros_like(half), (taper - 1) * inner])
    hole = np.where(hollow, inner * np.stack([onion - 1, taper * onion - 1]), -inner)
    offsets, heights = [], []
    for edge, side in ((outer, 1.0), (hole, -1.0)):
        run = edge[1] - edge[0]
        steep = 1 / np.maximum(np.hypot(run, 2 * half), _LEAST)
        offsets.append(
            edge[0, :, None] + np.outer(run, _ALONG) + (side * dilation * 2 * half * steep)[:, None]
        )
        heights.append(np.outer(2 * half, _ALONG - 0.5) - (side * dilation * run * steep)[:, None])
    for end, up in ((0, -1.0), (1, 1.0)):
        offsets.append(outer[end, :, None] + np.outer(hole[end] - outer[end], _ACROSS))
        heights.append(np.repeat((up * (half + dilation))[:, None], len(_ACROSS), axis=1))
    return np.concatenate(offsets, axis=1), np.concatenate(heights, axis=1)


def _outline(params: Floats, q: Floats) -> tuple[Floats, Floats]:
    """Points (M, P, C) of the rounded section, moved outwards by q (M, P)."""
    sides = params[:, (Column.SX, Column.SY)]
    half_x, half_y = (np.maximum(side[:, None] / 2 + q, 0)[..., None] for side in sides.T)
    corner = params[:, Column.ROUNDNESS] * sides.min(axis=1) / 2
    radius = np.clip((corner[:, None] + q)[..., None], 0, np.minimum(half_x, half_y))
    one, angle = np.ones(len(_SIDE)), np.radians(_ARC)
    x = np.concatenate(
        [half_x * one, half_x - radius * (1 - np.cos(angle)), (half_x - radius) * _SIDE[::-1]], axis=-1
    )
    y = np.concatenate(
        [(half_y - radius) * _SIDE, half_y - radius * (1 - np.sin(angle)), half_y * one], axis=-1
    )
    return np.concatenate([x, x, -x, -x], axis=-1), np.concatenate([y, -y, y, -y], axis=-1)


def _bent(params: Floats, x: Floats, z: Floats) -> tuple[Floats, Floats]:
    """Where x and z of the straightened part lie in the bent one: along its arc, and straight on beyond."""
    half = np.maximum(params[:, Column.SZ] / 2, 1e-6)[:, None, None]
    bulge = params[:, Column.BULGE][:, None, None]
    theta = np.maximum(bulge, _STRAIGHT) * (np.pi / 2)
    sine, cosine = np.sin(theta), np.cos(theta)
    curvature, height, up = sine / half, np.abs(z), np.copysign(1.0, z)
    phi, stretch = height * theta / half, 1 + curvature * x
    on_arc = height <= half
    beyond = height - half
    bent_x = np.where(on_arc, (cosine - stretch * np.cos(phi)) / curvature, sine * beyond - cosine * x)
    bent_z = np.where(on_arc, stretch * np.sin(phi) / curvature, half + sine * x + cosine * beyond)
    straight = bulge < _STRAIGHT
    return np.where(straight, x, bent_x), np.where(straight, z, up * bent_z)
