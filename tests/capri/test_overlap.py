"""Convexes that touch overlap afterwards; faces of the shape's own surface stay."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.capri import quadric_rows as rows
from partwright.capri import samples
from partwright.capri.csg_tree import CsgTree
from partwright.capri.overlap import overlapped
from partwright.meshing import mesh_csg
from partwright.shapes import load_shape

TURN = trimesh.transformations.rotation_matrix(0.7, (1.0, 0.5, 0.2))[:3, :3]


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> list[np.ndarray]:
    """The six planes of a box that is turned."""
    sides = [rows.plane(TURN @ n, h) for n, h in zip(np.eye(3), high, strict=True)]
    return sides + [rows.plane(TURN @ -n, -v) for n, v in zip(np.eye(3), low, strict=True)]


def drawn(mesh: trimesh.Trimesh) -> samples.OccupancySamples:
    turned = trimesh.Trimesh(mesh.vertices @ TURN.T, mesh.faces)
    shape = load_shape(turned)
    found = samples.draw_samples(shape, 20_000, 10_000, 0)
    points = shape.frame.from_unit(found.points).astype(np.float32)
    return samples.OccupancySamples(points, found.inside, found.weight, found.near, found.uniform)


@pytest.fixture(scope="module")
def step() -> tuple[CsgTree, samples.OccupancySamples]:
    """A slab with a narrower block on it, which touch in a part of the slab's upper face."""
    lower, upper = box((-0.8, -0.5, -0.4), (0.8, 0.5, 0.0)), box((-0.4, -0.3, 0.0), (0.2, 0.3, 0.4))
    parts = [
        trimesh.creation.box(bounds=[(-0.8, -0.5, -0.4), (0.8, 0.5, 0.0)]),
        trimesh.creation.box(bounds=[(-0.4, -0.3, -0.1), (0.2, 0.3, 0.4)]),
    ]
    tree = CsgTree(np.stack(lower + upper), np.zeros(12, bool), ((tuple(range(6)), tuple(range(6, 12))),))
    return tree, drawn(trimesh.boolean.union(parts))


def test_only_the_face_within_the_other_convex_moves(step: tuple[CsgTree, samples.OccupancySamples]) -> None:
    tree, found = step
    moved = overlapped(tree, found)
    assert moved.layers == ((tuple(range(6)), (6, 7, 8, 9, 10, 12)),)  # the block's lower side is new
    np.testing.assert_array_equal(moved.rows[:12], tree.rows)
    np.testing.assert_allclose(moved.rows[12] - tree.rows[11], -0.002 * np.eye(10)[6], atol=1e-12)


def test_the_solid_is_one_without_a_sheet_inside(step: tuple[CsgTree, samples.OccupancySamples]) -> None:
    mesh = mesh_csg(overlapped(*step).assembly())
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(1.6 * 1.0 * 0.4 + 0.6 * 0.6 * 0.4, rel=1e-6)
    outside = 2 * (1.6 + 1.6 * 0.4 + 0.4) + 4 * 0.6 * 0.4  # the slab's, and the block's four sides
    assert mesh.area == pytest.approx(outside, rel=1e-6)


def test_what_is_cut_off_reaches_through_the_face(step: tuple[CsgTree, samples.OccupancySamples]) -> None:
    """A pocket that ends in the face it opens would leave a lid."""
    plate = trimesh.creation.box(bounds=[(-0.8, -0.5, -0.4), (0.8, 0.5, 0.0)])
    pocket = trimesh.creation.box(bounds=[(-0.3, -0.2, -0.2), (0.4, 0.2, 0.1)])
    table = box((-0.8, -0.5, -0.4), (0.8, 0.5, 0.0)) + box((-0.3, -0.2, -0.2), (0.4, 0.2, 0.0))
    layers = ((tuple(range(6)),), (tuple(range(6, 12)),))
    tree = CsgTree(np.stack(table), np.zeros(12, bool), layers)
    moved = overlapped(tree, drawn(trimesh.boolean.difference([plate, pocket])))
    assert moved.layers == ((tuple(range(6)),), ((6, 7, 12, 9, 10, 11),))
    assert mesh_csg(moved.assembly()).volume == pytest.approx(0.64 - 0.7 * 0.4 * 0.2, rel=1e-6)
