"""Where no feature explains a shape, its own form stands in steps, and nothing is far off."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import cast

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

import partwright as pw
from partwright.approximation.sketches.terraces import terraces
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Sphere
from partwright.meshing import mesh_assembly
from partwright.meshing.csg import solid_of
from partwright.methods import FitRequest
from partwright.superfrusta import feature_freeform
from partwright.superfrusta.far_places import Solid, far_places
from partwright.superfrusta.feature_assembly import FeatureAssembly
from partwright.superfrusta.feature_freeform import with_freeform
from partwright.superfrusta.feature_mending import FAR
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.featured import FeaturedFit, MendedSolids, freeform_warnings
from partwright.superfrusta.fit import _mended as chosen
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

# In the unit frame: centred, the longest side 1.8.
PLATE = Part(Box((1.8, 1.0, 0.2)))
LEFT, RIGHT = (Part(Sphere(0.2), (x, 0.1, 0.0)) for x in (-0.5, 0.5))
UP = np.eye(3)
MIDDLE = np.zeros((1, 3))


@cache
def search_of(whole: Assembly) -> FeatureSearch:
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(mesh_assembly(whole))
    return FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)


def mended(whole: Assembly, *parts: Part, most: int | None = None) -> tuple[FeatureTree, float, int]:
    """The tree of such parts, mended; how far it is off then, unit lengths; and its bodies."""
    search = search_of(whole)
    shape = pw.load_shape(mesh_assembly(whole))
    first = [Feature(True, part, np.zeros(0, bool), 4) for part in parts]
    made = FeatureAssembly(shape).in_unit_frame
    tree = with_freeform(search, search.scored(FeatureTree(first)), made, most)
    result = made(tree)
    other = Solid(solid_of(result, 1e-3), result.distance)
    places = far_places(Solid(search.body, search.samples.measure), other)
    return tree, max((place.off for place in places), default=0.0), other.count


def test_a_ball_is_a_few_steps_and_a_block_is_one() -> None:
    ball = Manifold.sphere(0.3, 64)
    parts = terraces(ball, UP, 0.05, 8, MIDDLE)
    assert parts is not None
    assert 3 <= len(parts) <= 8
    whole = solid_of(Assembly(tuple(parts)), 1e-4)
    assert whole.volume() == pytest.approx(ball.volume(), rel=0.15)
    points = Solid(whole, Sphere(0.3)).points()
    assert np.abs(np.linalg.norm(points, axis=1) - 0.3).max() < 2 * 0.05
    assert terraces(ball, UP, 0.05, 2, MIDDLE) is None
    assert terraces(Manifold(), UP, 0.05, 2, MIDDLE) is None
    two = Manifold.cube((1.0, 0.5, 0.3), True)
    two += two.translate((2.0, 0.0, 0.0))
    (block,) = terraces(two, UP, 0.05, 1, MIDDLE) or ()
    assert block.field == Box((1.0, 0.5, 0.3))


def test_two_bumps_are_one_freeform_and_its_copy() -> None:
    tree, off, bodies = mended(Assembly((PLATE, LEFT, RIGHT)), PLATE)
    fresh = tree.features[1:]
    assert fresh
    assert all(feature.freeform and feature.added for feature in fresh)
    assert any(len(feature.part.copies) > 1 for feature in fresh)
    shape = pw.load_shape(mesh_assembly(Assembly((PLATE, LEFT, RIGHT))), up="z")
    named = FeatureAssembly(shape).named(tree)
    assert "freeform_1" in [part.name for part in named.parts]
    (told,) = freeform_warnings(shape, named)
    assert "freeform_1 (middle)" in told  # of it and its copy
    assert off == tree.off == 0
    assert bodies == 1


def test_a_dent_is_cut() -> None:
    dent = Part(Sphere(0.15), (0.0, 0.0, 0.1))
    tree, off, _ = mended(Assembly((PLATE, dent), "difference"), PLATE)
    assert off == 0
    assert not any(feature.added for feature in tree.features[1:])


def test_a_hole_is_a_feature() -> None:
    hole = Part(Cylinder(0.12, 0.4), (0.4, 0.1, 0.0))
    tree, off, _ = mended(Assembly((PLATE, hole), "difference"), PLATE)
    (found,) = tree.features[1:]
    assert (off, found.added, found.freeform) == (0, False, False)
    assert isinstance(found.part.field, Cylinder)
    assert found.part.field.radius == pytest.approx(0.12, rel=1e-2)


def test_what_is_right_is_left_alone_and_the_budget_is_kept() -> None:
    tree, _, _ = mended(Assembly((PLATE, LEFT, RIGHT)), PLATE, LEFT, RIGHT)
    assert len(tree.features) == 3
    tree, off, _ = mended(Assembly((PLATE, LEFT, RIGHT)), PLATE, most=1)
    assert len(tree.features) == 1
    assert tree.off == pytest.approx(off)
    assert off > FAR


def test_pieces_that_hardly_float_are_joined() -> None:
    halves = [Part(Box((0.8995, 1.0, 0.2)), (x, 0.0, 0.0)) for x in (-0.45025, 0.45025)]
    tree, _, bodies = mended(Assembly((PLATE,)), *halves)
    assert bodies == 1
    assert len(tree.features) == 3


def test_two_places_side_by_side_do_not_hide_one_another() -> None:
    """Each is as far off as the other, so that neither is nearer where both are looked at."""
    posts = [Part(Box((0.1, 0.1, 0.2)), (x, 0.0, 0.15)) for x in (-0.095, 0.095)]
    lower = replace(PLATE, translation=(0.0, 0.0, -0.05))
    drawn = [replace(post, translation=(post.translation[0], 0.0, 0.1)) for post in posts]
    tree, off, _ = mended(Assembly((lower, *drawn)), lower)
    assert off == tree.off == 0
    tree, off, _ = mended(
        Assembly((lower,)),
        lower,
        *(replace(post, translation=(post.translation[0], 0, 0.1)) for post in posts),
    )
    assert off == tree.off == 0


def test_a_void_between_parts_is_filled() -> None:
    """Too narrow for its corners to have open space beside them, and deep within the shape."""
    block = Part(Box((1.8, 1.0, 0.8)))
    void = Part(Box((0.008, 0.2, 0.2)))
    whole = solid_of(Assembly((block, void), "difference"), 1e-3)
    distance = Assembly((block, void), "difference").distance
    shape = Solid(solid_of(block, 1e-3), block.distance)
    (place,) = far_places(shape, Solid(whole, distance))
    assert place.lacks
    assert place.off == pytest.approx(0.3, abs=1e-3)
    assert np.ptp(place.box, axis=0) == pytest.approx([0.008, 0.2, 0.2], abs=1e-6)
    assert far_places(Solid(whole, distance), Solid(whole, distance)) == []


def test_bodies_that_touch_along_an_edge_are_one() -> None:
    one, other = (Manifold.cube((1.0, 1.0, 1.0)).translate((x, x, 0.0)) for x in (0.0, 1.0))
    none = PLATE.distance
    assert Solid(one + other, none).count == 1
    assert Solid(one + other.translate((0.01, 0.0, 0.0)), none).count == 2


def test_the_more_of_a_shape_floats_the_more_may_joining_it_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arm of a knob, 9 % of it, floated for good, as what joins it costs more of R than a place may."""
    monkeypatch.setattr(feature_freeform, "_LOSS", -0.02)  # what joins has to gain as much, and does not
    for width, joined in ((0.8995, 1), (0.1995, 2)):
        sides = [(1.799 - width, -0.9 + (1.799 - width) / 2), (width, 0.9 - width / 2)]
        parts = [Part(Box((size, 1.0, 0.2)), (x, 0.0, 0.0)) for size, x in sides]
        _, _, bodies = mended(Assembly((PLATE,)), *parts)
        assert bodies == joined


def test_a_chip_that_a_cut_leaves_beside_the_shape_goes() -> None:
    """It is no part, so none can be dropped: its cut goes on in the open where the tree is made anew."""
    block = Part(Box((1.0, 0.4, 0.5)), (0.9, 0.0, 0.0))  # to x = 1.4
    cut = Part(Cylinder(0.4, 0.48), (1.14, 0.0, 0.0), (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0))  # 0.9 to 1.38
    whole = Assembly((Assembly((PLATE, block)), cut), "difference")
    drawn = Assembly((PLATE, Part(Box((0.5, 0.4, 0.5)), (0.65, 0.0, 0.0))))
    shape, settings = pw.load_shape(mesh_assembly(drawn)), Settings.for_quality("draft")
    fit = FeaturedFit(FitRequest(shape, settings), FitSamples.of(shape, settings), lambda: None)
    after = fit.mended_assembly(whole)
    assert (after.off, len(after.assembly.parts)) == (0, 3)
    assert mesh_assembly(whole).body_count == 2
    assert mesh_assembly(after.assembly).body_count == 1
    right = fit.mended_assembly(drawn)
    assert (right.assembly, right.off) == (drawn, 0.0)
    assert min(right.score, after.score) > 0.99


def test_solids_that_are_right_keep_their_own_deviation() -> None:
    """The parts made anew are one chain, so that the block's cut goes through the plate as well; there is no
    room for what would fill it."""
    block = Part(Box((0.5, 0.5, 0.5)), (0.0, 0.0, 0.3))
    cut = Part(Box((0.3, 0.3, 1.0)), (0.0, 0.0, 0.3))
    cuts = [Assembly((part, hole), "difference") for part, hole in ((PLATE, LEFT), (block, cut))]
    whole = Assembly(tuple(cuts))
    shape, settings = pw.load_shape(mesh_assembly(whole)), Settings.for_quality("draft", max_parts=4)
    fit = FeaturedFit(FitRequest(shape, settings), FitSamples.of(shape, settings), lambda: None)
    mended = fit.mended_assembly(whole)
    assert (mended.assembly, mended.off) == (whole, 0.0)


@pytest.mark.parametrize(
    ("freeform", "off", "score", "parts", "drawn"),
    [
        (2, 0.0, 0.90, 3, False),
        (2, 0.0, 0.90, 4, True),  # no fewer parts
        (2, 0.0, 0.89, 3, True),  # explains less
        (2, 0.1, 0.90, 3, True),  # is far off
        (0, 0.0, 0.95, 3, True),  # the features are all drawn
        (0, 0.0, 0.95, 2, False),  # but are twice as many
        (0, 0.0, 0.89, 2, True),
    ],
)
def test_fewer_solids_that_explain_as_much_are_preferred_to_freeform(
    freeform: int, off: float, score: float, parts: int, drawn: bool
) -> None:
    own, found = (Assembly(tuple(replace(PLATE, name=f"{k}") for k in range(n))) for n in (4, parts))
    features = [Feature(True, PLATE, np.zeros(0, bool), 0, freeform=k < freeform) for k in range(4)]
    tree = FeatureTree(features, score=0.90, price=0.02)

    class Fit:
        """Of features that come near with their freeform."""

        def mended(self, tree: FeatureTree) -> FeatureTree:
            return tree

        def assembly(self, tree: FeatureTree) -> Assembly:
            return own

        def may_explain(self, whole: Assembly, least: float) -> bool:
            return score >= least

        def mended_assembly(self, whole: Assembly) -> MendedSolids:
            assert score >= 0.90, "what cannot explain as much is not mended"
            return MendedSolids(whole, off, score)

    whole, preferred = chosen(cast(FeaturedFit, Fit()), tree, found, 0.80)
    assert (whole, preferred) == ((own, True) if drawn else (found, False))


def test_what_solids_may_explain_is_known_before_they_are_mended() -> None:
    """A block that stands out far may be mended; a plate that is a little too thick may not."""
    block = Part(Box((0.3, 0.3, 0.3)), (0.5, 0.2, 0.2))
    drawn = Assembly((PLATE, block))
    shape, settings = pw.load_shape(mesh_assembly(drawn)), Settings.for_quality("draft")
    fit = FeaturedFit(FitRequest(shape, settings), FitSamples.of(shape, settings), lambda: None)
    lacking = Assembly((PLATE,))
    after = fit.mended_assembly(lacking).score
    assert after > 0.98
    assert fit.may_explain(lacking, after)
    thicker = Assembly((Part(Box((1.8, 1.0, 0.26))),))
    assert fit.mended_assembly(thicker).score < 0.95
    assert not fit.may_explain(thicker, 0.95)


@pytest.mark.heavy
def test_a_fit_names_what_is_freeform(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(3, 1.0)
    ball.apply_scale((12.0, 7.0, 9.0))
    ball.apply_transform(trimesh.transformations.rotation_matrix(0.5, (1, 2, 3), (0, 0, 0)))
    ball.apply_translation((15.0, 3.0, 8.0))
    block = trimesh.creation.box((80.0, 50.0, 20.0))
    both = trimesh.boolean.union([block, ball], engine="manifold")
    result = pw.fit(pw.load_shape(both, unit="mm"), "solids", quality="draft")
    assert result.report["scores"]["max_deviation_share"] < 0.03
    assert "freeform_1" in [part.name for part in result.assembly.parts]
    assert any(re.search(r"freeform_1 \((back )?upper right\)", line) for line in result.report["warnings"])
    result.assembly.save(tmp_path / "part.json")
    assert pw.load_assembly(tmp_path / "part.json") == result.assembly
    pw.export(result.assembly, tmp_path / "part.scad")
    assert "freeform_1_height" in (tmp_path / "part.scad").read_text("utf-8")
