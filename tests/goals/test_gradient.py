"""Gradients through the surface: against finite differences, and against numbers known exactly."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import ParameterError
from partwright.fields import Box, Cylinder, Field, Quadric, Sphere, SuperFrustum, Tube
from partwright.goals import Parameters, parameter_gradient
from partwright.goals.surface import surface_of
from partwright.meshing import mesh_assembly

BELOW = 1e-6  # on the surface itself a distance from outside has no slope
TILTED = (0.9, 0.2, -0.3, 0.1)
FRUSTUM = SuperFrustum((1.0, 0.8, 1.3), 0.4, 0.1, 0.7, 0.2, 0.3)


def volume(vertices: np.ndarray, faces: np.ndarray) -> tuple[float, np.ndarray]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    sensitivity = np.zeros_like(vertices)
    for k, cross in enumerate((np.cross(b, c), np.cross(c, a), np.cross(a, b))):
        np.add.at(sensitivity, faces[:, k], cross / 6)
    return float((a * np.cross(b, c)).sum() / 6), sensitivity


def volume_slopes(assembly: Assembly, resolution: int = 64) -> dict[str, float]:
    parameters = Parameters(assembly)
    mesh = surface_of(assembly, resolution)
    gradient = parameter_gradient(parameters, mesh.vertices, mesh.faces, volume(mesh.vertices, mesh.faces)[1])
    return {parameters.name(i): value for i, value in enumerate(gradient)}


def normal_moves(assembly: Assembly, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(N,) how far the level lies along each normal: Newton's method in double precision."""
    places, directions, far = torch.tensor(points), torch.tensor(normals), torch.zeros(len(points)).double()
    for _ in range(3):
        far.requires_grad_()
        value = assembly.distance(places + far[:, None] * directions)
        (slope,) = torch.autograd.grad(value.sum(), far)
        far = (far - (value + BELOW) / slope).detach()
    return far.numpy()


@pytest.mark.parametrize(
    "parts",
    [
        (Part(Sphere(0.7), (0.1, 0.2, -0.1)),),
        (Part(FRUSTUM, (0.2, 0.1, -0.3), TILTED),),
        (Part(Box((1.0, 0.8, 0.6)), (0, 0, 0.2), TILTED), Part(Sphere(0.45), (0.5, 0.2, 0.3), blend=0.15)),
        (Part(Tube(0.5, 0.2, 0.9), rotation=TILTED), Part(FRUSTUM, (0.6, 0.1, 0.1), blend=0.1)),
        (
            Part(Cylinder(0.4, 1.0), (0.3, 0, 0), TILTED, instances=(Similarity(1, TILTED, (0.5, 0, 0)),)),
            Part(Quadric((2.0, 3.0, 4.0, 0.1, 0, 0, -1.0)), (-0.4, 0, 0)),
        ),
    ],
    ids=["sphere", "eight parameters", "blended", "tube", "copies and quadric"],
)  # fmt: skip
def test_normal_speeds_are_those_of_finite_differences(parts: tuple[Part, ...]) -> None:
    """Where the surface is smooth: along its normals, a random loss, all parameters, double precision."""
    assembly = Assembly(parts)
    parameters = Parameters(assembly)
    mesh = mesh_assembly(assembly, 24, exact=False)
    points = torch.tensor(np.array(mesh.triangles_center), requires_grad=True)
    for _ in range(3):  # onto the surface
        (slope,) = torch.autograd.grad(assembly.distance(points).sum(), points)
        step = ((assembly.distance(points).detach() + BELOW) / slope.square().sum(1))[:, None] * slope
        points = (points - step).detach().requires_grad_()
    (slope,) = torch.autograd.grad(assembly.distance(points).sum(), points)
    normals = (slope / slope.norm(dim=1, keepdim=True)).numpy()
    smooth = np.flatnonzero((normals * mesh.face_normals).sum(1) > 0.999)
    smooth = smooth[:: max(1, len(smooth) // 40)]
    places, normals = points.detach().numpy()[smooth], normals[smooth]
    # Triangles of their own around each place, so that each is a vertex on one smooth sheet.
    across = np.cross(normals, np.eye(3)[np.abs(normals).argmin(1)])
    other = np.cross(normals, across)
    vertices = np.concatenate([places, places + 1e-3 * across, places + 1e-3 * other])
    count = len(places)
    faces = np.arange(3 * count).reshape(3, count).T
    weights = np.random.default_rng(0).normal(size=count)
    loss = np.zeros_like(vertices)
    loss[:count] = weights[:, None] * normals
    gradient = parameter_gradient(parameters, vertices, faces, loss)

    for i, value in enumerate(parameters.values):
        step = np.zeros(len(parameters))
        step[i] = 1e-5 if parameters.lower[i] < value < parameters.upper[i] else 0.0
        if not step[i]:
            continue
        there, back = (
            normal_moves(parameters.with_values(parameters.values + s * step), places, normals)
            for s in (1, -1)
        )
        moved = (there - back) / 2e-5
        calm = np.abs(moved) < 20  # a place that a seam of two sheets has passed over jumps
        assert calm.mean() > 0.9
        expected = (weights * moved)[calm].sum()
        least = np.abs(weights * moved)[calm].sum()
        if calm.all():
            assert gradient[i] == pytest.approx(expected, abs=2e-3 * least + 1e-6), parameters.name(i)


def test_volume_of_a_sphere_and_a_box_is_exact() -> None:
    ball = volume_slopes(Assembly((Part(Sphere(0.7), name="ball"),)), 96)
    assert ball["ball.radius"] == pytest.approx(4 * np.pi * 0.7**2, rel=3e-3)
    assert abs(ball["ball.tx"]) < 1e-6

    box = volume_slopes(Assembly((Part(Box((3.0, 2.0, 1.0)), rotation=TILTED, name="box"),)), 32)
    sides = [box[f"box.size_{axis}"] for axis in "xyz"]
    assert sides == pytest.approx([2.0, 3.0, 6.0], rel=1e-6)
    assert box["box.wx"] == pytest.approx(0, abs=0.01)


def test_edges_move_with_both_of_their_faces_in_a_coarse_marched_mesh() -> None:
    assembly = Assembly((Part(SuperFrustum((3.0, 2.0, 1.0)), (0.3, 0.1, 0.2), TILTED, name="box"),))
    box = volume_slopes(assembly, 12)
    assert [box[f"box.size_{a}"] for a in "xyz"] == pytest.approx([2.0, 3.0, 6.0], rel=0.05)


def test_volume_of_a_composite_is_that_of_finite_differences() -> None:
    assembly = Assembly(
        (
            Part(Box((2.0, 1.0, 1.0)), name="bar"),
            Part(Sphere(0.6), (0.9, 0.1, 0.2), name="end"),
            Part(Box((0.5, 0.5, 0.2)), (0.1, 0.05, 0.57), name="boss"),
        )
    ) - Part(Cylinder(0.2, 2.0), (-0.5, 0, 0), name="hole")
    parameters = Parameters(assembly)
    slopes = volume_slopes(assembly, 128)
    for name in ("bar.size_y", "end.radius", "end.tx", "hole.radius", "hole.tx", "boss.tz", "boss.size_x"):
        i = next(i for i in range(len(parameters)) if parameters.name(i) == name)
        step = np.zeros(len(parameters))
        step[i] = 1e-4
        there, back = (
            mesh_assembly(parameters.with_values(parameters.values + s * step), 128).volume for s in (1, -1)
        )
        assert slopes[name] == pytest.approx((there - back) / 2e-4, rel=0.02, abs=0.01), name


def test_parts_that_do_not_move_keep_their_bits() -> None:
    legs = Part(Cylinder(0.1, 1.0), (0.1 + 0.2, 0, 0), TILTED, name="leg", instances=(Similarity(),))
    assembly = Assembly((Part(Box((1.0, 1.0, 0.1)), name="top"), legs))
    parameters = Parameters(assembly)
    values = parameters.values.copy()
    values[:3] += 0.1
    moved = parameters.with_values(values)
    assert moved["leg"] == assembly["leg"]
    assert moved["leg"].field is assembly["leg"].field
    assert moved["top"].translation == (0.1, 0.1, 0.1)


def test_a_form_goes_as_far_as_its_field_allows() -> None:
    assembly = Assembly((Part(Tube(1.0, 0.5, 2.0), name="tube"),))
    parameters = Parameters(assembly)
    values = parameters.values.copy()
    values[[parameters.name(i) == "tube.thickness" for i in range(len(parameters))]] = 1.2
    field: Field = parameters.with_values(values)["tube"].field
    assert isinstance(field, Tube)
    assert 0.6 < field.thickness < 1.0


def test_a_sensitivity_of_another_shape_or_nan_is_refused() -> None:
    assembly = Assembly((Part(Sphere(1.0)),))
    mesh = mesh_assembly(assembly, 16)
    for wrong in (np.zeros(3), np.full(mesh.vertices.shape, np.nan)):
        with pytest.raises(ParameterError, match="sensitivity"):
            parameter_gradient(Parameters(assembly), mesh.vertices, mesh.faces, wrong)
