"""Parts that stand on one another with the same profile are one part."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from partwright.approximation.profile_parts import stacked
from partwright.assembly import Part, Similarity
from partwright.fields import Cylinder, Extrusion, Profile, Tube

HEXAGON = Profile.regular(6, 2.0)


def test_two_on_each_other_with_the_same_profile_are_one() -> None:
    """In whatever order, and turned to any side; not beside each other, apart, of two sizes or turned."""
    turn = Similarity(rotation=(0.5, 0.5, 0.5, 0.5))
    for field, height in ((Cylinder(2, 3), 5.0), (Tube(2, 1, 3), 5.0), (Extrusion(HEXAGON, 3), 5.0)):
        low, high = (
            Part(field).transformed(turn),
            Part(replace(field, height=2.0), (0, 0, 2.5)).transformed(turn),
        )
        whole = Part(replace(field, height=height), (0, 0, 1)).transformed(turn)
        for one, other in ((low, high), (high, low)):
            found = stacked(one, other, 1e-3)
            assert found is not None
            assert np.allclose(found.bounds(), whole.bounds())
            assert found.field == whole.field
        for x, z, size in ((0.1, 0.0, 1), (0.0, 0.1, 1), (0.0, 0.0, 1.1)):
            moved = replace(high, field=replace(field.scaled(size), height=2.0)).translated((z, x, 0))
            assert stacked(low, moved, 1e-3) is None
    assert stacked(low, high.transformed(Similarity.turn((1, 0, 0), 0.1)), 1e-3) is None
