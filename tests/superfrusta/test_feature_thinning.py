"""When a tree is mended, what explains little goes if the surface hardly moves without it, and only then."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from manifold3d import Manifold

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Tube
from partwright.meshing import mesh_assembly
from partwright.meshing.csg import solid_of
from partwright.superfrusta.far_places import Solid, reach
from partwright.superfrusta.feature_assembly import FeatureAssembly
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.feature_thinning import SEEN, thinned
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

# In the unit frame: centred, the longest side 1.8.
PLATE = Part(Box((1.8, 1.0, 0.3)))
POST = Part(Box((0.2, 0.2, 0.8)), (-0.7, 0.0, 0.0))  # keeps the middle of the box where it is
BASE = [(PLATE, True), (POST, True)]


def left(features: list[tuple[Part, bool]], shape: Assembly, share: float) -> list[Part]:
    """What is left of features of a shape where the last explains so many prices."""
    settings = Settings.for_quality("draft")
    loaded = pw.load_shape(mesh_assembly(shape))
    samples = FitSamples.of(loaded, settings)

    def tree(search: FeatureSearch, some: list[tuple[Part, bool]]) -> FeatureTree:
        none = np.zeros(0, bool)
        return search.scored(FeatureTree([Feature(added, part, none, 4) for part, added in some]))

    any_price = FeatureSearch(loaded, samples, settings.alpha)
    gain = tree(any_price, features).score - tree(any_price, features[:-1]).score
    assert gain > 0
    search = FeatureSearch(loaded, samples, gain / share)
    given = tree(search, features)
    result = thinned(search, given, FeatureAssembly(loaded).in_unit_frame)
    assert result.score == pytest.approx(search.scored(result).score)
    assert result.price == pytest.approx(search.scored(result).price)
    return [feature.part for feature in result.features]


@pytest.mark.parametrize("proud", [0.6, 1.4])
def test_a_collar_stays_if_it_shows(proud: float) -> None:
    """It explains as much, 1.5 prices; only how far it stands out tells them apart."""
    collar = Part(Cylinder(0.3, 0.1), (0.3, 0.0, 0.1 + proud * SEEN))
    kept = left([*BASE, (collar, True)], Assembly((PLATE, POST, collar)), 1.5)
    assert kept == [PLATE, POST, *([collar] if proud > 1 else [])]


def test_a_keyway_stays_and_so_does_what_explains_much() -> None:
    keyway = Part(Box((0.7, 0.08, 0.08)), (0.3, 0.0, 0.15))
    whole = Assembly((Assembly((PLATE, POST)), keyway), "difference")
    assert left([*BASE, (keyway, False)], whole, 1.5) == [PLATE, POST, keyway]
    low = Part(Box((1.0, 1.0, 0.1)), (0.4, 0.0, 0.1 + 0.6 * SEEN))
    assert left([*BASE, (low, True)], Assembly((PLATE, POST, low)), 2.5) == [PLATE, POST, low]


def test_of_two_that_stand_for_one_another_one_goes() -> None:
    boss, again = Part(Cylinder(0.2, 0.6), (0.3, 0.0, 0.2)), Part(Cylinder(0.2, 0.6), (0.303, 0.0, 0.2))
    assert len(left([*BASE, (again, True), (boss, True)], Assembly((PLATE, POST, boss)), 1.0)) == 3


def test_what_holds_a_body_together_stays() -> None:
    """The slit that it bridges is narrower than what shows."""
    halves = [Part(Box((0.895, 1.0, 0.3)), (x, 0.0, 0.0)) for x in (-0.4525, 0.4525)]
    web = Part(Box((0.1, 0.3, 0.1)))
    whole = Assembly((*halves, web))
    assert left([(halves[0], True), (halves[1], True), (web, True)], whole, 1.5) == [*halves, web]


def test_holes_in_a_round_wall_stay() -> None:
    """Their ends are flat and the wall is not: skins are left over their mouths, and no hole is seen."""
    wall = Part(Tube(0.6, 0.06, 1.8))
    around = tuple(Similarity.turn((0, 0, 1), angle) for angle in (2.0, 4.0))
    across = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    drilled = Part(Cylinder(0.04, 0.3), (0.57, 0.0, 0.4), across, instances=around)
    flat = dataclasses.replace(drilled, field=Cylinder(0.04, 0.056), translation=(0.569, 0.0, 0.4))
    whole = Assembly((wall, drilled), "difference")
    assert left([(wall, True), (flat, False)], whole, 1.5) == [wall, flat]


def test_where_one_of_both_has_no_surface_it_is_infinitely_far() -> None:
    """A feature whose whole neighbourhood goes with it, or a chip where the shape has nothing: asking how far
    it was ended the process."""
    post = Solid(solid_of(POST, 1e-3), POST.distance)
    nothing = Solid(Manifold(), lambda points: np.full(len(points), np.float32(10)))
    box = np.array([[-1.0, -0.5, -0.5], [0.0, 0.5, 0.5]])
    assert reach(post, nothing, box) == reach(nothing, post, box) == math.inf
    assert reach(nothing, nothing, box) == reach(post, post, box) == 0.0
