"""The pipe: exact distances, bounds, what it refuses, and its mesh."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given
from hypothesis import strategies as st

import partwright as pw
from partwright.errors import ParameterError
from partwright.fields import Cylinder, Pipe, Torus, Tube, from_dict
from partwright.fields.bent_path import Bend
from partwright.meshing.pipes import piped

PATH = ((0.0, 0.0, 0.0), (4.0, 0.0, 0.0, 1.0), (4.0, 3.0, 0.0, 1.2), (4.0, 3.0, 3.0, 1.1), (1.0, 3.0, 3.0))
ROD, TUBE = Pipe(PATH, 0.5), Pipe(PATH, 0.5, 0.2)


def _mesh(pipe: Pipe, tolerance: float) -> trimesh.Trimesh:
    mesh = piped(pipe, tolerance).to_mesh64()
    return trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts))


@pytest.mark.parametrize("pipe", [ROD, TUBE], ids=["rod", "tube"])
def test_the_distance_is_that_to_the_surface(pipe: Pipe) -> None:
    mesh = _mesh(pipe, 1e-3)
    points = np.random.default_rng(0).uniform(-2, 6, (400, 3))
    away = np.abs(trimesh.proximity.ProximityQuery(mesh).on_surface(points)[1])
    true = np.where(mesh.contains(points), -away, away)
    np.testing.assert_allclose(pipe(points), true, atol=2e-3)


def test_a_straight_pipe_is_a_cylinder_and_with_a_wall_a_tube() -> None:
    points = np.random.default_rng(1).uniform(-2, 2, (2000, 3))
    path = ((0.0, 0.0, -0.9), (0.0, 0.0, 0.9))
    np.testing.assert_allclose(Pipe(path, 0.6)(points), Cylinder(0.6, 1.8)(points), atol=1e-6)
    np.testing.assert_allclose(Pipe(path, 0.6, 0.2)(points), Tube(0.6, 0.2, 1.8)(points), atol=1e-6)


def test_a_bend_is_part_of_a_torus() -> None:
    pipe = Pipe(((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 1.0), (1.0, 1.0, 0.0)), 0.3)
    assert [type(piece) for piece in pipe.pieces] == [Bend]
    points = np.random.default_rng(2).uniform((0.1, -0.2, -0.45), (1.0, 0.7, 0.45), (2000, 3))
    beside = np.minimum(points[:, 0], 1 - points[:, 1]) > 0.45  # where no end is as near as the wall
    torus = Torus(1.0, 0.3)(points - (0.0, 1.0, 0.0))
    np.testing.assert_allclose(pipe(points)[beside], torus[beside], atol=1e-6)
    assert beside.sum() > 100


@given(
    st.lists(st.tuples(*[st.floats(-5, 5)] * 3), min_size=2, max_size=5),
    st.floats(0.05, 0.4),
    st.floats(0.0, 0.9),
    st.integers(0, 1000),
)
def test_laws_of_any_pipe(places: list[Any], radius: float, share: float, seed: int) -> None:
    """Bounds hold the inside, distances change by no more than the way between points, and a pipe twice as
    large is twice as far away."""
    try:
        pipe = Pipe(tuple((*place, 1.5 * radius) for place in places), radius, share * radius)
    except ParameterError:
        return
    rng = np.random.default_rng(seed)
    low, high = pipe.bounds()
    points = rng.uniform(low - 0.3, high + 0.3, (300, 3))
    values = pipe(points)
    inside = points[values < -1e-6]
    assert (inside >= low - 1e-6).all()
    assert (inside <= high + 1e-6).all()
    other = rng.uniform(low - 0.3, high + 0.3, (300, 3))
    way = np.linalg.norm(points - other, axis=1)
    assert (np.abs(values - pipe(other)) <= way + 1e-5).all()
    np.testing.assert_allclose(pipe.scaled(2.0)(2 * points), 2 * values, atol=1e-5)
    tensor = torch.tensor(points, requires_grad=True)
    distance = pipe(tensor)
    np.testing.assert_allclose(distance.detach().numpy(), values, atol=1e-5)
    (slope,) = torch.autograd.grad(distance.sum(), tensor)
    assert (slope.norm(dim=1) < 1 + 1e-6).all()
    assert from_dict(pipe.to_dict()) == pipe


@pytest.mark.parametrize("pipe", [ROD, TUBE, Pipe(PATH[:2], 0.5)], ids=["rod", "tube", "straight"])
def test_its_mesh_is_closed_and_of_the_volume_that_the_length_tells(pipe: Pipe) -> None:
    mesh = _mesh(pipe, 1e-3)
    area = math.pi * (pipe.radius**2 - pipe.bore**2)
    assert mesh.is_watertight
    assert mesh.euler_number == (0 if pipe.bore else 2)
    assert mesh.volume == pytest.approx(area * pipe.length, rel=5e-3)
    assert np.abs(pipe(mesh.vertices)).max() < 1e-6
    low, high = pipe.bounds()
    np.testing.assert_allclose(mesh.bounds, [low, high], atol=2e-3)


def test_half_a_turn_is_two_corners() -> None:
    hook = Pipe(((0, 0, 0), (3, 0, 0, 1), (3, 2, 0, 1), (0, 2, 0)), 0.4)
    assert hook.length == pytest.approx(4 + math.pi)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"path": ((0, 0, 0),)}, "two at least"),
        ({"path": ((0, 0, 0), (0, 0, 0), (1, 0, 0))}, r"path\[0\] and the corner after it are the same"),
        ({"path": ((0, 0, 0), (1, 0))}, r"path\[1\] is .* expected x, y, z"),
        ({"path": ((0, 0, 0), (math.nan, 0, 0))}, r"path\[1\]"),
        ({"path": ((0, 0, 0), (1, 0, 0, 2.0), (1, 1, 0))}, r"bend of path\[1\] takes 2 .* smaller bend"),
        ({"path": ((0, 0, 0), (1, 0, 0, 0.1), (1, 1, 0))}, "expected more than the radius"),
        ({"path": ((0, 0, 0), (5, 0, 0, 0.3), (0, 0.01, 0))}, "half a turn is two corners"),
        (
            {"path": ((0, 0, 0), (5, 0, 0, 0.3), (5, 5, 0, 0.3), (2, 5, 0, 0.3), (2, -3, 0))},
            "runs into itself",
        ),
        ({"radius": 0.0}, "radius"),
        ({"thickness": 0.3}, "expected less than the radius"),
    ],
)
def test_bad_numbers_are_told(changes: dict[str, Any], says: str) -> None:
    with pytest.raises(ParameterError, match=says):
        Pipe(**{"path": ((0, 0, 0), (2, 0, 0, 1.0), (2, 2, 0)), "radius": 0.2} | changes)


def test_a_part_goes_through_a_file_and_is_measured(tmp_path: Any) -> None:
    part = pw.Part(TUBE, translation=(1.0, 2.0, 3.0), name="handle")
    pw.Assembly([part]).save(tmp_path / "pipe.json")
    again = pw.load_assembly(tmp_path / "pipe.json")
    assert again.parts[0].field == TUBE
    points = np.random.default_rng(3).uniform(-2, 6, (100, 3))
    np.testing.assert_allclose(again.distance(points), TUBE(points - (1.0, 2.0, 3.0)), atol=1e-5)
