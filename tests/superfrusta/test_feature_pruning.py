"""Features that pay for nothing go, and those without which a place would be far off stay."""

from __future__ import annotations

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_pruning import farthest_corner, pruned
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

# In the unit frame: centred, the longest side 1.8.
PLATE = Part(Box((1.8, 1.0, 0.3)))
HOLE = Part(Cylinder(0.15, 0.5), (-0.4, 0.0, 0.0))
PIN = Part(Cylinder(0.008, 0.7), (0.4, 0.2, 0.0))  # thinner than samples see
DIMPLE = Part(Cylinder(0.01, 0.02), (0.2, -0.2, 0.15))


@pytest.fixture(scope="module")
def search() -> FeatureSearch:
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(mesh_assembly(Assembly((Assembly((PLATE, HOLE), "difference"), PIN))))
    return FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)


def tree(search: FeatureSearch, *features: tuple[Part, bool]) -> FeatureTree:
    none = np.zeros(0, bool)
    return search.scored(FeatureTree([Feature(added, part, none, 4) for part, added in features]))


def test_what_is_vain_goes_and_what_is_far_stays(search: FeatureSearch) -> None:
    inside = Part(Box((0.3, 0.3, 0.1)), (0.4, -0.2, 0.0))
    drawn = ((PLATE, True), (HOLE, False), (PIN, True))
    given = tree(search, *drawn[:2], (inside, True), (DIMPLE, False), drawn[2])
    left = pruned(search, given)
    assert [feature.part for feature in left.features] == [PLATE, HOLE, PIN]
    assert left.score == pytest.approx(search.scored(tree(search, *drawn)).score)
    assert left.objective > given.objective
    assert farthest_corner(search, left) < 0.01
    assert farthest_corner(search, tree(search, *drawn[:2])) == pytest.approx(0.2, abs=0.01)


def test_a_base_alone_stays(search: FeatureSearch) -> None:
    assert len(pruned(search, tree(search, (PLATE, True))).features) == 1
    assert len(pruned(search, tree(search, (PLATE, True), (HOLE, False))).features) == 2


@pytest.mark.parametrize("small", [(Box((0.7, 0.08, 0.08)), False), (Cylinder(0.3, 0.02), True)])
@pytest.mark.parametrize(("share", "stays"), [(0.9, False), (1.1, True)])
def test_what_is_drawn_stays_if_it_pays_at_all(
    small: tuple[Box | Cylinder, bool], share: float, stays: bool
) -> None:
    """A keyway and a collar explain little, and a dearer price would take them from who drew them."""
    field, added = small
    part = Part(field, (0.3, 0.0, 0.16 if added else 0.15))
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(
        mesh_assembly(Assembly((PLATE, part)) if added else Assembly((PLATE, part), "difference"))
    )
    samples = FitSamples.of(shape, settings)
    any_price = FeatureSearch(shape, samples, settings.alpha)
    gain = tree(any_price, (PLATE, True), (part, added)).score - tree(any_price, (PLATE, True)).score
    assert gain > 0
    given = FeatureSearch(shape, samples, gain / share)
    left = pruned(given, tree(given, (PLATE, True), (part, added)))
    assert len(left.features) == 1 + stays
