"""Triangles across bends are halved: fillets narrower than a cell come out smooth, the surface closed."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from partwright.meshing import mesh_field, refinement
from partwright.meshing.refinement import _halved

CELL = 2 / 32


def rounded_box(half: float, fillet: float, turn: int):
    frame = Rotation.random(random_state=turn).as_matrix()

    def distance(points: np.ndarray) -> np.ndarray:
        q = np.abs(points @ frame) - np.float64(half - fillet)
        return np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0) - fillet

    return distance


def slopes(distance, points: np.ndarray) -> np.ndarray:
    step = 1e-5 * np.eye(3)
    taken = np.stack([distance(points + s) - distance(points - s) for s in step], axis=1)
    return taken / np.linalg.norm(taken, axis=1, keepdims=True)


@pytest.mark.parametrize("turn", [0, 1, 2])
@pytest.mark.parametrize("fillet", [0.3, 0.6, 1.0])
def test_a_fillet_narrower_than_a_cell_is_no_string_of_beads(fillet: float, turn: int) -> None:
    """Everywhere on it, the mesh lies and looks as the box does."""
    distance = rounded_box(0.6, fillet * CELL, turn)
    mesh = mesh_field(distance, [-1.1] * 3, [1.1] * 3, 2.2 / CELL)
    assert mesh.is_volume
    points, face = trimesh.sample.sample_surface(mesh, 40_000, seed=0)
    off = np.abs(distance(points)) / CELL
    assert off.max() < 0.15
    assert np.quantile(off, 0.999) < 0.05
    cosine = np.einsum("nd,nd->n", slopes(distance, points), mesh.face_normals[face])
    turned = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.sqrt((turned**2).mean()) < 5.5
    assert (turned > 25).mean() < 6e-3


def test_what_is_flat_or_sharp_takes_no_more_triangles() -> None:
    plain = mesh_field(rounded_box(0.6, 0.0, 3), [-1.1] * 3, [1.1] * 3, 2.2 / CELL)
    round_ = mesh_field(rounded_box(0.6, 0.4 * CELL, 3), [-1.1] * 3, [1.1] * 3, 2.2 / CELL)
    coarse = mesh_field(rounded_box(0.6, 0.0, 3), [-1.1] * 3, [1.1] * 3, 2.2 / CELL, sharp=False)
    assert len(plain.faces) < 1.15 * len(coarse.faces)
    assert len(round_.faces) > 1.5 * len(plain.faces)


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**31), share=st.floats(0.05, 1.0))
def test_halving_any_edges_keeps_a_surface_as_it_is(seed: int, share: float) -> None:
    mesh = trimesh.creation.icosphere(1)
    edges = mesh.edges_unique[np.random.default_rng(seed).random(len(mesh.edges_unique)) < share]
    assume(len(edges))
    edges = np.sort(np.random.default_rng(seed).permutation(edges), axis=1)
    vertices = np.concatenate([mesh.vertices, mesh.vertices[edges].mean(axis=1)])
    whole, pieces = _halved(mesh.faces, edges, vertices)
    halved = trimesh.Trimesh(vertices, np.concatenate([whole, pieces]), process=False)
    assert len(halved.faces) == len(mesh.faces) + 2 * len(edges)
    assert halved.is_watertight
    assert halved.is_winding_consistent
    assert halved.volume == pytest.approx(mesh.volume, rel=1e-12)
    assert halved.area == pytest.approx(mesh.area, rel=1e-12)


def test_a_field_that_is_told_a_little_otherwise_each_time_leaves_no_cracks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A network's values hang on what else it is asked: an edge may be off at one time only."""
    rng = np.random.default_rng(0)

    def otherwise(distance, points: np.ndarray) -> np.ndarray:
        return distance(points) + rng.normal(0, 0.03 * CELL, len(points))

    monkeypatch.setattr(refinement, "evaluate", otherwise)
    mesh = mesh_field(rounded_box(0.6, 0.5 * CELL, 4), [-1.1] * 3, [1.1] * 3, 2.2 / CELL)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
