"""Fits of solids that begin with features: what a person drew comes back, exact."""

from __future__ import annotations

import math

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Profile, Revolution, Sphere
from partwright.fields.extrusion import RIMS
from partwright.meshing import mesh_assembly, mesh_csg
from partwright.shapes import Shape, load_shape

OCTAGON = Profile.regular(8, 8.0)


def shape_of(assembly: Assembly) -> Shape:
    return load_shape(mesh_assembly(assembly), unit="mm")


def around(count: int) -> tuple[Similarity, ...]:
    turns = np.arange(1, count) * (math.pi / count)
    return tuple(Similarity(rotation=(math.cos(t), 0.0, 0.0, math.sin(t))) for t in turns)


def fitted(assembly: Assembly, **settings: object) -> pw.Result:
    return pw.fit(shape_of(assembly), "solids", quality="draft", **settings)


def test_a_plate_with_octagonal_pockets_is_drawn_once() -> None:
    pockets = tuple(OCTAGON.moved((x, y)).outline for x in (-30, 0, 30) for y in (-12, 12))
    whole = Extrusion(Profile(Profile.rectangle(100, 60, corner=6).outline, pockets), 8)
    result = fitted(Assembly((Part(whole),)))
    plate, pocket = result.assembly.parts
    assert (plate.name, pocket.name, len(pocket.copies)) == ("base_plate", "opening", 6)
    assert isinstance(plate.field, Extrusion)
    assert isinstance(pocket.field, Extrusion)
    assert plate.field.height == pytest.approx(8, rel=1e-4)
    assert len(pocket.field.profile.outline) == 8
    assert pocket.field.profile.area == pytest.approx(OCTAGON.area, rel=1e-3)
    radii = [s.radius for s in plate.field.profile.sides[0] if s.centre is not None]
    assert radii == pytest.approx([6] * 4, rel=1e-3)
    assert result.scores.iou > 0.998


def test_walls_with_a_draft_are_one_number() -> None:
    """A tray from a mould: its outside narrower upwards, its inside as it is pulled off the core."""
    block = Part(Extrusion(Profile.rectangle(90, 60, corner=10), 30, taper=2.0))
    over = (0.0, 1.0, 0.0, 0.0)
    pocket = Part(Extrusion(Profile.rectangle(78, 48, corner=6), 26, taper=1.0), (0, 0, 2), over)
    result = fitted(Assembly((block, pocket), "difference"))
    outside, inside = result.assembly.parts
    for part, (size, taper, height) in ((outside, (90, 2.0, 30)), (inside, (78, 1.0, 26))):
        assert isinstance(part.field, Extrusion)
        assert part.field.taper == taper
        assert part.field.profile.size == pytest.approx(size, abs=0.05)
        assert part.field.height == pytest.approx(height, abs=0.06)
    assert inside.name == "pocket"
    assert result.scores.iou > 0.998


def test_a_block_with_a_draft_is_not_drawn_from_the_side() -> None:
    """With its pocket in the section it explains more at first, and has its ends trimmed."""
    plate = Part(Box((100, 62, 5)), (0, 0, -2.5))
    block = Part(Extrusion(Profile.rectangle(66, 46, corner=5), 22, taper=4.0), (0, 0, 11))
    over = (0.0, 1.0, 0.0, 0.0)
    pocket = Part(Extrusion(Profile.rectangle(58, 38), 12, taper=3.0), (0, 0, 16), over)
    result = fitted(Assembly((Assembly((plate, block)), pocket), "difference"))
    tapers = sorted(f.taper for part in result.assembly.parts if isinstance(f := part.field, Extrusion))
    assert (len(result.assembly.parts), tapers) == (3, [3.0, 4.0])
    assert result.scores.iou > 0.999


def test_rounded_edges_are_numbers_of_the_body_that_has_them() -> None:
    """A plate with a fillet and holes, and on it a boss with a chamfer: two parts and a hole, no further."""
    plate = Part(Extrusion(Profile.rectangle(100, 60, corner=12), 12, top_fillet=3))
    boss = Part(Extrusion(Profile.rectangle(30, 20, corner=6), 20, top_chamfer=1.5), (0, 0, 16))
    hole = Part(Cylinder(5, 40), (30, 15, 0), instances=(Similarity(translation=(-60, 0, 0)),))
    result = fitted(Assembly((Assembly((plate, boss)), hole), "difference"))
    by_rim = {rim: part for part in result.assembly.parts for rim in RIMS if getattr(part.field, rim, 0.0)}
    assert set(by_rim) == {"top_fillet", "top_chamfer"}
    base, top = by_rim["top_fillet"].field, by_rim["top_chamfer"].field
    assert isinstance(base, Extrusion)
    assert isinstance(top, Extrusion)
    assert base.top_fillet == pytest.approx(3, rel=0.01)
    assert base.height == pytest.approx(12, rel=1e-3)
    assert top.top_chamfer == pytest.approx(1.5, rel=0.01)
    assert len(result.assembly) == 3
    assert result.scores.max_deviation < 0.1


def test_a_flange_is_turned_and_drilled_once() -> None:
    hub = Revolution(Profile([(6, 0), (30, 0), (30, 5), (12, 5), (12, 20), (6, 20)]))
    hole = Part(Cylinder(2.5, 20), (22, 0, 2), instances=around(6))
    result = fitted(Assembly((Part(hub), hole), operation="difference"))
    holes = [part for part in result.assembly.parts if len(part.copies) == 6]
    assert [type(part.field) for part in holes] == [Cylinder]
    assert holes[0].field.radius == pytest.approx(2.5, rel=2e-3)
    assert holes[0].name == "bolt_hole"
    assert len(result.assembly) <= 3
    assert result.surface.volume == pytest.approx(result.shape.volume, rel=2e-3)


def test_an_angle_with_holes_has_exact_numbers() -> None:
    outline = Profile([(0, 0), (40, 0), (40, 5), (5, 5), (5, 30), (0, 30)])
    angle = Part(Extrusion(outline, 24))
    hole = Part(Cylinder(3, 20), (25, 2, 6), (math.sqrt(0.5), math.sqrt(0.5), 0, 0))
    moved = Similarity(translation=(0, 0, -12))
    result = fitted(
        Assembly((angle, Part(hole.field, hole.translation, hole.rotation, instances=(moved,))), "difference")
    )
    base, *cuts = result.assembly.parts
    assert isinstance(base.field, Extrusion)
    assert len(base.field.profile.outline) == 6
    assert base.field.profile.area == pytest.approx(outline.area, rel=1e-4)
    (cut,) = cuts
    assert len(cut.copies) == 2
    assert cut.field.radius == pytest.approx(3, rel=2e-3)
    assert result.scores.iou > 0.997


def test_cleaned_features_have_plain_numbers() -> None:
    profile = Profile([(0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (0, 3)])
    result = fitted(Assembly((Part(Extrusion(profile, 2)),)), clean=True)
    (part,) = result.assembly.parts
    assert isinstance(part.field, Extrusion)
    assert part.field.height == 2
    assert part.field.profile.area == pytest.approx(profile.area, rel=1e-9)
    assert result.clean is not None
    assert [one.nominal for one in result.clean.numbers if one.name == "height"] == [2]


def test_the_budget_and_the_target_are_kept() -> None:
    steps = Assembly(tuple(Part(Box((10.0 - 3 * i, 10.0, 2.0)), (1.5 * i, 0, 2.0 * i)) for i in range(3)))
    whole = Assembly((steps, Part(Cylinder(1, 20), (-3.5, 0, 0))), operation="difference")
    assert len(fitted(whole, max_parts=1).assembly) == 1
    assert len(fitted(whole, min_iou=0.7).assembly) == 1


def test_the_same_seed_gives_the_same_features() -> None:
    whole = Assembly((Part(Box((4.0, 3.0, 1.0))), Part(Cylinder(0.5, 3), (1, 0, 0))), operation="difference")
    first, second = (fitted(whole).assembly for _ in range(2))
    assert first == second


def test_a_pin_that_hardly_pays_is_there_all_the_same() -> None:
    whole = Assembly((Part(Box((100.0, 60.0, 20.0))), Part(Cylinder(0.5, 40), (20, 10, 10))))
    result = fitted(whole)
    assert result.report["scores"]["max_deviation_share"] < 0.01
    assert sorted(type(part.field).__name__ for part in result.assembly.parts) == ["Box", "Cylinder"]


def test_a_hook_is_turned_as_far_as_it_goes() -> None:
    bend = Part(Revolution(Profile.circle(3, (20, 0)), 200))
    result = fitted(Assembly((Part(Box((16.0, 16.0, 30.0)), (20, 0, 0)), bend)))
    turned = [part.field for part in result.assembly.parts if isinstance(part.field, Revolution)]
    assert len(turned) == 1
    assert 199 < turned[0].angle < 224  # it goes on within the block
    assert result.scores.iou > 0.99


@pytest.mark.heavy
def test_rings_with_balls_are_what_they_are() -> None:
    """Which no outline is that holds cut from it: each is a body of its own."""
    outer = Part(Revolution(Profile([(33, -10), (40, -10), (40, 10), (33, 10), (33, 4), (32, 0), (33, -4)])))
    inner = Part(Revolution(Profile([(15, -10), (22, -10), (22, -4), (23, 0), (22, 4), (22, 10), (15, 10)])))
    ball = Part(Sphere(6), (27.5, 0, 0), instances=around(9))
    coarse = load_shape(mesh_csg(Assembly((outer, inner, ball)), 0.03), unit="mm")
    result = pw.fit(coarse, "solids", quality="draft")
    assert sorted(len(part.copies) for part in result.assembly.parts) == [1, 1, 9]
    assert result.scores.iou > 0.98
