"""Cones in which drilled holes end are part of the holes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Frustum, Revolution
from partwright.meshing import mesh_assembly
from partwright.methods import FitRequest
from partwright.shapes import Shape
from partwright.superfrusta.feature_assembly import FeatureAssembly, in_unit_frame
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.featured import FeaturedFit
from partwright.superfrusta.fit import _of_features
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

PLATE = Part(Box((120.0, 80.0, 10.0)))
MOVES = [Similarity(translation=(x, y, 0.0)) for x, y in ((80, 0), (0, 50), (80, 50))]
HOLES = Part(Cylinder(3.0, 12.0), (-40.0, -25.0, 0.0), instances=tuple(MOVES))
SINK = Part(Frustum(3.0, 6.0, 3.0), (-40.0, -25.0, 3.5), instances=tuple(MOVES[:1]))


def named(shape: Shape, *cuts: Part) -> Assembly:
    """What is made of the plate and cuts that a search found."""
    plate, *found = in_unit_frame(shape, Assembly((PLATE, *cuts))).parts
    none = np.zeros(0, bool)
    features = [Feature(True, plate, none, 4), *(Feature(False, cut, none, 2) for cut in found)]
    return FeatureAssembly(shape).named(FeatureTree(features))


def test_those_of_some_holes_of_a_pattern_make_two_patterns() -> None:
    drawn = Assembly((PLATE, HOLES, SINK), operation="difference")
    shape = pw.load_shape(mesh_assembly(drawn), unit="mm")
    made = named(shape, HOLES)
    sizes = {part.name: len(part.copies) for part in made.parts}
    assert sizes == {"base_plate": 1, "countersunk_hole": 2, "bolt_hole": 2}
    field = made["countersunk_hole"].field
    assert isinstance(field, Revolution)
    radii = np.unique(np.round(np.abs(field.profile.corners[:, 0]), 6))
    assert radii == pytest.approx([0, 3, 6], abs=1e-3)
    assert mesh_assembly(made).volume == pytest.approx(mesh_assembly(drawn).volume, rel=1e-4)


def test_what_is_cut_already_is_not_cut_again() -> None:
    shape = pw.load_shape(mesh_assembly(Assembly((PLATE, HOLES, SINK), operation="difference")), unit="mm")
    kinds = sorted(part.field.kind for part in named(shape, HOLES, SINK).parts)
    assert kinds == ["box", "cylinder", "frustum"]


def test_holes_from_below_and_at_an_angle_have_theirs() -> None:
    """Whichever way a hole's own axis points, and wherever its middle is."""
    turn = Similarity(rotation=(0.9, 0.3, 0.1, 0.2), translation=(30.0, 20.0, 70.0))
    over = Similarity(rotation=(0.0, 1.0, 0.0, 0.0))
    drawn = Assembly((PLATE, HOLES, SINK.transformed(over)), operation="difference").transformed(turn)
    shape = pw.load_shape(mesh_assembly(drawn), unit="mm")
    plate, holes = (part.transformed(turn) for part in (PLATE, HOLES))
    none = np.zeros(0, bool)
    own = in_unit_frame(shape, Assembly((plate, holes))).parts
    tree = FeatureTree([Feature(True, own[0], none, 4), Feature(False, own[1], none, 2)])
    made = FeatureAssembly(shape).named(tree)
    assert sorted(len(part.copies) for part in made.parts) == [1, 2, 2]
    assert mesh_assembly(made).volume == pytest.approx(mesh_assembly(drawn).volume, rel=1e-4)


def test_those_that_are_filled_are_told_with_their_place_however_poor_the_fit() -> None:
    """Countersinks of two holes are left out, and a block beside them, so that the fit is poor."""
    block = Part(Box((60.0, 30.0, 40.0)), (0.0, 0.0, 20.0))
    drawn = Assembly((Assembly((PLATE, block)), HOLES, SINK), operation="difference")
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    fit = FeaturedFit(FitRequest(shape, settings), FitSamples.of(shape, settings), lambda: None)

    def left(*added: Part, cuts: tuple[Part, ...]) -> list[str]:
        whole = Assembly((Assembly(added), *cuts), operation="difference", unit="mm")
        told = _of_features(shape, fit, whole, "converged", {}, []).warnings
        return [line for line in told if line.startswith("left")]

    for added in ((PLATE,), (PLATE, block)):
        assert left(*added, cuts=(HOLES,)) == [
            "left out: countersinks or chamfers of 2 holes, up to 12 mm wide, at the front lower left "
            "and elsewhere: no feature has them"
        ]
        assert not left(*added, cuts=(HOLES, SINK))
    (told,) = left(PLATE, block, cuts=(replace(HOLES, instances=MOVES[1:]), replace(SINK, instances=())))
    assert told.startswith("left out: a round hole,"), "its mouth is not told besides"
