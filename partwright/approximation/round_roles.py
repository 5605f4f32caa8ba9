"""Names of what is round: bodies that stand about an axis, and whether a round cut is a hole."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Node, Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cone, Cylinder, Extrusion, Field, Frustum, Revolution, Tube
from partwright.fields.profile import circle_of

Floats = NDArray[np.float64]

_FLAT = 0.3  # a disc's thickness over its diameter, at most
_LONG = 3.0  # a shaft's length over its diameter, at least
_CLOSED = 0.5  # of a turn, that a hole's wall goes around its axis somewhere, at least
_BEHIND = 1e-3  # of its radius: how far behind a wall it is looked at
_LEVELS = (np.arange(12) + 0.5) / 12  # of each stretch of a wall
_TURNS = np.arange(32) * (2 * np.pi / 32)


def round_size(field: Field) -> tuple[float, float] | None:
    """Radius and height of what is as round outside as a cylinder; None of others."""
    if isinstance(field, Cylinder | Tube):
        return field.radius, field.height
    circle = circle_of(field.profile.outline) if isinstance(field, Extrusion) and not field.taper else None
    return (circle[0], field.height) if circle is not None and isinstance(field, Extrusion) else None


def round_role(radius: float, height: float) -> str:
    """What a round body is called."""
    if height < _FLAT * 2 * radius:
        return "disc"
    return "shaft" if height > _LONG * 2 * radius else "boss"


def is_walled(part: Part, cut_from: Node) -> bool:
    """Whether the wall of a round cut, or of a copy, goes at least half around it at some level, as that of
    a hole does: an arch along an edge is none. Of what has no wall, a ball, say, it is so."""
    wall = _wall(part.field)
    if not len(wall):
        return True
    radii, levels = (1 + _BEHIND) * wall[:, 0], wall[:, 1]
    rings = np.empty((len(wall), len(_TURNS), 3))
    rings[..., 0], rings[..., 1] = np.outer(radii, np.cos(_TURNS)), np.outer(radii, np.sin(_TURNS))
    rings[..., 2] = levels[:, None]

    def around(copy: Part) -> float:
        points = rings.reshape(-1, 3) @ rotation_matrix(copy.rotation).T + copy.translation
        return float((cut_from.distance(points).reshape(rings.shape[:2]) < 0).mean(axis=1).max())

    return any(around(copy) >= _CLOSED for copy in part.copies)


def _wall(field: Field) -> Floats:
    """(N, 2) radii and heights of points of what goes around the axis of a round cut."""
    if isinstance(field, Revolution):
        stretches = [(side.start, side.end) for side in field.profile.sides[0]]
    elif isinstance(field, Cone | Frustum):
        bottom = field.radius if isinstance(field, Cone) else field.bottom_radius
        top = 0.0 if isinstance(field, Cone) else field.top_radius
        stretches = [((bottom, -field.height / 2), (top, field.height / 2))]
    else:
        size = round_size(field)
        if size is None:
            return np.zeros((0, 2))
        stretches = [((size[0], -size[1] / 2), (size[0], size[1] / 2))]
    walls = [np.array(one) for one in stretches if max(one[0][0], one[1][0]) > 0 and one[0][1] != one[1][1]]
    points = [start + _LEVELS[:, None] * (end - start) for start, end in walls]
    return np.concatenate(points) if points else np.zeros((0, 2))
