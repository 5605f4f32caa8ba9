"""Walls and openings with floors in trees of features become solids with pockets."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Part
from partwright.fields import Extrusion, Profile
from partwright.fields.profile import circle
from partwright.superfrusta.feature_pockets import with_pockets
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from tests.superfrusta.trees import kinds


@pytest.mark.parametrize("first", ["wall", "floor"])
def test_a_wall_and_a_drilled_floor_are_a_block_with_a_pocket(first: str) -> None:
    """Whichever was found first: the floor's holes are not filled by the block that it becomes part of."""
    outline, none = Profile.rectangle(1.4, 1.0), np.zeros(0, bool)
    wall = Part(Extrusion(Profile(outline.outline, (Profile.rectangle(1.2, 0.8).outline,)), 0.8))
    floor = Part(Extrusion(Profile(outline.outline, (circle(0.1),)), 0.2), (0, 0, -0.3))
    parts = (wall, floor) if first == "wall" else (floor, wall)
    tree = FeatureTree([Feature(True, part, none, 4) for part in parts])
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (20_000, 3)).astype(np.float32)
    after = with_pockets(tree, points)
    assert kinds(after) == [(True, "box", 1), (False, "extrusion", 1), (False, "cylinder", 1)]
    assert (after.at(points) == tree.at(points)).mean() > 0.999
