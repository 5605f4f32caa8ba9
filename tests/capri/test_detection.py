"""Surfaces found on tessellated solids are the solids' own."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.capri import detection
from partwright.capri import quadric_rows as rows
from partwright.capri.candidates import CandidatePool, candidates, ending_planes, parting_planes
from partwright.capri.oriented_points import OrientedPoints, sample_surface
from partwright.capri.quadric_kinds import KINDS
from partwright.fields import Cylinder, Revolution
from partwright.fields.profile import Profile
from partwright.meshing import mesh_assembly
from partwright.shapes import load_shape
from tests.capri.meshes import drilled_plate, tilted_rod


def found_on(
    mesh: trimesh.Trimesh, count: int = 6000
) -> tuple[list[detection.DetectedQuadric], OrientedPoints]:
    drawn = sample_surface(load_shape(mesh), count, 0)
    return detection.detect(drawn, KINDS, 20, 0), drawn


def kinds(found: list[detection.DetectedQuadric]) -> list[str]:
    return sorted(one.kind for one in found)


def test_normals_of_a_tessellated_ball_are_those_of_the_ball() -> None:
    """Facets are up to 4 degrees off; interpolated normals are not."""
    drawn = sample_surface(load_shape(trimesh.creation.icosphere(3)), 2000, 0)
    radial = drawn.points / np.linalg.norm(drawn.points, axis=1, keepdims=True)
    assert np.degrees(np.arccos((drawn.normals * radial).sum(axis=1))).max() < 0.7
    assert drawn.area == pytest.approx(4 * np.pi * 0.81, rel=0.01)


def test_normals_of_a_box_keep_its_edges() -> None:
    drawn = sample_surface(load_shape(trimesh.creation.box((2, 1, 0.5))), 500, 0)
    assert (np.abs(drawn.normals).max(axis=1) > 1 - 1e-9).all()


def test_a_box_is_six_planes() -> None:
    found, _ = found_on(trimesh.creation.box((2, 1, 0.5)))
    assert kinds(found) == ["plane"] * 6
    offsets = sorted(round(float(-one.row[6]), 6) for one in found)
    assert offsets == pytest.approx([0.225, 0.225, 0.45, 0.45, 0.9, 0.9], abs=1e-5)


def test_holes_are_cylinders_seen_from_inside() -> None:
    found, _ = found_on(drilled_plate())
    assert kinds(found) == ["cylinder"] * 2 + ["plane"] * 6
    for one in found:
        assert one.outward == (one.kind == "plane")
        if one.kind == "cylinder":
            radius = 1 / (2 * one.row[:3].max())
            assert radius == pytest.approx(0.9 * 0.2, abs=1e-3)


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        pytest.param(trimesh.creation.icosphere(4), ["sphere"], id="ball"),
        pytest.param(tilted_rod(), ["cylinder", "plane", "plane"], id="rod"),
        pytest.param(trimesh.creation.cone(0.6, 1.5, sections=96), ["cone", "plane"], id="cone"),
    ],
)
def test_round_solids(mesh: trimesh.Trimesh, expected: list[str]) -> None:
    found, drawn = found_on(mesh)
    assert kinds(found) == expected
    covered = np.concatenate([one.inliers for one in found])
    assert len(covered) > 0.98 * len(drawn.points)
    for one in found:
        assert np.abs(rows.distances(one.row, drawn.points[one.inliers])).max() < 0.006


def test_an_ellipsoid_is_one_quadric_or_a_few() -> None:
    mesh = trimesh.creation.icosphere(4)
    mesh.apply_scale((1.0, 0.7, 0.5))
    found, drawn = found_on(mesh)
    assert found[0].kind == "quadric"
    assert len(found[0].inliers) > 0.5 * len(drawn.points)


def test_the_pool_has_planes_both_ways_and_each_quadric_once() -> None:
    found, drawn = found_on(drilled_plate())
    given = candidates(found, drawn)
    convex = CandidatePool.of([*given, *given], nested=False, oriented=True)
    nested = CandidatePool.of(given, nested=True, oriented=True)
    assert not convex.complement.any()
    assert nested.complement.sum() == 2
    assert len(nested.rows) == len(convex.rows) + 2
    flat = convex.rows[rows.is_plane(convex.rows)]
    assert {tuple(np.round(r, 9)) for r in flat} == {tuple(np.round(-r, 9)) for r in flat}


def test_without_cross_terms_a_tilted_rod_has_no_cylinder() -> None:
    found, drawn = found_on(tilted_rod())
    pool = CandidatePool.of(candidates(found, drawn), nested=False, oriented=False)
    assert rows.is_plane(pool.rows).all()


def test_an_arm_that_runs_into_an_eye_may_end_at_its_axis() -> None:
    """No surface shows where the arm ends; planes through the eyes' axes part it."""
    arm = trimesh.creation.box((1.2, 0.3, 0.2))
    eyes = [trimesh.creation.cylinder(0.3, 0.4, sections=64) for _ in range(2)]
    for eye, x in zip(eyes, (-0.6, 0.6), strict=True):
        eye.apply_translation((x, 0, 0))
    found, _ = found_on(trimesh.boolean.union([arm, *eyes]))  # 1.8 long: in the unit frame already
    parting = {tuple(np.round(np.abs(row[3:7]), 3)) for row in parting_planes(found)}
    assert parting == {(1.0, 0.0, 0.0, 0.6)}


def test_a_pipe_ends_where_it_goes_over_into_its_bend() -> None:
    """No face shows that either; where flat faces end a hole, there is nothing to add."""
    half = np.sqrt(0.5)
    bend = Part(Revolution(Profile.circle(0.15, (0.5, 0.0)), 90.0))
    pipes = (
        Part(Cylinder(0.15, 0.8), (0.5, -0.4, 0.0), (half, half, 0.0, 0.0)),
        Part(Cylinder(0.15, 0.8), (-0.4, 0.5, 0.0), (half, 0.0, half, 0.0)),
    )
    shape = load_shape(mesh_assembly(Assembly((bend, *pipes)), 128))
    drawn = sample_surface(shape, 6000, 0)
    found = [one for one in detection.detect(drawn, KINDS, 20, 0) if len(one.inliers) > 1500]
    assert kinds(found) == ["cylinder"] * 2
    box = [rows.plane(axis, float((drawn.points @ axis).max())) for axis in (*np.eye(3), *-np.eye(3))]
    ends = ending_planes(found, box, drawn)
    middle = shape.frame.to_unit(np.zeros((1, 3)))[0]
    for axis in np.eye(3)[:2]:
        along = [row for row in ends if abs(row[3:6] @ axis) > 0.99]
        heights = [-row[6] * (row[3:6] @ axis) for row in along]
        assert heights == [pytest.approx(middle @ axis, abs=0.09)]  # as wide as the pipe
    found, drawn = found_on(drilled_plate())
    assert ending_planes(found, [one.row for one in found], drawn) == []


@pytest.mark.parametrize("up", [5, 6, 7])
def test_few_points_on_either_side_of_a_wall_are_no_surface(up: int) -> None:
    """A wall thinner than the tolerance: a plane has points enough on both sides, but few face its way."""
    rng = np.random.default_rng(up)
    sides = np.repeat([1.0, -1.0], [up, 6])
    points = np.c_[rng.uniform(-0.2, 0.2, (len(sides), 2)), 1e-4 * sides]
    drawn = OrientedPoints(points, np.c_[np.zeros((len(sides), 2)), sides], 0.2)
    assert detection.detect(drawn, KINDS, 8, 0) == []
