"""Shapes within a link: shrunk until they are, and the best of many."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.hulls import file_hull
from partwright.meshing.manifolds import as_mesh
from partwright.robots.containment import shape_solid
from partwright.robots.inscribed import deepest
from partwright.robots.model import Shape
from partwright.robots.solids import Target

if TYPE_CHECKING:
    from manifold3d import Manifold

_STEPS = 14  # of the bisection for the size


def largest_together(shapes: Sequence[Shape], most: int) -> list[Shape]:
    """At most so many of the shapes, in their order: each time the one that adds most volume to those that
    are taken."""
    from manifold3d import Manifold

    if len(shapes) <= most:
        return list(shapes)
    solids = [shape_solid(shape) for shape in shapes]
    taken: list[int] = []
    union = Manifold()
    for _ in range(most):
        left = [i for i in range(len(shapes)) if i not in taken]
        taken.append(max(left, key=lambda i: float((solids[i] - union).volume())))
        union = union + solids[taken[-1]]
    return [shapes[i] for i in sorted(taken)]


def within(shape: Shape, target: Target) -> Shape | None:
    """The shape shrunk about its deepest point until nothing of it is outside of the target; None for a shape
    of which nothing is inside."""
    solid = shape_solid(shape)
    common = solid ^ target.solid
    if common.is_empty() or common.volume() <= 0:
        return None
    if _outside(solid, target) <= 0:
        return shape
    centre = deepest(common)
    low, high = 0.0, 1.0
    for _ in range(_STEPS):
        middle = (low + high) / 2
        low, high = (middle, high) if _outside(_about(solid, centre, middle), target) <= 0 else (low, middle)
    return _scaled(shape, centre, low) if low > 0 else None


def _outside(solid: Manifold, target: Target) -> float:
    """Volume outside, less what is rounding."""
    return float((solid - target.solid).volume()) - 1e-9 * float(solid.volume())


def _about(solid: Manifold, centre: np.ndarray, scale: float) -> Manifold:
    return solid.translate(tuple(-centre)).scale((scale,) * 3).translate(tuple(centre))


def _scaled(shape: Shape, centre: np.ndarray, scale: float) -> Shape:
    if shape.part is not None:
        part = shape.part.translated((-centre).tolist()).scaled(scale).translated(centre.tolist())
        return Shape(shape.name, part)
    assert shape.mesh is not None
    corners = (np.asarray(shape.mesh.vertices) - centre) * scale + centre
    return Shape(shape.name, mesh=as_mesh(file_hull(corners)))
