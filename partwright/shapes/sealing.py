"""The solid that is seen in an open surface: all that is reached from outside through narrow gaps at most.

Assets for games and scans enclose nothing to the letter: a controller is two half shells a hair apart, a car
has no floor under its seats. Who looks at one sees a solid.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.contour import contour
from partwright.shapes.distance import MeshDistance, grid_indices
from partwright.shapes.flooding import reached_from_outside
from partwright.shapes.frame import LONGEST_SIDE
from partwright.shapes.grid import near_voxels
from partwright.shapes.hidden_faces import Ground
from partwright.shapes.sampling import sample_triangles

GAP = 0.014  # of the longest side: the widest that is bridged
_REACH = GAP * LONGEST_SIDE / 2  # unit lengths: half of it
_CELL = LONGEST_SIDE / 144
_FAR = _REACH + 2 * _CELL  # further off no distance matters
_OFF = 1.5 * _REACH  # what bridges a gap is nearer to its sides: what is as far off is made up
_PROBES = 4000  # points of the surface at which it is looked whether something solid is behind them
_DEEP = 0.75  # cells: what is as deep somewhere is solid
_NEAR = 5  # cells along a side of the cube about a probe in which it is looked
_SOLID = 0.9  # of the probes


@dataclass(frozen=True)
class Sealed:
    """A closed surface, vertices (V, 3) in the unit frame and faces (F, 3). made_up: which faces (F,) lie
    over what is wider than gaps, as over the ground. solid: the share of the given surface behind which it is
    solid."""

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    made_up: NDArray[np.bool_]
    solid: float


def seal(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], ground: Ground | None = None
) -> Sealed | None:
    """The solid whose border triangles (F, 3) are but for gaps narrower than `GAP`; None where they are that
    of none, as cloth and leaves. Where the ground is known, what is open below may stand on it.

    vertices: (V, 3), unit frame. It is a morphological closing by exact distances: the outside is where a
    ball as wide as the gap gets to from far away, and the solid is what no such ball covers any of. So
    narrower grooves are filled, and inner edges rounded by as much.
    """
    from scipy.ndimage import minimum_filter

    given = MeshDistance(vertices, faces, faces, closed=False)
    probes = sample_triangles(vertices, faces, _PROBES, 0)[0]
    used = vertices[np.unique(faces)]
    low, high = used.min(axis=0) - _FAR, used.max(axis=0) + _FAR
    sides = np.ceil((high - low) / _CELL).astype(int) + 1
    places = low + _CELL * grid_indices(sides)
    distance = _distances(given, low, sides)
    stands = ground is not None and float((used @ ground.up).min()) - ground.height < _REACH
    for floor in (None, ground) if stands else (None,):
        field = _closing(places, low, distance, floor)
        near = np.rint((probes - low) / _CELL).astype(int)
        deepest = minimum_filter(field, _NEAR)[tuple(near.T)]
        solid = float((deepest < -_DEEP * _CELL).mean())
        if solid >= _SOLID:
            made, triangles = contour(field, low, _CELL)
            off = given.unsigned(made, _OFF)[triangles] >= _OFF
            return Sealed(made, triangles, np.asarray(off.all(axis=1)), solid)
    return None


def _closing(
    places: NDArray[np.float64],
    low: NDArray[np.float64],
    distance: NDArray[np.float32],
    ground: Ground | None,
) -> NDArray[np.floating]:
    """Signed distance (X, Y, Z) of the solid at places (X * Y * Z, 3) from `low` on: right near its surface,
    too little beyond.

    distance: (X, Y, Z) to the triangles. ground: where that is closed.
    """
    from scipy.ndimage import binary_dilation

    free = distance - _REACH
    if ground is None:
        outside = reached_from_outside(free, free > 0)
    else:
        above = (places @ ground.up - ground.height).reshape(free.shape)
        free = np.minimum(free, above)
        # The ball rolls on the ground, and does not get under a rim; then its middle sinks to the ground, as
        # if all were mirrored in it: else an edge would grow at the foot.
        outside = reached_from_outside(free, (free > 0) & (above > _REACH))
        down = np.zeros((3, 3, 3), bool)
        down[tuple(slice(None) if along else 1 for along in ground.up != 0)] = True
        sunk = int(np.ceil(_REACH / _CELL))
        outside = binary_dilation(outside, down, sunk, mask=free > 0)
    # From the surface that the ball's middle comes to, the way back is as far as it kept off.
    vertices, faces = contour(np.where(outside, 1, -1) * np.abs(free), low, _CELL)
    back = _distances(MeshDistance(vertices, faces, faces, closed=False), low, free.shape)
    field = _REACH + np.where(outside, back, -back)
    return field if ground is None else np.maximum(field, -above)


def _distances(source: MeshDistance, low: NDArray[np.float64], sides: Sequence[int]) -> NDArray[np.float32]:
    """Distance (X, Y, Z) of the grid's places, `_FAR` where it is more."""
    x, y, z = (int(side) for side in sides)
    near, close = near_voxels(source, low, _CELL, (x, y, z), _FAR)
    distance = np.full((x, y, z), _FAR, np.float32)
    distance[tuple(near.T)] = close
    return distance
