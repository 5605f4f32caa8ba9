"""No chip is left in the air, or cut off by a hair; what the shape has itself stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Extrusion, Profile, Sphere
from partwright.meshing import mesh_assembly
from partwright.meshing.csg import solid_of
from partwright.superfrusta.far_places import CHORD
from partwright.superfrusta.feature_assembly import FeatureAssembly
from partwright.superfrusta.feature_chips import without_chips
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.moved_faces import (
    faces_of,
    with_corners_moved,
    with_side_moved,
    without_corners,
)
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

# In the unit frame: centred, the longest side 1.8.
BLOCK = Part(Box((1.0, 1.8, 0.3)))
Steps = list[tuple[Part, bool]]


def mended(whole: Assembly, steps: Steps) -> tuple[list[Part], int, int, float]:
    """Parts of the tree without chips, its pieces before and after, and by how much R rises."""
    settings = Settings.for_quality("draft")
    shape = pw.load_shape(mesh_assembly(whole, 256))
    search = FeatureSearch(shape, FitSamples.of(shape, settings), settings.alpha)
    made = FeatureAssembly(shape).in_unit_frame
    none = np.zeros(0, bool)
    tree = search.scored(FeatureTree([Feature(added, part, none, 4) for part, added in steps]))
    result = without_chips(search, tree, made)
    assert result.score == pytest.approx(search.scored(result).score)
    pieces = [len(solid_of(made(one), CHORD).decompose()) for one in (tree, result)]
    return [f.part for f in result.features], *pieces, result.score - tree.score


@pytest.mark.parametrize("extruded", [False, True])
def test_one_wall_moves_where_two_cuts_leave_a_chip(extruded: bool) -> None:
    """They take the end of a block, and the upper one ends a little before it."""
    longer = Part(Box((1.6, 1.8, 0.3)), (0.3, 0.0, 0.0))  # to x = 1.1
    lower = Part(Box((0.7, 2.0, 0.2)), (0.85, 0.0, -0.1))
    upper = Part(Box((0.597, 2.0, 0.2)), (0.7985, 0.0, 0.1))  # to x = 1.097
    if extruded:
        profile = Profile.polygon([(0.5, -1.0), (1.097, -1.0), (1.097, 1.0), (0.5, 1.0)])
        upper = Part(Extrusion(profile, 0.2), (0.0, 0.0, 0.1))
    steps = [(longer, True), (lower, False), (upper, False)]
    parts, before, after, gain = mended(Assembly((BLOCK,)), steps)
    assert (before, after) == (2, 1)
    (changed,) = (k for k, (part, _) in enumerate(steps) if parts[k] != part)
    moved = np.abs(parts[changed].bounds() - steps[changed][0].bounds())
    assert sorted(moved[moved > 1e-9]) == pytest.approx([0.0035], abs=2e-4)
    assert gain >= 0


def test_a_tooth_that_an_outline_goes_around_goes_where_nothing_holds_it() -> None:
    longer = Part(Box((1.6, 1.8, 0.3)), (0.3, 0.0, 0.0))
    left = Part(Box((0.3, 2.0, 0.5)), (0.65, 0.0, 0.0))
    around = [(0.8, -1.0), (1.2, -1.0), (1.2, 1.0), (0.8, 1.0), (0.8, 0.02), (0.81, 0.0), (0.8, -0.02)]
    right = Part(Extrusion(Profile.polygon(around), 0.5))
    steps = [(longer, True), (left, False), (right, False)]
    parts, before, after, _ = mended(Assembly((BLOCK,)), steps)
    assert (before, after) == (2, 1)
    assert sum(part != given for part, (given, _) in zip(parts, steps, strict=True)) == 1


def test_what_is_added_ends_before_the_chip_where_no_cut_can_go_over_it() -> None:
    """A ball takes the tip of a pin but for its rim."""
    pin = Part(Cylinder(0.1, 0.5), (0.0, 0.0, 0.114))  # to z = 0.364
    ball = Part(Sphere(0.15), (0.0, 0.0, 0.25))
    short = Part(Cylinder(0.1, 0.4), (0.0, 0.0, 0.1))
    whole = Assembly((Assembly((Assembly((BLOCK, short)), ball), "difference"),))
    parts, before, after, _ = mended(whole, [(BLOCK, True), (pin, True), (ball, False)])
    assert (before, after) == (2, 1)
    assert (parts[0], parts[2]) == (BLOCK, ball)
    assert parts[1].bounds()[1][2] < 0.364


def test_a_piece_that_a_hair_cuts_off_is_joined() -> None:
    """A slot beside the end of a block, which leaves a web in the shape and none in the tree."""
    slot = Part(Box((1.2, 0.02, 0.4)), (0.0, 0.87, 0.055))  # to z = -0.145
    deeper = replace(slot, translation=(0.0, 0.87, 0.0495))  # to z = -0.1505
    whole = Assembly((BLOCK, slot), "difference")
    parts, before, after, _ = mended(whole, [(BLOCK, True), (deeper, False)])
    assert (before, after) == (2, 1)
    assert parts[0] == BLOCK
    assert -0.15 < parts[1].bounds()[0][2] < -0.14


def test_pieces_of_the_shape_itself_stay() -> None:
    crumbs = [Part(Box((0.05, 0.05, 0.05)), (x, 0.0, 0.0)) for x in (-0.55, 0.55)]
    steps = [(part, True) for part in (BLOCK, *crumbs)]
    parts, before, after, gain = mended(Assembly((BLOCK, *crumbs)), steps)
    assert (before, after, gain) == (3, 3, 0.0)
    assert parts == [BLOCK, *crumbs]


@pytest.mark.parametrize(
    "part",
    [
        Part(Box((1, 2, 3)), (1, 2, 3), (0.5, 0.5, 0.5, 0.5)),
        Part(Cylinder(1, 2), (1, 0, 0)),
        Part(Extrusion(Profile.polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]), 1), (0, 0, 1)),
    ],
    ids=["box", "cylinder", "extrusion"],
)
def test_a_face_moves_as_far_as_it_is_told_and_no_other(part: Part) -> None:
    faces = list(faces_of(part))
    points = np.random.default_rng(0).uniform(-2, 2, (500, 3))
    for k, face in enumerate(faces):
        moved = face.moved(0.1)
        there = moved.pose.inverse()(part.pose(points))
        for i, (was, now) in enumerate(zip(faces, faces_of(moved), strict=True)):
            assert now.beyond(there) == pytest.approx(was.beyond(points) - (0.1 if i == k else 0.0))


def test_sides_beside_one_that_moves_end_at_it() -> None:
    rounded = Profile([(0, 0), (2, 0), (2, 1, 0.2), (0, 1)])
    wider = with_side_moved(rounded, 0, 1, 0.1)
    assert wider.outline[1][:2] == pytest.approx((2.1, 0.0))
    assert wider.area > rounded.area
    with pytest.raises(pw.errors.ParameterError):
        with_side_moved(Profile.circle(1.0), 0, 0, 0.1)


def test_an_outline_goes_on_without_corners_or_with_others() -> None:
    around = Profile.polygon([(0, -1), (1, -1), (1, 1), (0, 1), (0, 0.2), (0.1, 0), (0, -0.2)])
    part = Part(Extrusion(around, 1))
    (plain,) = (without_corners(part, 0, k, 1).field for k in range(7) if around.outline[k][0] == 0.1)
    assert isinstance(plain, Extrusion)
    assert plain.profile.area == pytest.approx(2.0)
    k = next(k for k in range(7) if around.outline[k][:2] == (1.0, 1.0))
    pointed = with_corners_moved(part, 0, [k], 0.1).field
    assert isinstance(pointed, Extrusion)
    assert pointed.profile.outline[k][:2] == pytest.approx((1 + 0.1 / 2**0.5, 1 + 0.1 / 2**0.5))
