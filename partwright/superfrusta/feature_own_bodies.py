"""Which candidates are bodies that a shape is made of: they lie within it, and their walls are its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.manifolds import surface_of
from partwright.shapes.sampling import sample_triangles

if TYPE_CHECKING:
    from partwright.approximation.sketches.candidate import Candidate
    from partwright.superfrusta.feature_search import FeatureSearch

_OUTSIDE = 0.02  # of a body, that may lie outside of the shape
_OWN = 0.4  # of its walls, that are walls of the shape at least: a slice of a body has others
_NEAR = 8e-3  # unit lengths: turned bodies are made with walls half as far inside
_POINTS = 400


def is_own_body(search: FeatureSearch, candidate: Candidate) -> bool:
    """Whether a candidate is such a body of the search's shape."""
    return _lies_within(search, candidate) and _has_own_walls(search, candidate)


def _lies_within(search: FeatureSearch, candidate: Candidate) -> bool:
    mask = search.mask(candidate)
    outside = (mask * ~search.inside) @ search.weights
    return bool((outside <= _OUTSIDE * (mask @ search.weights)).all())


def _has_own_walls(search: FeatureSearch, candidate: Candidate) -> bool:
    walls, _ = candidate.bodies
    if walls.is_empty():
        return False
    vertices, faces = surface_of(walls)
    places, _ = sample_triangles(vertices, faces, _POINTS, seed=0)
    near = search.samples.away(places.astype(np.float32), _NEAR) < _NEAR
    return bool(near.mean() > _OWN)
