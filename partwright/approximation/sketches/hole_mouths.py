"""The cones in which round holes of a mesh end, countersinks and chamfers, by their own facets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.directions import frame_along
from partwright.shapes.topology import components

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_BINS, _CLOSED = 72, 0.95  # of a turn, so many of which the wall of a hole covers
_STEEPEST, _FLATTEST = math.sin(math.radians(15)), math.sin(math.radians(75))  # half angles of a cone
_SAME = 0.03  # of a sine, by which faces of one cone may differ: their chords are not all alike
_AT = 0.02  # of the radius, by which corners may be off a cone, or the end of a wall
_LEAST = 2e-3  # unit lengths: depth


@dataclass(frozen=True)
class Mouth:
    """A cone that goes on from a hole's end. radius: where it is widest; depth: from the hole's end to there,
    unit lengths."""

    radius: float
    depth: float


@dataclass(frozen=True)
class MouthSearch:
    """A closed mesh: vertices (V, 3), faces (F, 3), their normals (F, 3), edges (E, 2) of vertices, and the
    faces beside each (E, 2)."""

    vertices: Floats
    faces: Indices
    normals: Floats
    edges: Indices
    beside: Indices

    def mouth(self, walls: Indices, end: Floats, axis: Floats, radius: float) -> Mouth | None:
        """The cone that goes on from the end (3,) of a round hole; None where there is none.

        walls: (W,) faces of the hole. axis: (3,) unit vector out of it. radius: of the hole.
        """
        near = _AT * radius
        of_wall = np.zeros(len(self.faces), bool)
        of_wall[walls] = True
        is_wall = of_wall[self.beside]
        border = np.flatnonzero(is_wall.sum(axis=1) == 1)
        heights = (self.vertices[self.edges[border]] - end) @ axis
        border = border[(np.abs(heights) < near).all(axis=1)]
        seeds = self.beside[border][~is_wall[border]]
        sine = float(np.median(self.normals[seeds] @ axis)) if len(seeds) else 0.0
        if not _STEEPEST < sine < _FLATTEST:
            return None
        alike = np.abs(self.normals @ axis - sine) < _SAME
        pairs = self.beside[alike[self.beside].all(axis=1)]
        label = components(len(self.faces), *pairs.T)
        cone = np.flatnonzero(alike & np.isin(label, label[seeds[alike[seeds]]]))
        if not len(cone):
            return None
        frame = frame_along(axis)
        corners = (self.vertices[self.faces[cone]] - end) @ frame
        away, height = np.linalg.norm(corners[..., :2], axis=-1).ravel(), corners[..., 2].ravel()
        depth = float(height.max())
        slope = float(height @ (away - radius)) / max(float(height @ height), 1e-12)
        off = np.abs(away - radius - slope * height)
        if depth < _LEAST or slope <= 0 or off.max() > _AT * away.max() or not closes(corners[..., :2]):
            return None
        return Mouth(radius + slope * depth, depth)


def closes(walls: Floats) -> bool:
    """Whether walls (F, 3, 2) about the origin go all around it."""
    angle = np.arctan2(walls[..., 1], walls[..., 0])
    turned = (angle - angle[:, :1] + math.pi) % math.tau - math.pi
    low, high = angle[:, 0] + turned.min(axis=1), angle[:, 0] + turned.max(axis=1)
    middles = (np.arange(_BINS) + 0.5) * (math.tau / _BINS)
    within = (middles - low[:, None]) % math.tau <= (high - low)[:, None]
    return bool(within.any(axis=0).mean() >= _CLOSED)
