"""What a tree begins with gives way to another body where cuts carve it."""

from __future__ import annotations

from unittest.mock import patch

import pytest

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Extrusion
from partwright.fields.profile import Profile
from partwright.meshing import mesh_assembly
from partwright.superfrusta import feature_search
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

HALF, WALL = 0.7, 0.12
CHANNEL = Profile(
    [
        (-HALF, -HALF),
        (HALF, -HALF),
        (HALF, HALF),
        (HALF - WALL, HALF),
        (HALF - WALL, WALL - HALF),
        (WALL - HALF, WALL - HALF),
        (WALL - HALF, HALF),
        (-HALF, HALF),
    ]
)
UPRIGHT = (0.5**0.5, 0.5**0.5, 0.0, 0.0)


def searched(*parts: Part, operation: str = "union") -> FeatureSearch:
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(mesh_assembly(Assembly(parts, operation)))
    return FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)


def features(tree: FeatureTree | None) -> list[tuple[bool, str]]:
    assert tree is not None
    return sorted((feature.added, type(feature.part.field).__name__) for feature in tree.features)


def unchanged(_: FeatureSearch, tree: FeatureTree, __: object) -> FeatureTree:
    return tree


@pytest.fixture(scope="module")
def bracket() -> FeatureSearch:
    """A channel and a boss below it: from the front both are one outline."""
    channel = Part(Extrusion(CHANNEL, 1.2), rotation=UPRIGHT)
    boss = Part(Cylinder(0.42, 0.4), (0.0, 0.0, -HALF - 0.1))
    return searched(channel, boss)


def test_a_boss_is_a_boss_and_no_outline_with_pockets(bracket: FeatureSearch) -> None:
    tree = bracket.run()
    assert features(tree) == [(True, "Cylinder"), (True, "Extrusion")]
    with patch.object(feature_search, "rebased", unchanged):
        roundabout = bracket.run()
    assert tree is not None
    assert roundabout is not None
    assert any(not feature.added for feature in roundabout.features)
    assert tree.objective > roundabout.objective


def test_a_recess_that_was_cut_stays_one() -> None:
    block, recess = Part(Box((1.8, 1.2, 0.6))), Part(Cylinder(0.5, 0.4), (0.1, 0.0, 0.2))
    tree = searched(block, recess, operation="difference").run()
    assert features(tree) == [(False, "Cylinder"), (True, "Box")]
