"""How far the surfaces of two solids lie apart at most."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from partwright.meshing.hulls import file_hull, hull_of
from partwright.meshing.manifolds import surface_of
from partwright.robots.solids import largest_deviation
from partwright.shapes import MeshDistance


def test_what_is_missing_and_what_is_added_is_told_with_its_place() -> None:
    plate = Manifold.cube((4, 4, 1))
    peg = Manifold.cube((1, 1, 1.5)).translate((1, 1, 0.5))
    missing, added = largest_deviation(plate + peg, plate), largest_deviation(plate, plate + peg)
    assert missing.length == added.length == pytest.approx(1.0)
    assert missing.missing
    assert not added.missing
    assert missing.at[2] == pytest.approx(2.0)
    assert largest_deviation(plate, plate).length == 0


def test_narrow_triangles_are_measured_as_they_are() -> None:
    """A drum with a bulge that hardly is one, and the same as files hold it: a millionth apart."""
    turn = np.linspace(0, 2 * np.pi, 128, endpoint=False)
    rings = [
        np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(128, 8 * z)])
        for z in np.linspace(-1, 1, 5)
        for radius in [1 + 1e-5 * (1 - z * z)]
    ]
    drum = hull_of(np.concatenate(rings) @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0])
    assert largest_deviation(drum, file_hull(surface_of(drum)[0])).length < 1e-5


def test_what_lies_between_is_measured_on_its_own_surface_as_on_all_of_it() -> None:
    """What bounds a gap else is the other's surface, at no distance."""
    rng = np.random.default_rng(0)
    block = Manifold.cube((4, 4, 4), True)
    rods = Manifold.batch_boolean(
        [
            Manifold.cylinder(4.5, 0.4, circular_segments=12, center=True)
            .rotate(tuple(rng.uniform(0, 180, 3)))
            .translate(tuple(rng.uniform(-1, 1, 3)))
            for _ in range(6)
        ],
        OpType.Add,
    )
    found = largest_deviation(block, rods)
    for solid, other in ((block, rods), (rods, block)):
        vertices, faces = surface_of(other)
        points = surface_of((solid - other).refine_to_length(4 / 80))[0]
        farthest = MeshDistance(vertices, faces, faces, True).exact(points).max()
        assert largest_deviation(solid, other).length >= farthest - 1e-9
        assert found.length >= farthest - 1e-9
        if found.missing is (solid is block):
            assert found.length == pytest.approx(farthest)
