"""A plate is bored as the boss on it is, and not around that."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Field, Profile, Tube
from partwright.fields.profile import circle
from partwright.superfrusta.feature_rings import with_shared_bores
from partwright.superfrusta.feature_steps import Feature, FeatureTree

POINTS = np.random.default_rng(0).uniform(-0.9, 0.9, (20_000, 3)).astype(np.float32)
PLATE = Profile.rectangle(1.4, 1.2)
RING = Tube(0.4, 0.15, 0.6)
ROUND = Extrusion(Profile(circle(0.4), [circle(0.25)]), 0.6, top_fillet=0.03)


def tree(*steps: tuple[bool, Part]) -> FeatureTree:
    none = np.zeros(0, bool)
    return FeatureTree([Feature(added, part, none, 4) for added, part in steps])


def bored(radius: float) -> Extrusion:
    return Extrusion(Profile(PLATE.outline, [circle(radius, (0.2, 0.1))]), 0.2)


@pytest.mark.parametrize("ring", [RING, ROUND])
def test_a_hole_in_a_profile_and_one_that_is_cut_become_the_rings(ring: Field) -> None:
    boss = True, Part(ring, (0.2, 0.1, 0.2))
    plate = tree((True, Part(bored(0.4), (0, 0, 0))), boss)
    drilled = tree((True, Part(Box((1.4, 1.2, 0.2)))), (False, Part(Cylinder(0.4, 0.3), (0.2, 0.1, 0))), boss)
    for given in (plate, drilled):
        made = with_shared_bores(given, POINTS)
        np.testing.assert_array_equal(made.at(POINTS), given.at(POINTS))
        assert made.features[-1] is given.features[-1]
    (loop,) = with_shared_bores(plate, POINTS).features[0].part.field.profile.holes
    assert Profile(loop).size == pytest.approx(Profile(circle(0.25)).size)
    assert with_shared_bores(drilled, POINTS).features[1].part.field.radius == pytest.approx(0.25)


def test_copies_go_along() -> None:
    moves = (Similarity(translation=(0.0, 0.5, 0.0)),)
    hole, ring = Cylinder(0.2, 0.4), Tube(0.2, 0.05, 0.2)
    steps = [(True, Part(Box((1.4, 1.2, 0.2)))), (False, Part(hole, instances=moves))]
    both = tree(*steps, (True, Part(ring, instances=moves)))
    assert with_shared_bores(both, POINTS).features[1].part.field.radius == pytest.approx(0.15)
    alone = tree(*steps, (True, Part(ring)))
    assert with_shared_bores(alone, POINTS) is alone


def test_other_holes_stay() -> None:
    """In which the ring is shorter, or loose, or does not stand."""
    plate = True, Part(Box((1.4, 1.2, 0.6)))
    for ring, at in (
        (Tube(0.4, 0.15, 0.3), (0, 0, 0)),
        (Tube(0.38, 0.15, 0.8), (0, 0, 0)),
        (RING, (0.1, 0, 0)),
    ):
        given = tree(plate, (False, Part(Cylinder(0.4, 0.8))), (True, Part(ring, at)))
        assert with_shared_bores(given, POINTS) is given
