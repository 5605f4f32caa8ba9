"""Kinds of solids: which parameters of a SuperFrustum a box, a cylinder or a torus has.

A row says itself what kind it is: a parameter at its plain value (a roundness, a taper of 1, a size of 0) is
locked there, and so no fit changes a part's kind. The paper (section 5) mixes the parameters of all kinds
with barycentric weights and sharpens the mix to one of them; a mix of a box and a sphere is neither, and
which of them it leans to is settled by the first steps. Here every kind starts on its own for every region,
is fitted by its own few parameters, and the best one wins; plainer kinds are tried again once all parts are
there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Field,
    Frustum,
    HollowBox,
    HollowFrustum,
    Sphere,
    Torus,
    Tube,
)
from partwright.fields.columns import FIELD, POSE_STEP, SIZE, SIZE_STEP, STEP_WIDTH, Column, Tangent

Rows = NDArray[np.float32]
Floats = NDArray[np.float64]


_THINNEST_RING = 0.999  # a torus must keep a hole
_MORE = 0.04  # of the loss: what a further parameter must save


def kind_freedom(rows: Rows) -> NDArray[np.bool_]:
    """Parameters (M, 15) that the kind of each part leaves free; a round part's sx and sy move as one."""
    free = np.zeros((len(rows), STEP_WIDTH), bool)
    free[:, POSE_STEP] = True
    free[:, SIZE_STEP] = rows[:, SIZE] > 0
    taper, onion = rows[:, Column.TAPER], rows[:, Column.ONION]
    free[:, Tangent.DILATION] = rows[:, Column.DILATION] > 0
    free[:, Tangent.TAPER] = (taper != 0) & (taper != 1)
    free[:, Tangent.ONION] = (onion != 0) & (onion != 1)
    return free


def round_parts(rows: Rows) -> NDArray[np.bool_]:
    """Parts (M,) with a circular section, which stays one."""
    return np.asarray((rows[:, Column.ROUNDNESS] == 1) & (rows[:, Column.SX] > 0))


def solid(row: Rows) -> Field:
    """The named field of a row (17,); float32 values keep their shortest decimal form."""
    sx, sy, sz, roundness, dilation, taper, _, onion = (float(str(v)) for v in row[FIELD])
    if sx == sy == 0:
        return Capsule(dilation, sz) if sz > 0 else Sphere(dilation)
    if sz == 0:
        return Torus(sx / 2, min(dilation, _THINNEST_RING * sx / 2))
    wall = (1 - onion) * min(sx, sy) / 2
    if roundness == 0:
        return HollowBox((sx, sy, sz), wall) if onion > 0 else Box((sx, sy, sz))
    if taper == 1:
        return Tube(sx / 2, wall, sz) if onion > 0 else Cylinder(sx / 2, sz)
    if onion > 0:
        return HollowFrustum(sx / 2, taper * sx / 2, wall, sz)
    return Frustum(sx / 2, taper * sx / 2, sz) if taper > 0 else Cone(sx / 2, sz)


def is_solid(row: Rows) -> bool:
    """Whether the row (17,) is of one of the kinds, so that `solid` is exact."""
    sx, sy, sz, roundness, dilation, taper, bulge, onion = row[FIELD]
    if bulge > 0 or (sx > 0) != (sy > 0):
        return False
    if dilation > 0:
        ring = sz == 0 and sx == sy and roundness == 1 and onion == 1 and taper == 1
        return bool(sx == sy == 0 or (ring and dilation < sx / 2))
    square = roundness == 0 and taper == 1
    return bool(sz > 0 and sx > 0 and onion < 1 and (square or (roundness == 1 and sx == sy)))


def plainness(rows: Rows) -> Floats:
    """Factors (M,) on losses: 1 for boxes, cylinders and spheres, a little more for what has more numbers."""
    tapered = ~np.isin(rows[:, Column.TAPER], (0.0, 1.0))
    hollow = (rows[:, Column.ONION] > 0) & (rows[:, Column.DILATION] == 0)
    other = (rows[:, Column.DILATION] > 0) & (rows[:, SIZE] > 0).any(axis=1)
    return 1 + _MORE * (1.0 * tapered + hollow + other)
