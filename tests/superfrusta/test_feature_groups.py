"""Groups that a fit finds: feet with their holes once, and moves and mirror images of them, exact."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold, Mesh

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity, copies_of, mirrored, ring
from partwright.assembly.file_text import to_text
from partwright.assembly.repeated_groups import parts_once, repeats
from partwright.export import export
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.meshing.csg import solid_of
from partwright.superfrusta.feature_groups import grouped
from partwright.superfrusta.feature_steps import Feature, as_move, image_of
from partwright.superfrusta.feature_symmetry import centre_of_volume, reflected, reflection, symmetries
from tests.superfrusta.test_features import fitted

FOOT = Part(Box((16, 12, 20)), (30, 20, -8), name="foot") - Part(
    Cylinder(2.5, 12), (32, 20, -14), name="hole"
)
PLATE = Part(Box((80, 60, 6)), (0, 0, 3), name="plate")
ACROSS = tuple(Similarity(translation=(x, y, 0)) for x, y in ((-60, 0), (-60, -40), (0, -40)))
# Of a block with holes from above and from the side no turn makes its mirror image.
HANDED = Assembly(
    (
        Part(Box((20, 12, 30)), (30, 5, 14), name="block"),
        Part(Cylinder(2, 12), (34, 7, 26), name="above"),
        Part(Cylinder(3, 10), (40, 4, 12), (np.sqrt(0.5), 0, np.sqrt(0.5), 0), name="aside"),
    ),
    "difference",
)
NONE = np.zeros(0, bool)


def test_feet_with_blind_holes_are_one_group_that_is_there_four_times(tmp_path: Path) -> None:
    """Though the holes are off the middle, so that the whole is symmetric in one plane alone."""
    result = fitted(Assembly((PLATE, FOOT, *copies_of(FOOT, ACROSS)), unit="mm"))
    assembly = result.assembly
    (found,) = repeats(assembly)
    assert len(found.copies) == 3
    assert len(parts_once(assembly)) == 3
    assert (result.report["parts"], result.report["instances"]) == (3, 9)
    foot, hole = assembly.children[found.first].parts
    assert isinstance(foot.field, Box)
    assert foot.field.size[:2] == pytest.approx((16, 12), abs=0.01)
    assert isinstance(hole.field, Cylinder)
    assert hole.field.radius == pytest.approx(2.5, rel=1e-3)
    # The moves are those that it was drawn with, to the digit.
    moves = {tuple(np.round(np.abs(move.translation), 9).tolist()) for move in found.moves}
    assert moves == {(60, 0, 0), (60, 40, 0), (0, 40, 0)}
    assert "difference block_cut, 4 times" in assembly.describe()
    assert to_text(assembly).count('"kind"') == 3
    export(assembly, tmp_path / "stand.scad")
    assert (tmp_path / "stand.scad").read_text().count("module ") == 3
    assert result.surface.volume == pytest.approx(
        80 * 60 * 6 + 4 * (16 * 12 * 18 - np.pi * 2.5**2 * 10), rel=2e-3
    )


def test_a_group_of_parts_that_were_turned_over_is_a_mirror_image() -> None:
    """A flange and its other side are one extrusion, turned over; with a corner cut off at one end, no move
    leads from one to the other."""
    angle = Profile.polygon([(0.3, 0), (0.7, 0), (0.7, 0.05), (0.35, 0.05), (0.35, 0.4), (0.3, 0.4)])
    flange = Part(Extrusion(angle, 0.3), (0, 0, 0.2))
    upright = (np.sqrt(0.5), np.sqrt(0.5), 0, 0)
    corner = Part(Extrusion(Profile.polygon([(0.6, 0.4), (0.8, 0.2), (0.8, 0.4)]), 0.2), (0, 0, 0), upright)
    moves = [as_move(part, image_of(part, Similarity())) for part in (flange, corner)]
    both = [replace(part, instances=(move,)) for part, move in zip((flange, corner), moves, strict=True)]
    made = grouped([Feature(added, part, NONE, 4) for added, part in zip((True, False), both, strict=True)])
    (found,) = repeats(made)
    assert len(found.images) == 1
    assert len(parts_once(made)) == 2
    points = np.random.default_rng(0).uniform(-0.9, 0.9, (2000, 3))
    left, right = (made.distance(points * sign) for sign in ([1, 1, 1], [-1, 1, 1]))
    np.testing.assert_allclose(left, right, atol=1e-6)
    assert (left < 0).any()


def test_a_left_and_a_right_block_are_a_group_and_its_mirror_image() -> None:
    whole = Assembly((Part(Box((100, 40, 5)), (0, 0, -2), name="plate"), HANDED, mirrored(HANDED, "x")))
    result = fitted(whole)
    data = json.loads(to_text(result.assembly))
    (group,) = (child for child in data["children"] if "instances" in child)
    (image,) = group["instances"]
    assert image["mirror"] == "x"
    assert image["translation"] == pytest.approx([0, 0, 0], abs=1e-9)
    assert to_text(result.assembly).count('"kind"') == 4
    assert (result.report["parts"], result.report["instances"]) == (4, 7)
    assert ", 2 times, 1 mirrored" in result.assembly.describe()
    assert result.scores.max_deviation < 0.05


def test_copies_of_features_become_copies_of_groups_in_whatever_order() -> None:
    """Holes that are shifted, feet that are turned, two holes a foot: what they are as solids decides."""
    foot = Part(Cylinder(0.2, 0.4), (0.6, 0, -0.2), instances=ring(3))
    places = [move(np.array((0.6 + x, 0.05, -0.3))) for x in (0.1, -0.1) for move in (Similarity(), *ring(3))]
    order = [places[i] for i in (4, 0, 2, 5, 1, 3)]
    hole = Part(
        Cylinder(0.04, 0.3),
        order[0],
        instances=tuple(Similarity(translation=p - order[0]) for p in order[1:]),
    )
    base = Part(Cylinder(0.9, 0.1), (0, 0, 0.05))
    features = [Feature(plus, part, NONE, 0) for plus, part in ((True, base), (True, foot), (False, hole))]
    made = grouped(features)
    (found,) = repeats(made)
    assert len(found.copies) == 2
    assert [len(part.copies) for part in made.children[found.first].parts] == [1, 2]
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    flat = Assembly((Assembly((base, foot)), hole), "difference")
    assert ((made.distance(points) < 0) == (flat.distance(points) < 0)).all()
    # Two of three that are alike are a group, the other is there by itself.
    odd = Feature(False, Part(Cylinder(0.05, 0.1), (-0.3, 0.5196, -0.35)), NONE, 0)
    made = grouped([*features, odd])
    assert [len(repeat.copies) for repeat in repeats(made)] == [1]
    flat = Assembly((flat, odd.part), "difference")
    assert ((made.distance(points) < 0) == (flat.distance(points) < 0)).all()


def test_a_group_of_a_feature_with_its_image_keeps_its_cut() -> None:
    away = (Similarity(translation=(0, 3, 0)),)
    plate = Part(Box((2, 1, 0.2)), (0, -1.5, 0), instances=away)
    fin = Extrusion(Profile([(0, 0), (0.4, 0), (0, 0.4)]), 0.4)
    wedge = Part(fin, (0.3, -1.5, 0.2), instances=away)
    cut = Part(Cylinder(0.06, 2.2), (0, -1.4, 0.1), (np.sqrt(0.5), 0, np.sqrt(0.5), 0), instances=away)
    made = grouped(
        [
            Feature(True, plate, NONE, 0),
            Feature(True, wedge, NONE, 0, Similarity()),
            Feature(False, cut, NONE, 0),
        ]
    )
    assert len(repeats(made)) == 1
    flat = Assembly((Assembly((plate, wedge, image_of(wedge, Similarity()))), cut), "difference")
    points = np.random.default_rng(0).uniform((-1, -2.2, -0.3), (1, 2.2, 0.6), (20000, 3))
    wrong = (made.distance(points) < 0) != (flat.distance(points) < 0)
    assert wrong.sum() == 0
    assert (cut.distance(points) < 0).sum() > 50


def test_a_hole_that_goes_on_into_what_is_no_copy_is_no_group() -> None:
    foot = Part(Cylinder(0.2, 0.4), (0.6, 0, -0.2), instances=ring(3))
    hole = Part(Cylinder(0.04, 0.8), (0.6, 0, -0.2), instances=ring(3))
    base = Part(Cylinder(0.9, 0.1), (0, 0, 0.05))
    made = grouped(
        [Feature(True, base, NONE, 0), Feature(True, foot, NONE, 0), Feature(False, hole, NONE, 0)]
    )
    assert [len(part.copies) for part in made.parts] == [1, 3, 3]


def test_mirror_images_are_turns_where_they_can_be() -> None:
    plane = reflection(np.array([0.6, 0.8, 0.0]), np.array([0.1, 0.2, 0.3]))
    skew = Profile([(0, 0), (0.3, 0), (0.2, 0.2), (0, 0.1)])
    prism = Part(Extrusion(skew, 0.4), (0.3, 0.2, 0), (0.9, 0.1, 0.3, 0.2))
    points = np.random.default_rng(1).uniform(-1, 1, (2000, 3))
    for part in (prism, Part(Box((0.2, 0.3, 0.4)), (0.3, 0, 0), prism.rotation)):
        move = as_move(part, image_of(part, plane))
        assert move is not None
        np.testing.assert_allclose(
            part.transformed(move).distance(reflected(plane, points)), part.distance(points), atol=1e-6
        )
    tapered = Part(Extrusion(skew, 0.2, 8), prism.translation, prism.rotation)
    assert as_move(tapered, image_of(tapered, plane)) is None
    np.testing.assert_allclose(
        image_of(tapered, plane).distance(reflected(plane, points)), tapered.distance(points), atol=1e-6
    )


@pytest.mark.parametrize(("arms", "mirrors_wanted"), [(3, 2), (18, 3), (40, 3)])
def test_symmetries_are_exact_and_of_the_right_order(arms: int, mirrors_wanted: int) -> None:
    hub = 0.2 if arms < 20 else 0.45
    arm = Part(Box((0.5, min(0.1, 1 / arms), 0.1)), (0.35, 0, 0), instances=ring(arms))
    solid = solid_of(Assembly((arm, Part(Cylinder(hub, 0.1)))), 1e-3).translate((0.2, 0.1, 0))
    np.testing.assert_allclose(centre_of_volume(solid), [0.2, 0.1, 0], atol=1e-5)
    mesh = solid.to_mesh()
    shape = pw.load_shape((np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts)))
    vertices, faces = shape.unit_mesh
    body = Manifold(Mesh(vertices.astype(np.float32), faces.astype(np.uint32)))
    surface = shape.unit_surface(2000, 0).points.astype(np.float32)
    turns, mirrors = symmetries(body, [np.array([0.0, 0.0, 1.0])], surface, shape.unit_away)
    assert len(mirrors) == mirrors_wanted  # across z and y, and x; the others are turns of these
    angles = sorted(2 * np.arccos(abs(turn.rotation[0])) for turn in turns if abs(turn.rotation[3]) > 0.01)
    wanted = [2 * np.pi / arms * min(k, arms - k) for k in range(1, arms)]
    np.testing.assert_allclose(angles, sorted(wanted), atol=1e-7)
