"""A hole and the wider one above it on its axis are one counterbored hole."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.editing import with_numbers
from partwright.assembly.numbers import numbers_of
from partwright.cleaning import clean
from partwright.fields import Box, Cylinder, Extrusion, Frustum
from partwright.fields.profile import Profile, circle
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_stepped_holes import with_stepped_holes
from partwright.superfrusta.feature_steps import Feature, FeatureTree

PLATE = Part(Box((120.0, 80.0, 10.0)))
MOVES = tuple(Similarity(translation=(x, y, 0.0)) for x, y in ((80, 0), (0, 50), (80, 50)))
HOLES = Part(Cylinder(3.3, 12.0), (-40.0, -25.0, 0.0), instances=MOVES)
WIDE = Part(Cylinder(5.5, 6.0), (-40.0, -25.0, 3.0), instances=MOVES)  # 5 mm deep
OVER = Similarity(rotation=(0.0, 1.0, 0.0, 0.0))
TURN = Similarity(rotation=(0.9, 0.3, 0.1, 0.2), translation=(30.0, 20.0, 70.0))


def made(
    *cuts: Part, body: Part = PLATE, turn: Similarity | None = None, seen: Sequence[Part] = ()
) -> tuple[Assembly, Assembly]:
    """A body with cuts, as it was drawn, and what is made of the features that these are. seen: cuts that are
    no features."""
    turn = turn or Similarity()
    parts = [part.transformed(turn) for part in (body, *cuts)]
    drawn = Assembly((*parts, *seen), operation="difference")
    shape = pw.load_shape(mesh_assembly(drawn), unit="mm")
    own = in_unit_frame(shape, Assembly(tuple(parts))).parts
    features = [Feature(k == 0, part, np.zeros(0, bool), 4) for k, part in enumerate(own)]
    return drawn, FeatureAssembly(shape).named(FeatureTree(features))


def counts(whole: Assembly) -> dict[str, int]:
    return {part.name: len(part.copies) for part in whole.parts}


def diameters(part: Part) -> Sequence[float]:
    return sorted(v for name, v in numbers_of(part).items() if "diameter" in name)


@pytest.mark.parametrize("turn", [None, TURN])
def test_both_are_one_with_both_diameters_and_the_depth(turn: Similarity | None) -> None:
    drawn, whole = made(HOLES, WIDE, turn=turn)
    _, hole = whole.parts
    assert (hole.name, len(hole.copies)) == ("counterbored_hole", 4)
    assert np.unique(np.round(diameters(hole), 2)) == pytest.approx([6.6, 11.0], abs=0.02)
    assert mesh_assembly(whole).volume == pytest.approx(mesh_assembly(drawn).volume, rel=1e-4)


def test_holes_of_an_outline_are_joined_with_cuts() -> None:
    circles = tuple(circle(3.3, centre) for centre in ((-40, -25), (40, -25), (-40, 25), (40, 25)))
    body = Part(Extrusion(Profile(Profile.rectangle(120.0, 80.0).outline, circles), 10.0))
    _, whole = made(WIDE, body=body)
    assert counts(whole) == {"base_plate": 1, "counterbored_hole": 4}


def test_some_of_a_pattern_from_either_side() -> None:
    """Two have a counterbore above, one below: these are copies, one of them upside down."""
    above = Part(Cylinder(5.5, 6.0), (-40.0, -25.0, 3.0), instances=MOVES[:1])
    below = Part(Cylinder(5.5, 6.0), (-40.0, 25.0, -3.0))
    drawn, whole = made(HOLES, above, below)
    assert counts(whole) == {"base_plate": 1, "counterbored_hole": 3, "hole": 1}
    assert mesh_assembly(whole).volume == pytest.approx(mesh_assembly(drawn).volume, rel=1e-4)


def test_one_step_after_another_and_from_both_ends() -> None:
    one = Part(Cylinder(3.3, 12.0))
    steps = [Part(Cylinder(r, 2 * depth), (0.0, 0.0, 5.0)) for r, depth in ((5.5, 5.0), (7.5, 2.0))]
    under = Part(Cylinder(5.0, 4.0), (0.0, 0.0, -5.0))
    drawn, whole = made(one, *steps, under)
    assert counts(whole) == {"base_plate": 1, "counterbored_hole": 1}
    assert mesh_assembly(whole).volume == pytest.approx(mesh_assembly(drawn).volume, rel=1e-4)
    assert whole["counterbored_hole"].bounds()[1, 2] < 10, "what is narrower goes on in the open"


def test_a_chamfer_of_either_cut_is_part_of_the_hole() -> None:
    """That the mesh shows: one where the wide hole opens, and one below it in its floor, none is drawn."""
    rim = Part(Frustum(5.5, 6.5, 1.0), (0.0, 0.0, 4.5))
    floor = Part(Frustum(3.3, 4.3, 1.0), (0.0, 0.0, -0.5))
    drawn = (Part(Cylinder(3.3, 12.0)), Part(Cylinder(5.5, 6.0), (0.0, 0.0, 3.0)))
    cut, whole = made(*drawn, seen=(rim, floor))
    (_, hole) = whole.parts
    assert hole.name == "counterbored_hole"
    assert np.unique(np.round(diameters(hole), 1)) == pytest.approx([6.6, 8.6, 11.0, 13.0], abs=0.15)
    assert mesh_assembly(whole).volume == pytest.approx(mesh_assembly(cut).volume, rel=1e-4)


def test_hundreds_of_holes_are_looked_at_in_no_time() -> None:
    moves = tuple(Similarity(translation=(0.01 * (k % 40), 0.01 * (k // 40), 0.0)) for k in range(1, 800))
    holes = [Part(Cylinder(r, 0.1), (0.5 * r, 0.0, 0.0), instances=moves) for r in (0.002, 0.0045)]
    started = time.process_time()
    assert with_stepped_holes(holes, lambda points: np.ones(len(points), np.float32)) == holes
    assert time.process_time() - started < 2


@pytest.mark.parametrize(
    "cuts",
    [
        (Part(Cylinder(3.3, 12.0)), Part(Cylinder(5.5, 6.0), (1.0, 0.0, 3.0))),  # beside the axis
        (Part(Cylinder(3.3, 12.0)), Part(Cylinder(15.0, 6.0), (0.0, 0.0, 3.0))),  # a pocket with a hole
        (Part(Cylinder(3.3, 12.0)), Part(Cylinder(5.5, 4.0))),  # wide within: nothing drills that
        (HOLES, Part(Cylinder(5.5, 6.0), (-40.0, -25.0, 3.0)), Part(Box((8, 8, 20)), (20, 0, 0))),
    ],
    ids=["aside", "pocket", "within", "one of four"],
)
def test_others_stay_as_they_are(cuts: tuple[Part, ...]) -> None:
    _, whole = made(*cuts)
    assert len(whole.parts) == 1 + len(cuts)


def test_both_diameters_and_the_depth_are_edited() -> None:
    _, whole = made(HOLES, WIDE)
    wide = {"counterbored_hole.profile.diameter.1": 9.0, "counterbored_hole.profile.diameter.2": 15.0}
    own = with_numbers(whole, wide | {"counterbored_hole.profile.y.2": 2.0}).assembly
    for radius, heights in ((4.4, (-4.9, 1.9)), (7.4, (2.1, 4.9))):
        assert (own.distance(np.array([(radius + 40, 25.0, z) for z in heights])) > 0).all()
        assert (own.distance(np.array([(radius + 40.2, 25.0, z) for z in heights])) < 0).all()
    assert (own.distance(np.array([(47.4, 25.0, 1.9)])) < 0).all()


def test_its_diameters_become_those_of_standard_holes() -> None:
    """A clearance hole for M6, measured 0.02 mm too narrow."""
    _, whole = made(Part(Cylinder(3.29, 12.0)), Part(Cylinder(5.49, 6.0), (0.0, 0.0, 3.0)))
    cleaned = clean(whole, tolerance=0.05)
    assert diameters(cleaned.assembly["counterbored_hole"]) == pytest.approx([6.6, 11.0], abs=1e-6)
    (narrow,) = (n for n in cleaned.numbers if n.part == "counterbored_hole" and n.nominal == 6.6)
    assert narrow.standard == "M6 clearance, ISO 273 medium"
