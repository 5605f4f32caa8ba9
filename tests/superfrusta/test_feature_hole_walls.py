"""Round cuts have the radii of the shape's own walls, whatever a section said."""

from __future__ import annotations

from dataclasses import replace

import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Frustum, Revolution, Tube
from partwright.fields.profile import Profile
from partwright.meshing import mesh_assembly
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_drilling import empty_round_holes
from partwright.superfrusta.feature_hole_walls import HoleWalls
from partwright.superfrusta.feature_steps import Feature, FeatureTree

PLATE = Part(Box((120.0, 80.0, 10.0)))
MOVES = tuple(Similarity(translation=(x, y, 0.0)) for x, y in ((80, 0), (0, 50), (80, 50)))
HOLES = Part(Cylinder(3.0, 12.0), (-40.0, -25.0, 0.0), instances=MOVES)
SINK = Part(Frustum(3.0, 6.0, 3.0), (-40.0, -25.0, 3.5), instances=MOVES)
WIDE = Part(Cylinder(5.0, 6.0), (-40.0, -25.0, 3.0), instances=MOVES)
TURN = Similarity(rotation=(0.9, 0.3, 0.1, 0.2), translation=(30.0, 20.0, 70.0))


def fitted(drawn: Assembly, base: Part, *cuts: Part) -> Assembly:
    """What is made for a drawn shape, somehow turned, where a search found these."""
    shape = pw.load_shape(mesh_assembly(drawn.transformed(TURN)), unit="mm")
    first, *others = in_unit_frame(shape, Assembly((base, *cuts)).transformed(TURN)).parts
    none = base.field(shape.unit_mesh[0][:0]) < 0
    features = [Feature(True, first, none, 4), *(Feature(False, cut, none, 2) for cut in others)]
    return FeatureAssembly(shape).named(FeatureTree(features))


def counts(made: Assembly) -> dict[str, int]:
    return {part.name: len(part.copies) for part in made.parts}


def difference(base: Part, *cuts: Part) -> Assembly:
    return Assembly((base, *cuts), operation="difference")


def test_a_section_across_a_countersink_tells_the_radius_of_no_wall() -> None:
    drawn = difference(PLATE, HOLES, SINK)
    made = fitted(drawn, PLATE, replace(HOLES, field=Cylinder(3.4, 10.0)))
    assert counts(made) == {"base_plate": 1, "countersunk_hole": 4}
    assert mesh_assembly(made).volume == pytest.approx(mesh_assembly(drawn).volume, rel=2e-4)


def test_a_section_above_a_step_tells_the_wider_wall_alone() -> None:
    drawn = difference(PLATE, HOLES, WIDE)
    made = fitted(drawn, PLATE, replace(HOLES, field=Cylinder(5.0, 10.0)))
    assert counts(made) == {"base_plate": 1, "counterbored_hole": 4}
    assert mesh_assembly(made).volume == pytest.approx(mesh_assembly(drawn).volume, rel=2e-4)


def test_one_that_is_narrower_than_all_walls_is_as_wide_as_they_are() -> None:
    drawn = difference(PLATE, HOLES)
    made = fitted(drawn, PLATE, replace(HOLES, field=Cylinder(2.5, 10.0)))
    assert counts(made) == {"base_plate": 1, "bolt_hole": 4}
    assert made["bolt_hole"].field.radius == pytest.approx(3.0, abs=0.01)


def test_cuts_that_are_right_stay_and_so_do_those_along_another_wall() -> None:
    """A counterbore above its hole; and a cut around whose upper half there is a pocket's wall, no hole's,
    which would be filled."""
    slot = Part(Box((9.0, 9.0, 6.0)), (-40.0, -25.0, 3.0), instances=MOVES)
    for cuts, found in (((HOLES, WIDE), WIDE), ((HOLES, slot), replace(HOLES, field=Cylinder(4.0, 10.0)))):
        shape = pw.load_shape(mesh_assembly(difference(PLATE, *cuts)), unit="mm")
        walls = HoleWalls(empty_round_holes(shape), shape.unit_distance)
        (own,) = in_unit_frame(shape, Assembly((found,))).parts
        assert walls.of(own) is None
        assert len(walls.holes) > 3
    assert walls.of(replace(own, field=Box((0.1, 0.1, 0.1)))) is None


def test_the_bore_of_a_ring_has_the_chamfers_at_its_ends() -> None:
    """A ring without stays one part."""
    ring, disc = Part(Tube(10.0, 6.0, 12.0)), Part(Cylinder(10.0, 12.0))
    section = Profile([(4, -5.5), (4.5, -6), (10, -6), (10, 6), (4.5, 6), (4, 5.5)])
    drawn = Assembly((Part(Revolution(section)),))
    made = fitted(drawn, ring)
    assert counts(made) == {"base_cylinder": 1, "chamfered_hole": 1}
    assert mesh_assembly(made).volume == pytest.approx(mesh_assembly(drawn).volume, rel=2e-4)
    (alone,) = fitted(difference(disc, Part(Cylinder(4.0, 14.0))), ring).parts
    assert alone.field.kind == "tube"
