"""Quadrics as flat facets, for sources whose language has no word for them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.closed_quadrics import Ball
from partwright.assembly import Part
from partwright.fields import Quadric
from partwright.meshing.quadric_solids import quadric_solid

if TYPE_CHECKING:
    from manifold3d import Manifold


_FINENESS = (48, 36, 24, 18, 12)  # facets of a full circle, of which the first that is few triangles is taken


def few_quadric_facets(quadric: Quadric, part: Part, ball: Ball, most: int) -> tuple[Manifold, float]:
    """As `quadric_facets`, in the ball's box alone; and how far they may lie from the quadric.

    most: triangles. The coarsest is returned however many it has: of 1,500 quadrics with random coefficients
    none had more than 434."""
    from manifold3d import Manifold

    box = Manifold.cube((2 * ball.radius,) * 3, True)
    box = box.translate(tuple(part.pose.inverse()(ball.centre).tolist()))
    for facets in _FINENESS:
        chord = _chord(ball, facets)
        solid = (quadric_facets(quadric, part, ball, facets) ^ box).simplify(chord / 4)
        if solid.num_tri() <= most:
            break
    return solid, 1.25 * chord


def quadric_facets(quadric: Quadric, part: Part, ball: Ball, facets: int) -> Manifold:
    """The quadric of a part in its own frame, closed off outside the ball; facets: of a full circle as large
    as that."""
    box = part.pose.inverse()(ball.centre) + ball.radius * np.array([[-1.0], [1.0]])
    return quadric_solid(quadric, box, _chord(ball, facets))


def _chord(ball: Ball, facets: int) -> float:
    return ball.radius * (1 - math.cos(math.pi / facets))
