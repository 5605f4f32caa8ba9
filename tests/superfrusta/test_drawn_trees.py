"""Parts as one would draw them: a plain body, what is cut from it, each pattern once."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

import partwright as pw
from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.candidates import candidates
from partwright.assembly import Assembly, Part, Similarity, ring
from partwright.fields import Box, Cylinder, Extrusion, Field, Profile, Revolution, Tube
from partwright.fields.profile import circle
from partwright.meshing import mesh_assembly
from partwright.meshing.csg import mesh_csg, solid_of
from partwright.superfrusta import feature_search
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_boxes import with_whole_boxes
from partwright.superfrusta.feature_copying import with_copies
from partwright.superfrusta.feature_linings import lines_a_hole
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree, covers
from partwright.superfrusta.feature_teeth import with_teeth_apart
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings
from tests.superfrusta.trees import kinds


def at(field: Field, *places: tuple[float, float, float]) -> Part:
    """A part with a copy at each further place."""
    moves = tuple(
        Similarity(translation=tuple(b - a for a, b in zip(places[0], place, strict=True)))
        for place in places[1:]
    )
    return Part(field, places[0], instances=moves)


def found(drawn: Assembly | trimesh.Trimesh, quality: str = "draft") -> tuple[FeatureTree, FeatureSearch]:
    settings = Settings.for_quality(quality)
    shape = pw.load_shape(mesh_assembly(drawn) if isinstance(drawn, Assembly) else drawn, unit="mm")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    tree = search.run()
    assert tree is not None
    return tree, search


@pytest.mark.parametrize("count", [3, 8, pytest.param(16, marks=pytest.mark.heavy)])
def test_a_flange_is_turned_and_drilled(count: int) -> None:
    """With eight holes, too, through which all of eight half sections go that are as far apart."""
    section = [(10, 0), (40, 0), (40, 8), (15, 8), (15, 30), (10, 30)]
    holes = Part(Cylinder(2, 20), (30, 0, 4), instances=ring(count))
    tree, _ = found(Assembly((Part(Revolution(Profile.polygon(section))), holes), "difference"))
    assert kinds(tree) == [(True, "revolution", 1), (False, "cylinder", count)]


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


@pytest.mark.heavy
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
    shape = pw.load_shape(mesh_assembly(drawn), unit="mm")
    assert [
        len(p.copies) for p in FeatureAssembly(shape).named(tree).parts if p.field.kind == "cylinder"
    ] == [4]
    assert len(tree.features) <= 3
    assert tree.score > 0.998
    own = candidates(search.body, search.frames, holes=True)
    outline = own[int(search.gains(search.empty, own, True).argmax())]
    plain = search.extended(search.empty, outline, True)
    assert kinds(search.with_patterns(plain)) == [(True, "extrusion", 1), (False, "cylinder", 4)]
    monkeypatch.setattr(feature_search, "with_copies", lambda *asked: with_copies(*asked[:4]))
    search.turns, search.mirrors = [], []
    assert search.with_patterns(plain) is plain  # where no copies are found, one alone does not pay


@pytest.mark.heavy
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


def test_a_chamfered_block_with_holes_into_a_gallery_is_a_block_and_its_holes() -> None:
    """No section of it is the whole block: the gallery splits one in two, and the rim is at its top."""
    block = Part(Extrusion(Profile.rectangle(60, 30), 25, top_chamfer=3))
    gallery = Part(Cylinder(4, 50), (-7.5, 0, 0), (math.sqrt(0.5), 0, math.sqrt(0.5), 0))
    holes = at(Cylinder(3, 14), *((x, 0.0, 7.0) for x in (-15, 0, 10)))
    tree, _ = found(Assembly((block, gallery, holes), "difference"))
    assert sorted(kinds(tree)) == [(False, "cylinder", 1), (False, "cylinder", 3), (True, "extrusion", 1)]
    assert tree.features[0].part.field.rims[1].chamfer == pytest.approx(0.09, rel=0.02)
    assert tree.off == 0
    assert tree.score > 0.99


def test_pipes_that_meet_are_pipes_and_their_bores() -> None:
    """Where they meet no section is either; the bore of one is cut again, as the other reaches into it."""
    across = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    pipes = Assembly((Part(Cylinder(12, 80), (0, 0, 0), across), Part(Cylinder(12, 40), (0, 0, 20))))
    flanges = (
        at(Cylinder(22, 5), (0, 0, 37.5)),
        Part(Cylinder(22, 5), (-37.5, 0, 0), across, instances=(Similarity(translation=(75, 0, 0)),)),
    )
    bores = Part(Cylinder(9, 82), (0, 0, 0), across), Part(Cylinder(9, 42), (0, 0, 21))
    tree, _ = found(Assembly((Assembly((pipes, *flanges)), *bores), "difference"))
    assert tree.score > 0.99
    assert tree.off == 0
    assert len(tree.features) <= 5
    assert {field.kind for field in (f.part.field for f in tree.features)} <= {
        "cylinder",
        "tube",
        "revolution",
    }


@pytest.mark.heavy
def test_a_lid_is_a_rounded_block_its_hollow_and_its_vents() -> None:
    """Vents that are cut first are no islands of the hollow below them, posts are; arcs in many short chords
    are arcs, so that vents are alike."""
    arc = math.tan(math.pi / 8)

    def rounded(x: float, y: float, r: float) -> Profile:
        left = [(x, y - r, arc), (x - r, y, 0), (r - x, y, arc), (-x, y - r, 0)]
        return Profile([*left, (-x, r - y, arc), (r - x, -y, 0), (x - r, -y, arc), (x, r - y, 0)])

    vent = Profile([(1.25, -9, 0), (1.25, 9, 1), (-1.25, 9, 0), (-1.25, -9, 1)])
    places = [(float(x), float(y)) for x in (-28, 28) for y in (-18, 18)]
    block = Part(Extrusion(rounded(35, 25, 6), 10, top_fillet=2), (0, 0, 5))
    hollow = Part(Extrusion(rounded(33, 23, 4), 8), (0, 0, 3))
    shell = Assembly((block, hollow), "difference")
    posts = at(Cylinder(4, 8), *((x, y, 4.0) for x, y in places))
    cuts = (
        at(Cylinder(1.6, 12), *((x, y, 5.0) for x, y in places)),
        at(Extrusion(vent, 6), *((6.0 * k - 15, 0.0, 9.0) for k in range(6))),
    )
    tree, _ = found(mesh_csg(Assembly((Assembly((shell, posts)), *cuts), "difference"), 3e-3))
    assert kinds(tree)[1:3] == [(False, "cylinder", 4), (False, "extrusion", 6)]
    assert tree.features[0].part.field.rims[1].fillet > 0
    assert len(tree.features) == 4
    assert tree.off == 0


def test_a_hexagonal_bar_is_extruded_along_itself() -> None:
    """Its ends are too small to say which way that is: its sides do."""
    bar = Part(Extrusion(Profile.regular(6, 3), 100))
    tree, _ = found(Assembly((bar, Part(Cylinder(1, 8), (0, 0, 20), (math.sqrt(0.5), math.sqrt(0.5), 0, 0)))))
    assert kinds(tree)[0] == (True, "extrusion", 1)
    assert tree.features[0].sides == 6
    assert tree.score > 0.99


def test_a_housing_with_a_port_is_no_blank_with_corners_put_back() -> None:
    """Which has fewer sides by one, and is as good."""
    walls, cavity = Profile.rectangle(87.5, 50.5, 13), Profile.rectangle(77.5, 40.5, 8)
    port = Part(Cylinder(6.5, 15), (0, 22.75, 19), (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0))
    corners = [(x, y, 3.25) for x in (28.75, -28.75) for y in (12.25, -12.25)]
    cuts = Part(Extrusion(cavity, 30), (0, 0, 21.5)), at(Cylinder(2.75, 16.5), *corners), port
    tree, _ = found(Assembly((Part(Extrusion(walls, 31.5), (0, 0, 15.75)), *cuts), "difference"))
    assert (False, "cylinder", 1) in kinds(tree)
    assert len(tree.features) == 3
    assert tree.score > 0.99


def test_a_bent_hexagonal_key_is_its_legs_and_its_bend() -> None:
    """Each leg ends where its walls do, not where it would leave the bend."""
    outline = Profile.regular(6, 3)
    along_x, upright = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0), (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))
    bend = Revolution(outline.moved((8.0, 0.0)), 90)
    legs = Part(Extrusion(outline, 60), (0, 0, -30)), Part(Extrusion(outline, 22), (19, 0, 8), along_x)
    tree, _ = found(Assembly((*legs, Part(bend, (8, 0, 0), upright))))
    assert sorted(kinds(tree)) == [(True, "extrusion", 1), (True, "extrusion", 1), (True, "revolution", 1)]
    assert tree.score > 0.998


def test_a_bolt_is_its_shaft_and_its_head() -> None:
    """A disc about as wide as the head explains more than the shaft alone, before the head is there."""
    head = Part(Extrusion(Profile.regular(6, 9.8), 6.4), (0, 0, 18.2))
    tree, _ = found(Assembly((Part(Cylinder(5, 30)), head)))
    assert kinds(tree) == [(True, "cylinder", 1), (True, "extrusion", 1)]
    assert tree.score > 0.99


def test_a_ring_in_a_hole_is_no_body_and_a_hollow_post_is() -> None:
    """A counterbore, and not a wide hole that a ring makes narrower."""
    ring, post = Part(Tube(0.16, 0.08, 0.1), (-0.36, 0, -0.05)), Part(Tube(0.12, 0.04, 0.4), (0.4, 0, 0.3))
    turned = Revolution(Profile([(0.08, -0.05), (0.16, -0.05), (0.16, 0.05), (0.08, 0.05)]))
    bored = (
        Part(Box((1.4, 0.6, 0.2))),
        Part(Cylinder(0.16, 0.4), (-0.36, 0, 0.2)),
        Part(Cylinder(0.08, 0.6), (-0.36, 0, 0)),
    )
    shape = Assembly((Assembly(bored, "difference"), post))
    assert lines_a_hole(ring, shape.distance)
    assert lines_a_hole(Part(turned, ring.translation), shape.distance)
    assert lines_a_hole(Part(Extrusion(Profile.rectangle(0.3, 0.3), 0.1)), shape.distance) is False
    assert not lines_a_hole(post, shape.distance)
    plate = Profile(Profile.rectangle(1.4, 0.6).outline, (circle(0.16, (-0.36, 0.0)),))
    assert not lines_a_hole(Part(Extrusion(plate, 0.2)), shape.distance)


def test_a_slot_in_a_bent_plate_is_a_slot() -> None:
    """And not the end of one of two plates."""
    bent = Extrusion(Profile([(0, 0), (60, 0), (60, 4), (12, 4), (40, 70), (36, 72), (8, 4), (0, 4)]), 50)
    slot = Profile([(15, -6, 0), (15, 6, 1), (-15, 6, 0), (-15, -6, 1)][::1])
    upright = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    cut = Part(Extrusion(slot, 6), (35, 0, 2), (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)))
    tree, _ = found(Assembly((Part(bent, (0, 0, 0), upright), cut), "difference"))
    assert [added for added, _, _ in kinds(tree)] == [True, False]
    assert tree.score > 0.99


def test_of_trees_the_one_that_is_near_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Though another explains a little more: it is far off where nothing mends it."""
    shape = pw.load_shape(trimesh.creation.box((1, 1, 1)))
    settings = Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    far, near = FeatureTree(score=0.99), FeatureTree(score=0.98)
    monkeypatch.setattr(search, "ended", lambda tree, _: replace(tree, off=0.2 if tree is far else 0.0))
    assert search._nearest([near, far], ()) == near
    monkeypatch.setattr(search, "ended", lambda tree, _: tree)
    assert search._nearest([near, far], ()) is far


def test_a_gear_is_a_disc_and_one_gap_again_and_again() -> None:
    """And not an outline of 96 sides; the tree is as near to the shape."""
    step = 2 * math.pi / 24
    corners = [
        (radius * math.cos(k * step + a), radius * math.sin(k * step + a), math.tan(sweep / 4))
        for k in range(24)
        for radius, a, sweep in ((18, -0.09, 0.18), (18, 0.09, 0), (21, 0.11, 0.05), (21, 0.16, 0))
    ]
    wheel = Part(Extrusion(Profile(tuple(corners), (circle(5),)), 10))
    drawn = Assembly((wheel, Part(Tube(9, 4, 18), (0, 0, 4))))
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    none = np.zeros(0, bool)
    parts = in_unit_frame(shape, drawn).parts
    tree = FeatureTree([Feature(True, parts[0], none, 98), Feature(True, parts[1], none, 4)])
    before = search.scored(tree)
    after = with_teeth_apart(search, tree)
    assert {kind for _, kind, count in kinds(after) if count == 24} == {"extrusion"}
    assert len(after.features) == len(tree.features) + 1
    assert max(feature.sides for feature in after.features) <= 8
    assert after.score > before.score - 2e-4
    assert after.objective > before.objective


def test_teeth_on_a_shaft_stand_on_it() -> None:
    """The disc at their roots goes where another body is there already."""
    teeth = Profile(
        tuple(
            (math.hypot(x, y) * math.cos(a), math.hypot(x, y) * math.sin(a), 0.0)
            for k in range(12)
            for x, y in ((10, -1.5), (12, -1.5), (12, 1.5), (10, 1.5))
            for a in [k * math.pi / 6 + math.atan2(y, x)]
        )
    )
    drawn = Assembly((Part(Cylinder(math.hypot(10, 1.5), 50)), Part(Extrusion(teeth, 20), (0, 0, 5))))
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    none = np.zeros(0, bool)
    parts = in_unit_frame(shape, drawn).parts
    tree = FeatureTree([Feature(True, parts[0], none, 2), Feature(True, parts[1], none, 48)])
    assert kinds(with_teeth_apart(search, tree)) == [(True, "cylinder", 1), (True, "box", 12)]


def test_an_engraved_scale_is_a_disc_with_slots() -> None:
    """And not a disc, a lower one on it, and on that what stands between the slots."""
    step, half = 2 * math.pi / 24, math.asin(0.4 / 18)
    scale = Profile(
        tuple(
            (radius * math.cos(k * step + a), radius * math.sin(k * step + a), bulge)
            for k in range(24)
            for radius, a, bulge in (
                (15, half * 18 / 15, 0),
                (18, half, math.tan((step - 2 * half) / 4)),
                (18, step - half, 0),
                (15, step - half * 18 / 15, 0),
            )
        ),
        (circle(3),),
    )
    drawn = Assembly((Part(Tube(18, 15, 7), (0, 0, 3.5)), Part(Extrusion(scale, 1), (0, 0, 7.5))))
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    none = np.zeros(0, bool)
    parts = in_unit_frame(shape, drawn).parts
    features = [Feature(True, parts[0], none, 4), Feature(True, parts[1], none, 98)]
    for order in (features, features[::-1]):
        whole, slot = with_teeth_apart(search, FeatureTree(order)).features
        assert (whole.added, whole.part.field.kind) == (True, "tube")
        assert whole.part.field.height * 18 / 0.9 == pytest.approx(8, abs=1e-3)
        assert (slot.added, len(slot.part.copies), slot.sides) == (False, 24, 4)


def test_four_holes_that_are_seen_by_twos_are_one_grid() -> None:
    """A mirror plane shows one of the others, a candidate that is like it the second: the third is where both
    lead to, and no mirror image of three of them, which would have two of them twice."""
    holes = at(Cylinder(3, 12), *((x, y, 0.0) for x in (0.0, 40.0) for y in (-15.0, 15.0)))
    drawn = Assembly((Part(Box((120, 60, 10))), holes), "difference")
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    plate, hole = in_unit_frame(shape, drawn).parts
    covered = covers(plate, search.points)
    tree = FeatureTree(covered=covered, score=search.score_of(covered))
    (first, _, along, _) = (
        Candidate(copy, partial(_body, copy), 2, float(_body(copy).volume())) for copy in hole.copies
    )
    step = with_copies(search, tree, first, False, (), (along,))
    assert step.image is None
    assert len(step.part.copies) == 4
    assert step.score > 0.999


def _body(part: Part, further: float = 0.0) -> Manifold:
    return solid_of(part, 1e-3)


def test_a_heat_sink_is_a_plate_with_a_row_of_fins() -> None:
    """Whatever it was read as: two combs, and a bar between them. The plate is one box."""
    comb = [(30.0, 0.0), (30.0, 5.0)]
    for k in range(9):
        comb += [(x - 6 * k, y) for x, y in ((25.0, 5.0), (25.0, 25.0), (23.0, 25.0), (23.0, 5.0))]
    outline = Extrusion(Profile.polygon([*comb, (-30, 5), (-30, 0)]), 24)
    turn = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)
    combs = Part(outline, (0, 18, 0), turn, instances=(Similarity(translation=(0, -36, 0)),))
    bored = Profile(Profile.rectangle(60, 12).outline, (circle(2, (-25, 0)), circle(2, (25, 0))))
    drawn = Assembly((combs, Part(Extrusion(bored, 5), (0, 0, 2.5))))
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    none = np.zeros(0, bool)
    features = [Feature(True, part, none, 40) for part in in_unit_frame(shape, drawn).parts]
    tree = with_whole_boxes(with_teeth_apart(search, FeatureTree(features)), search.points)
    assert kinds(tree) == [(True, "box", 1), (False, "cylinder", 2), (True, "box", 18)]
    plate, _, fin = (np.array(f.part.field.bounds()[1]) * 60 / 0.9 for f in tree.features)
    assert sorted(plate) == pytest.approx([5, 60, 60], abs=1e-3)
    assert sorted(fin) == pytest.approx([2, 21, 24], abs=1e-3)
    assert [part.name for part in FeatureAssembly(shape).named(tree).parts] == [
        "base_plate",
        "bolt_hole",
        "fin",
    ]
    assert search.scored(tree).score > 0.998
