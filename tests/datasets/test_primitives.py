"""Primitives are found as they were made, and a family's namings of the axes agree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from partwright.datasets.agreement import AXIS_NAMINGS, agreed
from partwright.datasets.primitives import (
    CUBOID,
    CYLINDER,
    THINNEST,
    PrimitiveFit,
    _on_cuboid,
    _on_cylinder,
    fit_primitives,
)

turns = st.tuples(*[st.floats(-3, 3)] * 3).map(lambda v: Rotation.from_rotvec(v).as_matrix())


def box(scale: np.ndarray, turn: np.ndarray, place: np.ndarray) -> np.ndarray:
    return np.asarray(trimesh.creation.box(2 * scale).vertices) @ turn.T + place


def best(fits: list[PrimitiveFit], kind: str) -> PrimitiveFit:
    return min((fit for fit in fits if fit.kind == kind), key=lambda fit: fit.chamfer)


@settings(max_examples=8)
@given(turns)
def test_a_turned_cuboid_is_found(turn: np.ndarray) -> None:
    scale, place = np.array([0.3, 0.5, 0.1]), np.array([0.1, -0.2, 0.3])
    fit = best(fit_primitives(box(scale, turn, place)), CUBOID)
    np.testing.assert_allclose(np.sort(fit.scale), np.sort(scale), atol=0.01)
    np.testing.assert_allclose(fit.translation, place, atol=0.01)
    angles = [np.abs(Rotation.from_matrix(fit.rotation @ m @ turn.T).magnitude()) for m in AXIS_NAMINGS]
    assert np.degrees(min(angles)) < 2
    assert fit.chamfer < 2e-3
    assert np.linalg.det(fit.rotation) == pytest.approx(1)


@settings(max_examples=8)
@given(turns)
def test_a_turned_cylinder_is_found_and_is_no_cuboid(turn: np.ndarray) -> None:
    made = trimesh.creation.cylinder(radius=0.3, height=0.8, sections=48)
    fits = fit_primitives(np.asarray(made.vertices) @ turn.T)
    fit = best(fits, CYLINDER)
    np.testing.assert_allclose(fit.scale, [0.3, 0.3, 0.4], atol=0.015)
    assert abs(fit.rotation[:, 2] @ turn[:, 2]) > np.cos(np.radians(2))
    assert fit.chamfer < 0.8 * best(fits, CUBOID).chamfer


def test_a_flat_part_keeps_a_thickness() -> None:
    flat = np.array([[-0.5, -0.2, 0], [0.5, -0.2, 0], [0.5, 0.2, 0], [-0.5, 0.2, 0]], dtype=np.float64)
    fit = best(fit_primitives(flat), CUBOID)
    assert fit.scale.min() == pytest.approx(THINNEST)
    np.testing.assert_allclose(np.sort(fit.scale)[1:], [0.2, 0.5], atol=0.02)


def test_nearest_points_lie_on_the_surface_and_none_of_it_is_nearer() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (200, 3))
    scale = np.array([0.5, 0.4, 0.6])
    made = trimesh.creation.box(2 * scale)
    expected = trimesh.proximity.closest_point(made, points)[1]
    found = _on_cuboid(points, scale)
    np.testing.assert_allclose(np.linalg.norm(found - points, axis=1), expected, atol=1e-9)
    np.testing.assert_allclose(np.abs(found / scale).max(axis=1), 1, atol=1e-12)
    round_scale = np.array([0.5, 0.5, 0.6])
    made = trimesh.creation.cylinder(radius=0.5, height=1.2, sections=256)
    expected = trimesh.proximity.closest_point(made, points)[1]
    found = _on_cylinder(points, round_scale)
    np.testing.assert_allclose(np.linalg.norm(found - points, axis=1), expected, atol=1e-3)


def renamed(fit: PrimitiveFit, rng: np.random.Generator) -> PrimitiveFit:
    naming = AXIS_NAMINGS[rng.integers(24)]
    return replace(fit, rotation=fit.rotation @ naming, scale=np.abs(naming.T) @ fit.scale)


def family_of_cuboids(scale: tuple[float, float, float], wobble: float) -> list[list[PrimitiveFit]]:
    """Twelve nearly equal cuboids, each with its axes named at random."""
    rng = np.random.default_rng(0)
    shapes = []
    for _ in range(12):
        turn = Rotation.from_rotvec(rng.normal(0, wobble, 3)).as_matrix()
        size = np.array(scale) * np.exp(rng.normal(0, 0.05, 3))
        cuboid = PrimitiveFit(CUBOID, turn, np.zeros(3), size, 1e-3)
        round_one = PrimitiveFit(CYLINDER, turn, np.zeros(3), size[[0, 0, 2]], 1e-1)
        shapes.append([renamed(cuboid, rng), round_one])
    return shapes


@pytest.mark.parametrize("scale", [(0.1, 0.2, 0.4), (0.3, 0.3, 0.3), (0.3, 0.3, 0.05)])
def test_all_cuboids_of_a_family_get_one_naming(scale: tuple[float, float, float]) -> None:
    """Also where symmetry leaves it open."""
    chosen = agreed(family_of_cuboids(scale, wobble=0.05))
    assert {fit.kind for fit in chosen} == {CUBOID}
    for fit in chosen:
        apart = Rotation.from_matrix(fit.rotation @ chosen[0].rotation.T).magnitude()
        assert np.degrees(apart) < 25
        np.testing.assert_allclose(np.log(fit.scale), np.log(chosen[0].scale), atol=0.4)
    assert Rotation.from_matrix(chosen[0].rotation).magnitude() < 0.4  # the world's axes, where they do


def test_cylinders_agree_on_their_turn_and_their_ends() -> None:
    rng = np.random.default_rng(1)
    shapes = []
    for _ in range(12):
        tilt = Rotation.from_rotvec([0, np.pi / 2 + rng.normal(0, 0.05), rng.normal(0, 0.05)])
        spin = Rotation.from_rotvec([0, 0, rng.uniform(0, 2 * np.pi)])
        over = Rotation.from_rotvec([np.pi * rng.integers(2), 0, 0])
        turn = (tilt * over * spin).as_matrix()
        fit = PrimitiveFit(CYLINDER, turn, np.zeros(3), np.array([0.2, 0.2, 0.5]), 1e-4)
        shapes.append([fit, PrimitiveFit(CUBOID, np.eye(3), np.zeros(3), np.ones(3), 1e-1)])
    chosen = agreed(shapes)
    for fit, (own, _) in zip(chosen, shapes, strict=True):
        assert fit.kind == CYLINDER
        assert abs(fit.rotation[:, 2] @ own.rotation[:, 2]) == pytest.approx(1)
        assert np.degrees(Rotation.from_matrix(fit.rotation @ chosen[0].rotation.T).magnitude()) < 20


def test_a_fit_as_good_as_the_best_may_be_taken_but_no_worse_one() -> None:
    straight = PrimitiveFit(CUBOID, np.eye(3), np.zeros(3), np.full(3, 0.3), 1.1e-3)
    turned = replace(straight, rotation=Rotation.from_rotvec([0.5, 0, 0]).as_matrix(), chamfer=1e-3)
    bad = replace(straight, kind=CYLINDER, chamfer=1.0)
    same = [straight, bad]
    assert agreed([same, same, [turned, straight, bad]])[2] is not None
    chosen = agreed([same, same, [turned, straight, bad]])[2]
    np.testing.assert_allclose(chosen.rotation, np.eye(3), atol=1e-12)
    chosen = agreed([same, same, [turned, replace(straight, chamfer=2e-3), bad]])[2]
    assert Rotation.from_matrix(chosen.rotation).magnitude() == pytest.approx(0.5)
