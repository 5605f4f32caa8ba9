"""Directions that are nearly parallel become so, where the points allow it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.capri import detection
from partwright.capri import quadric_rows as rows
from partwright.capri.alignment import aligned
from partwright.capri.detection import DetectedQuadric
from partwright.capri.oriented_points import OrientedPoints, sample_surface
from partwright.capri.quadric_kinds import KINDS
from partwright.shapes import load_shape
from tests.capri.meshes import drilled_plate

TILT = trimesh.transformations.rotation_matrix(np.radians(0.3), (1.0, 0.4, 0.2))[:3, :3]


def find(
    row: np.ndarray, kind: str, points: np.ndarray, normals: np.ndarray
) -> tuple[DetectedQuadric, OrientedPoints]:
    surface = OrientedPoints(points, normals, 1.0)
    borne = detection.support(row, points, normals)
    return DetectedQuadric(row, kind, np.arange(len(points)), True, borne), surface


def wall(axis: np.ndarray, length: float, count: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Points and normals of a cylinder of radius 0.2 around a line through (0.1, 0.2, 0) along `axis`."""
    rng = np.random.default_rng(0)
    turn = rng.uniform(0, 2 * np.pi, count)
    across = np.linalg.svd(axis[None])[2][1:]
    normals = np.stack([np.cos(turn), np.sin(turn)], axis=1) @ across
    return normals * 0.2 + np.outer(rng.uniform(-0.5, 0.5, count) * length, axis) + (0.1, 0.2, 0.0), normals


def test_the_axis_of_a_short_hole_becomes_exact() -> None:
    points, normals = wall(np.eye(3)[2], 0.1)
    one, surface = find(rows.cylinder((0.1, 0.2, 0), TILT[:, 2], 0.2003), "cylinder", points, normals)
    row = aligned([one], surface)[0].row
    np.testing.assert_allclose(row, rows.cylinder((0.1, 0.2, 0.0), (0.0, 0.0, 1.0), 0.2), atol=1e-9)


def test_a_long_rod_that_is_tilted_stays_so() -> None:
    axis = trimesh.transformations.rotation_matrix(np.radians(0.8), (1.0, 0.0, 0.0))[:3, 2]
    points, normals = wall(axis, 1.6)
    one, surface = find(rows.cylinder((0.1, 0.2, 0), axis, 0.2), "cylinder", points, normals)
    assert aligned([one], surface) == [one]


def test_a_smaller_plane_follows_the_larger() -> None:
    """Neither is along a coordinate axis; the two sides of a slab keep their sides."""
    normal = np.array([0.6, 0.0, 0.8])
    rng = np.random.default_rng(1)
    flat = rng.uniform(-0.5, 0.5, (300, 3))
    flat -= np.outer(flat @ normal, normal)
    points = np.concatenate([flat + 0.2 * normal, 0.05 * flat[:60] - 0.1 * normal])
    normals = np.repeat([normal, -normal], (300, 60), axis=0)
    surface = OrientedPoints(points, normals, 1.0)
    large = DetectedQuadric(rows.plane(normal, 0.2), "plane", np.arange(300), True, 600.0)
    small = DetectedQuadric(rows.plane(-TILT @ normal, 0.1), "plane", np.arange(300, 360), True, 120.0)
    first, second = aligned([small, large], surface)
    np.testing.assert_allclose(second.row, large.row)
    np.testing.assert_allclose(first.row, rows.plane(-normal, 0.1), atol=1e-12)


def test_the_holes_of_a_plate_are_square_to_it() -> None:
    surface = sample_surface(load_shape(drilled_plate()), 6000, 0)
    found = aligned(detection.detect(surface, KINDS, 20, 0), surface)
    holes = [one.row for one in found if one.kind == "cylinder"]
    assert len(holes) == 2
    for row in holes:
        np.testing.assert_allclose(row[[2, 5, 8, 9]], 0.0, atol=1e-12)  # no z
        assert 1 / (2 * row[0]) == pytest.approx(0.18, abs=1e-3)
