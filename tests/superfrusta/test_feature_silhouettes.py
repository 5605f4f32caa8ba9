"""A blank is cut from its outline where that is plainer, though no section of the shape has that outline."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from manifold3d import Manifold

import partwright as pw
from partwright.approximation.sketches.candidates import candidates, silhouettes
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Extrusion, Profile
from partwright.meshing import mesh_assembly
from partwright.superfrusta import feature_blanks
from partwright.superfrusta.feature_blanks import worth
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

BLANK = Part(Extrusion(Profile.rectangle(100, 60, corner=15), 40))
CUTS = (
    Part(Box((120, 20, 30)), (0, 0, 15)),
    Part(Box((24, 90, 26)), (10, 0, -13)),
    Part(Box((20, 90, 14)), (-44, 0, 20)),
    Part(Box((120, 14, 14)), (0, 30, -20)),
)


@pytest.fixture(scope="module")
def search() -> FeatureSearch:
    return searching()


def test_a_blank_with_cuts_is_a_silhouette_and_as_many_cuts(search: FeatureSearch) -> None:
    tree = search.run()
    assert tree is not None
    first, *cuts = tree.features
    assert len(cuts) <= len(CUTS)
    assert tree.score > 0.995
    sections = candidates(search.body, search.frames, holes=True)
    bounds = [one.part.bounds() for one in silhouettes(search.body, search.frames)]
    assert any(np.allclose(first.part.bounds(), box, atol=1e-4) for box in bounds)
    assert not any(first.part == one.part for one in sections)


def test_a_silhouette_is_what_is_seen_from_end_to_end() -> None:
    """Two bars that cross one above the other: a cross from above, which no section is."""
    bars = Manifold.cube((4, 1, 1), center=True) + Manifold.cube((1, 4, 1), center=True).translate((0, 0, 1))
    (cross,) = (one for one in silhouettes(bars, [np.eye(3)]))
    assert cross.volume == pytest.approx(7 * 2)
    assert cross.sides == 12
    assert cross.make(0.0).volume() == pytest.approx(7 * 2)
    apart = bars + Manifold.cube((1, 1, 1)).translate((9, 9, 0))
    assert silhouettes(apart, [np.eye(3)]) == []


def searching(**more: Callable[[FeatureTree], FeatureTree]) -> FeatureSearch:
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(mesh_assembly(Assembly((BLANK, *CUTS), "difference")), unit="mm")
    return FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha, **more)


def test_no_blank_is_taken_whose_tree_is_freeform_throughout() -> None:
    asked: list[FeatureTree] = []

    def mend(tree: FeatureTree) -> FeatureTree:
        asked.append(tree)
        odd = [replace(feature, freeform=len(asked) > 1) for feature in tree.features]
        return replace(tree, features=odd)

    drawn = searching(mend=mend).run()
    assert len(asked) > 1
    assert drawn is asked[0]
    assert worth(replace(asked[0], off=0.3)) == pytest.approx(asked[0].objective - 0.3)


@dataclass(frozen=True)
class Tree:
    """What is looked at of a tree, at prices of which a plain feature's is 0.01."""

    key: str
    objective: float
    off: float = 0.0
    freeform: int = 0
    price: float = 0.1
    score: float = 0.9

    @property
    def steps(self) -> list[Any]:
        return [SimpleNamespace(chosen=SimpleNamespace(key=self.key))] * 4

    @property
    def features(self) -> list[Any]:
        return [SimpleNamespace(freeform=i < self.freeform, parts=[]) for i in range(4)]


BEST = Tree("section", 0.8, off=0.02)


@pytest.mark.parametrize(
    ("rival", "is_taken"),
    [
        (Tree("blank", 0.82), True),
        (Tree("blank", 0.78), False),
        (Tree("blank", 0.95, off=0.03), False),
        (Tree("blank", 0.87, off=0.02, freeform=2), False),
        (Tree("blank", 0.91, off=0.02, freeform=2), True),
        (Tree("section", 0.95), False),
    ],
    ids=["better", "worse", "further off", "freeform", "worth its freeform", "the same steps"],
)
def test_a_tree_from_a_blank_is_taken_if_no_further_off_and_worth_its_freeform(
    rival: Tree, is_taken: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feature_blanks, "silhouettes", lambda *_: [SimpleNamespace(key="blank")])
    search: Any = SimpleNamespace(
        body=None, frames=[], empty=None, alpha=0.01, tie=0.001,
        gains=lambda *_: np.ones(1), extended=lambda *_: None, grown=lambda *_, **__: rival,
        ended=lambda tree, _: tree, mend=lambda tree: tree,
    )  # fmt: skip
    best: Any = BEST
    assert (feature_blanks.cut_from_blanks(search, best, [], []) is rival) == is_taken
    assert feature_blanks.cut_from_blanks(search, best, [], ["blank"]) is best  # it began with that already


@pytest.mark.heavy
def test_a_blank_that_is_worth_much_more_is_taken_with_its_freeform() -> None:
    """Two pieces of freeform ruled out a blank that was worth twenty features more."""
    asked: list[FeatureTree] = []

    def mend(tree: FeatureTree) -> FeatureTree:
        asked.append(tree)
        first, *rest = tree.features
        if len(asked) == 1:
            return replace(tree, off=0.3)
        return replace(tree, features=[first, *rest[:-1], replace(rest[-1], freeform=True)])

    drawn = searching(mend=mend).run()
    assert any(drawn is tree for tree in asked[1:])


@pytest.mark.heavy
def test_no_blank_is_taken_that_is_further_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """Paper-thin skins cost next to nothing of R, and reach as far as the blank does."""
    real, ended = FeatureSearch.ended, []

    def skinned(self: FeatureSearch, *given: Any) -> FeatureTree:
        ended.append(replace(real(self, *given), off=0.4 if ended else 0.0))
        return ended[-1]

    monkeypatch.setattr(FeatureSearch, "ended", skinned)
    assert searching().run() is ended[0]
    assert len(ended) > 1
