"""Which candidates are bodies that a shape is made of: they lie within it, and their walls are its own. And
which are none: a ring that makes a hole narrower for a part of its depth, which is drawn as a counterbore."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Extrusion, Field, Revolution, Tube
from partwright.fields.profile import Profile, circle
from partwright.meshing.manifolds import surface_of
from partwright.shapes.sampling import sample_triangles

if TYPE_CHECKING:
    from partwright.approximation.sketches.candidate import Candidate
    from partwright.superfrusta.feature_search import FeatureSearch

_OUTSIDE = 0.02  # of a body, that may lie outside of the shape
_OWN = 0.4  # of its walls, that are walls of the shape at least: a slice of a body has others
_NEAR = 8e-3  # unit lengths: turned bodies are made with walls half as far inside
_POINTS = 400
_AROUND, _UP = 8, (-0.3, 0.0, 0.3)  # angles, and shares of the height, at which a ring's outside is looked at


class OwnBodies:
    """Asked of each candidate of one search once."""

    def __init__(self, search: FeatureSearch) -> None:
        self._search = search
        self._known: dict[int, tuple[Candidate, bool]] = {}
        self._rings: dict[int, tuple[Candidate, bool]] = {}

    def lines_a_hole(self, candidate: Candidate) -> bool:
        """Whether it has a hole, and the shape goes on all around it."""
        key = id(candidate)
        if key not in self._rings:
            self._rings[key] = candidate, self._goes_on_around(candidate.part)
        return self._rings[key][1]

    def _goes_on_around(self, part: Part) -> bool:
        around = _outside_of_ring(part.field)
        if not len(around):
            return False
        places = around @ rotation_matrix(part.rotation).T + part.translation
        return bool((self._search.samples.measure(places.astype(np.float32)) < -_NEAR).all())

    def __contains__(self, candidate: Candidate) -> bool:
        key = id(candidate)
        if key not in self._known:
            self._known[key] = candidate, self._lies_within(candidate) and self._has_own_walls(candidate)
        return self._known[key][1]

    def _lies_within(self, candidate: Candidate) -> bool:
        search = self._search
        mask = search.mask(candidate)
        outside = (mask * ~search.inside) @ search.weights
        return bool((outside <= _OUTSIDE * (mask @ search.weights)).all())

    def _has_own_walls(self, candidate: Candidate) -> bool:
        walls, _ = candidate.bodies
        if walls.is_empty():
            return False
        vertices, faces = surface_of(walls)
        places, _ = sample_triangles(vertices, faces, _POINTS, seed=0)
        near = np.abs(self._search.samples.measure(places.astype(np.float32))) < _NEAR
        return bool(near.mean() > _OWN)


def _outside_of_ring(field: Field) -> np.ndarray:
    """(N, 3) on the outer walls of what has a hole along z; none of others."""
    if isinstance(field, Revolution):
        outer = [side for side in field.profile.sides[0] if side.end[1] - side.start[1] > 0]
        if not field.full or min(x for x, _, _ in field.profile.outline) <= 0:
            return np.zeros((0, 3))
        x, z = np.array([side.middle for side in outer]).T
        turns = 2 * math.pi * np.arange(_AROUND)[:, None] / _AROUND
        ring = [x * np.cos(turns), x * np.sin(turns), np.broadcast_to(z, (_AROUND, len(z)))]
        return np.stack(ring, axis=-1).reshape(-1, 3)
    if isinstance(field, Tube):
        outline = Profile(circle(field.radius))
    elif isinstance(field, Extrusion) and field.profile.holes and not field.taper:
        outline = Profile(field.profile.outline)
    else:
        return np.zeros((0, 3))
    flat = np.array([place for side in outline.sides[0] for place in (side.start, side.middle)])
    return np.concatenate([np.column_stack([flat, np.full(len(flat), z * field.height)]) for z in _UP])
