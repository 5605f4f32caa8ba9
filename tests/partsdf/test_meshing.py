"""The sparse lattice against the dense grid, on fields whose surfaces are known; neural shapes."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from partwright.meshing.cells import cell_polygons
from partwright.meshing.tables import CORNERS
from partwright.partsdf import meshing
from partwright.partsdf.meshing import SparseLattice, mesh_shape, resolution_for_wall
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.pictures import picture_resolution


def two_balls(points: np.ndarray) -> np.ndarray:
    """A union and its parts: (3, N)."""
    a = np.linalg.norm(points - [0.3, 0.1, 0.0], axis=1) - 0.5
    b = np.linalg.norm(points - [-0.4, 0.0, -0.1], axis=1) - 0.35
    return np.stack([np.minimum(a, b), a, b]).astype(np.float32)


def dense(resolution: int) -> list[np.ndarray]:
    """Vertices of the same fields on the full grid."""
    axis = np.arange(resolution + 1) * 2 / resolution - 1
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    values = two_balls(grid).reshape(3, *[resolution + 1] * 3)
    cells = np.argwhere(np.ones([resolution] * 3, dtype=bool))
    corner = tuple(np.moveaxis(cells[:, None] + CORNERS, 2, 0))
    return [cell_polygons(cells, v[corner]).vertices * 2 / resolution - 1 for v in values]


def test_the_sparse_surface_is_the_dense_one() -> None:
    lattice = SparseLattice(two_balls, 1.0, 32, lipschitz=1.0)
    for mesh, expected in zip(lattice.meshes(), dense(32), strict=True):
        assert mesh is not None
        assert mesh.is_watertight
        assert mesh.volume > 0
        # The same vertices, to the last digits, whatever their order.
        mine = {tuple(v) for v in np.round(mesh.vertices, 4)}
        theirs = {tuple(v) for v in np.round(expected, 4)}
        assert len(mine ^ theirs) <= 0.001 * len(theirs)


def test_a_fine_lattice_is_asked_at_few_points() -> None:
    lattice = SparseLattice(lambda p: two_balls(p)[:1], 1.0, 256, lipschitz=1.0)
    assert lattice.dense == 257**3
    assert lattice.evaluations * 20 < lattice.dense
    (mesh,) = lattice.meshes()
    assert mesh is not None
    assert mesh.is_watertight
    assert np.abs(two_balls(mesh.vertices)[0]).max() < lattice.cell / 2


@pytest.mark.parametrize("lipschitz", [0.2, 0.5])
def test_too_low_a_constant_leaves_no_hole(lipschitz: float) -> None:
    """Cubes are left out too early, and the surface grows back from those that are met."""
    steep = SparseLattice(lambda p: 3 * two_balls(p), 1.0, 64, lipschitz=lipschitz)
    expected = dense(64)
    for mesh, vertices in zip(steep.meshes(), expected, strict=True):
        assert mesh is not None
        assert mesh.is_watertight
        assert len(mesh.vertices) == pytest.approx(len(vertices), rel=0.001)


def test_what_reaches_the_box_ends_there_and_what_is_nowhere_is_none() -> None:
    def fields(points: np.ndarray) -> np.ndarray:
        return np.stack([np.linalg.norm(points, axis=1) - 1.2, np.ones(len(points))]).astype(np.float32)

    cut, nothing = SparseLattice(fields, 1.0, 32, lipschitz=1.0).meshes()
    assert nothing is None
    assert cut is not None
    assert cut.is_watertight
    assert np.abs(cut.vertices).max() <= 1.0


@pytest.mark.parametrize(
    ("wall", "resolution", "cells"),
    [(0.5, 64, 64), (0.5, 60, 64), (0.02, 64, 200), (0.001, 64, 256), (np.inf, 128, 128), (0.001, 300, 304)],
)
def test_thin_walls_are_given_two_cells_as_far_as_that_goes(wall: float, resolution: int, cells: int) -> None:
    assert resolution_for_wall(wall, resolution) == cells


def test_a_shell_thinner_than_a_usual_cell_comes_out_whole() -> None:
    wall = 0.012

    def shell(points: np.ndarray) -> np.ndarray:
        radius = np.linalg.norm(points, axis=1)
        return (np.abs(radius - 0.5) - wall / 2)[None].astype(np.float32)

    usual, fine = (
        SparseLattice(shell, 1.0, n, 1.0).meshes()[0] for n in (128, resolution_for_wall(wall, 128))
    )
    assert fine.euler_number == 4  # two spheres, one in the other
    assert abs(usual.euler_number) > 100  # shreds
    assert fine.volume == pytest.approx(4 * np.pi * 0.5**2 * wall, rel=0.03)


def test_nothing_inside_is_no_surface() -> None:
    lattice = SparseLattice(lambda points: np.full((2, len(points)), 5.0, np.float32), 1.0, 64, 1.0)
    assert lattice.meshes() == [None, None]


def test_far_from_all_cuboids_nothing_is_asked(model: Model, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same surfaces to the vertex, of fewer points."""
    shape = NeuralShape.trained(model, "lamp1")
    near = mesh_shape(shape, 64)
    monkeypatch.setattr(meshing, "_near_cuboids", lambda shape: None)
    everywhere = mesh_shape(shape, 64)
    assert near.parts.keys() == everywhere.parts.keys()
    pairs = [(near.parts[n], everywhere.parts[n]) for n in near.parts]
    for one, other in [(near.whole, everywhere.whole), *pairs]:
        np.testing.assert_allclose(
            one.vertices[np.lexsort(one.vertices.T)], other.vertices[np.lexsort(other.vertices.T)], atol=1e-5
        )
    assert near.evaluations < 0.95 * everywhere.evaluations


def test_parts_alone_are_those_of_the_whole(model: Model) -> None:
    shape = NeuralShape.trained(model, "lamp1")
    found, alone = mesh_shape(shape, 64).parts, meshing.mesh_parts(shape, 64)
    assert found.keys() == alone.keys()
    for name, mesh in found.items():
        assert np.array_equal(mesh.vertices, alone[name].vertices)
        assert np.array_equal(mesh.faces, alone[name].faces)


def test_progress_rises_to_one_and_can_end_the_work(model: Model) -> None:
    shape = NeuralShape.trained(model, "lamp1")
    told: list[float] = []
    mesh_shape(shape, 96, progress=told.append)
    assert len(told) > 3
    assert all(0 < share <= 1 for share in told)
    assert told[-1] > 0.5

    def stop(share: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        mesh_shape(shape, 96, progress=stop)


def test_distances_do_not_depend_on_the_number_of_cores(model: Model) -> None:
    shape = NeuralShape.trained(model, "lamp1")
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3)).astype(np.float32)
    before = torch.get_num_threads()
    try:
        torch.set_num_threads(1)
        alone = shape.part_distances(points)
        torch.set_num_threads(3)
        np.testing.assert_array_equal(shape.part_distances(points), alone)
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(before)


@pytest.mark.parametrize(("wall", "cells"), [(0.2, 64), (0.05, 80), (0.001, 192)])
def test_pictures_are_finer_for_thin_walls(
    model: Model, monkeypatch: pytest.MonkeyPatch, wall: float, cells: int
) -> None:
    monkeypatch.setattr(NeuralShape, "walls", np.array([1.0, wall]))
    shape = NeuralShape.trained(model, "lamp1")
    assert picture_resolution(shape) == cells
    assert picture_resolution(shape, shape, most=160) == min(cells, 160)  # of a film
