"""What paid most at first goes where less is needed without it, and what is as it was drawn stays."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold

import partwright as pw
from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.candidates import candidates
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_copying import replayed
from partwright.superfrusta.feature_recasting import recast
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

# In the unit frame: the longest side 1.8, and the same on both sides of the middle.
WEB = Part(Box((1.8, 0.8, 0.2)))
PIN = Part(Cylinder(0.1, 0.6), (0.6, 0.1, 0.0))
NECK = Part(Cylinder(0.2, 0.4), (-0.5, -0.1, 0.0))


@pytest.fixture(scope="module")
def search() -> FeatureSearch:
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(mesh_assembly(Assembly((WEB, PIN, NECK))))
    return FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)


def box(size: tuple[float, float, float], middle: tuple[float, float, float] = (0, 0, 0)) -> Candidate:
    body = Manifold.cube(size, center=True).translate(middle)
    return Candidate(Part(Box(size), middle), lambda _: body, 4, float(np.prod(size)))


AROUND = box((1.42, 0.6, 0.6))


def kinds(tree: FeatureTree) -> list[str]:
    return sorted(type(feature.part.field).__name__ for feature in tree.features)


def own(search: FeatureSearch) -> list[Candidate]:
    return candidates(search.body, search.frames, holes=True)


def grown(search: FeatureSearch, *first: Candidate) -> FeatureTree:
    tree = search.empty
    for candidate in first:
        tree = search.extended(tree, candidate, True)
    while (step := search.step(tree, own(search))) is not None:
        tree = step
    return tree


def test_a_body_around_others_goes_with_all_that_was_cut_from_it(search: FeatureSearch) -> None:
    roundabout = grown(search, box((1.8, 0.8, 0.2)), AROUND)
    assert len(roundabout.features) > 3
    plain = recast(search, roundabout, own(search))
    assert kinds(plain) == ["Box", "Cylinder", "Cylinder"]
    assert plain.objective > roundabout.objective
    assert plain.objective == pytest.approx(plain.score - plain.price)
    assert plain.score == pytest.approx(search.score_of(plain.at(search.points)), abs=1e-3)


def test_what_is_drawn_as_it_is_stays(search: FeatureSearch) -> None:
    drawn = grown(search, box((1.8, 0.8, 0.2)))
    assert recast(search, drawn, own(search)) is drawn


def test_a_step_that_is_taken_back_leaves_what_the_others_make(search: FeatureSearch) -> None:
    web, wrong = box((1.8, 0.8, 0.2)), box((0.3, 0.3, 0.3), (0.0, 0.2, 0.3))
    tree = search.extended(search.extended(search.empty, web, True), wrong, True)
    left = replayed(search, tree.steps[:1])
    alone = search.extended(search.empty, web, True)
    assert (left.covered == alone.covered).all()
    assert left.score == pytest.approx(alone.score)
    assert left.price == pytest.approx(alone.price)
    assert left.missed.volume() == pytest.approx(alone.missed.volume())
    assert left.excess.volume() == pytest.approx(alone.excess.volume(), abs=1e-9)


def test_a_search_that_went_roundabout_ends_plain(
    search: FeatureSearch, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = FeatureSearch.grown

    def misled(self: FeatureSearch, tree: FeatureTree, *rest: object, **more: object) -> FeatureTree:
        return real(self, self.extended(tree, AROUND, True), *rest, **more)

    monkeypatch.setattr(FeatureSearch, "grown", misled)
    tree = search.run()
    assert tree is not None
    assert kinds(tree) == ["Box", "Cylinder", "Cylinder"]
