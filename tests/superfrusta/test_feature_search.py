"""The search for features does not do what cannot pay, nor anything twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from manifold3d import Manifold

import partwright as pw
from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.candidates import candidates
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

BLOCK = Part(Box((80, 60, 30)))
LARGE, SMALL = Part(Box((40, 40, 20)), (-15, 0, 10)), Part(Box((6, 6, 6)), (30, 20, 13))


@pytest.fixture(scope="module")
def search() -> FeatureSearch:
    settings = Settings.for_quality("draft")
    whole = Assembly((BLOCK, LARGE, SMALL), "difference")
    shape = pw.load_shape(mesh_assembly(whole), unit="mm")
    return FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)


@pytest.fixture(scope="module")
def block(search: FeatureSearch) -> FeatureTree:
    """The block without its pockets."""
    own = candidates(search.body, search.frames, holes=True)
    whole = max(own, key=lambda one: float(np.prod(np.ptp(one.part.bounds(), axis=0))) * (one.sides == 4))
    return search.extended(search.empty, whole, True)


def test_only_pieces_that_may_be_tried_are_looked_at(
    search: FeatureSearch, block: FeatureTree, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A small pocket explains less than a quarter of what a large one does: it waits for the next step."""
    of, volumes = search.candidates_of, []

    def candidates_of(piece: Manifold) -> list[Candidate]:
        volumes.append(piece.volume() / search.volume)
        return of(piece)

    monkeypatch.setattr(search, "candidates_of", candidates_of)
    first = search.step(block, ())
    assert first is not None
    assert min(volumes) > 0.1
    second = search.step(first, ())
    assert second is not None
    assert min(volumes) < 0.01
    assert second.score > 0.995


def test_bodies_of_a_step_are_made_once(search: FeatureSearch, block: FeatureTree) -> None:
    """Trees that are replayed have the same step after others."""
    (step,) = block.steps
    part, around, within = search.step_bodies(step)
    again = search.step_bodies(replace(step, score=0.5, objective=0.4))
    assert again[0] is part
    assert again[1] is around
    assert again[2] is within
    other = search.step_bodies(replace(step, part=replace(step.part, instances=(Similarity(),))))
    assert other[1] is not around


def test_a_solid_that_comes_with_holes_takes_nothing_of_what_is_there() -> None:
    """A plate with round edges around a boss, whose sharp hole is as wide as that: its place is before it."""
    settings = Settings.for_quality("draft")
    square = Profile.rectangle(32, 32, corner=2)
    plate = Part(Extrusion(square, 3, bottom_chamfer=0.5, top_chamfer=0.5), (0, 0, -1.5))
    boss, bore = Part(Cylinder(12, 6)), Part(Cylinder(7.5, 8))
    whole = Assembly((Assembly((plate, boss)), bore), "difference")
    shape = pw.load_shape(mesh_assembly(whole), unit="mm")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    own = candidates(search.body, search.frames, holes=True)
    ring = next(one for one in own if one.part.field.kind == "tube")
    tree = search.extended(search.empty, ring, True)
    rest = max(tree.missed.decompose(), key=lambda piece: piece.volume())
    drilled = [one for one in search.candidates_of(rest) if one.cuts]
    assert drilled
    gains = search.gains(tree, drilled, True)
    for candidate, gain in zip(drilled, gains, strict=True):
        both = search.extended(tree, candidate, True)
        assert both.score == search.score_of(both.at(search.points))
        assert both.objective - tree.objective == pytest.approx(gain, abs=1e-6)
    assert gains.max() > 0.3
    assert both.covered[tree.covered & search.inside].all()


def test_a_tree_may_be_the_further_behind_the_fewer_steps_it_has(block: FeatureTree) -> None:
    (step,) = block.steps

    def tree(*objectives: float) -> FeatureTree:
        steps = tuple(replace(step, objective=value) for value in objectives)
        return FeatureTree(score=objectives[-1], steps=steps)

    best = tree(0.5, 0.8, 0.9, 0.95)
    is_behind = FeatureSearch.is_behind
    assert not is_behind(tree(0.1, 0.2), best, 3)
    assert not is_behind(tree(0.1, 0.7, 0.85), best, 3)
    assert is_behind(tree(0.1, 0.7, 0.83), best, 3)
    assert not is_behind(tree(0.1, 0.7, 0.83), best, 4)
    assert is_behind(tree(0.1, 0.7, 0.85, 0.91), best, 3)
    assert is_behind(tree(0.1, 0.7, 0.85, 0.91, 0.915), best, 3)  # than the best in the end
