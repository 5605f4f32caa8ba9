"""Parts as one would draw them: a plain body, what is cut from it, each pattern once."""

from __future__ import annotations

import math

import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Field, Profile, Revolution, Tube
from partwright.meshing import mesh_assembly
from partwright.superfrusta import feature_search
from partwright.superfrusta.feature_assembly import FeatureAssembly
from partwright.superfrusta.feature_copying import with_copies
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import FeatureTree
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings


def at(field: Field, *places: tuple[float, float, float]) -> Part:
    """A part with a copy at each further place."""
    moves = tuple(
        Similarity(translation=tuple(b - a for a, b in zip(places[0], place, strict=True)))
        for place in places[1:]
    )
    return Part(field, places[0], instances=moves)


def found(drawn: Assembly, quality: str = "draft") -> tuple[FeatureTree, FeatureSearch]:
    settings = Settings.for_quality(quality)
    shape = pw.load_shape(mesh_assembly(drawn), unit="mm")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    tree = search.run()
    assert tree is not None
    return tree, search


def kinds(tree: FeatureTree) -> list[tuple[bool, str, int]]:
    return [(f.added, f.part.field.kind, sum(len(part.copies) for part in f.parts)) for f in tree.features]


def test_a_plate_with_pockets_and_holes_is_a_box_and_two_patterns() -> None:
    """And not a groove from end to end with a plate in it, which is as few features, but with 72 sides."""
    pockets = at(
        Extrusion(Profile.regular(8, 14), 8), *((x, y, 10.0) for x in (-40, 0, 40) for y in (-20, 20))
    )
    holes = at(Cylinder(2.75, 20), *((x, y, 5.0) for x in (-54, 54) for y in (-34, 34)))
    drawn = Assembly((Part(Box((120, 80, 10)), (0, 0, 5)), pockets, holes), "difference")
    tree, search = found(drawn)
    assert tree.score > 0.998
    whole = FeatureAssembly(pw.load_shape(mesh_assembly(drawn), unit="mm")).named(tree)
    fields = sorted((part.field.kind, len(part.copies)) for part in whole.parts)
    assert fields == [("box", 1), ("cylinder", 4), ("extrusion", 6)]
    assert tree.price < 3.3 * search.alpha


def test_a_box_that_is_hollowed_is_a_box_and_its_hollow() -> None:
    """Walls with a row of vents and posts within: not two ends, a gutter and a comb."""
    drawn = Assembly(
        (
            Assembly(
                (
                    Part(Box((100, 60, 30)), (0, 0, 15)),
                    Part(Box((96, 56, 40)), (0, 0, 22)),
                    at(Box((3, 10, 16)), *((-28 + 8 * k, -30, 16) for k in range(8))),
                    Part(Box((10, 12, 8)), (50, 0, 12)),
                ),
                "difference",
            ),
            at(Tube(4, 2.75, 8), *((x, y, 6) for x in (-42, 42) for y in (-22, 22))),
        )
    )
    tree, search = found(drawn)
    assert kinds(tree)[:2] == [(True, "box", 1), (False, "box", 1)]
    assert (False, "box", 8) in kinds(tree)
    assert len(tree.features) == 5
    assert tree.price < 5.5 * search.alpha


def test_small_holes_that_pay_only_together_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four in the base of a heat sink: each is an eighth of a percent of it."""
    fins = at(Box((1.6, 40, 18)), *((-27.5 + 5.5 * i, 0, 13) for i in range(11)))
    holes = at(Cylinder(1.6, 8), *((x, y, 2) for x in (-24.75, 24.75) for y in (-14, 14)))
    drawn = Assembly((Assembly((Part(Box((60, 40, 4)), (0, 0, 2)), fins)), holes), "difference")
    tree, search = found(drawn, "normal")
    assert kinds(tree)[-1] == (False, "cylinder", 4)
    assert len(tree.features) == 2
    assert tree.score > 0.998
    plain = search.extended(search.empty, tree.steps[0].chosen, True)
    assert len(search.with_patterns(plain).features) == 2
    monkeypatch.setattr(feature_search, "with_copies", lambda *asked: with_copies(*asked[:4]))
    search.turns, search.mirrors = [], []
    assert search.with_patterns(plain) is plain  # where no copies are found, one alone does not pay


def test_a_hinge_is_an_outline_with_gaps_and_countersunk_holes() -> None:
    """The gaps run along the barrel's own wall, and leave no skin of it."""
    turn = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    whole = Assembly((Part(Box((60, 32, 3)), (0, 1, 1.5)), Part(Cylinder(4, 60), (0, 17, 4), turn)))
    sunk = Revolution(Profile([(0, -1), (2, -1), (2, 1), (4, 3), (4, 3.5), (0, 3.5)]))
    cuts = (
        Part(Cylinder(2, 62), (0, 17, 4), turn),
        at(Box((12.4, 12, 20)), (-12, 19, 4), (12, 19, 4)),
        at(sunk, *((float(x), float(y), 0.0) for x in (-22, 0, 22) for y in (-6, 8))),
    )
    tree, _ = found(Assembly((whole, *cuts), "difference"))
    assert tree.off == 0.0
    assert len(tree.features) == 3
    assert [kind[1:] for kind in kinds(tree)][:2] == [("extrusion", 1), ("extrusion", 2)]
