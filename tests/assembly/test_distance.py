"""Assemblies against closed forms, against the torch reference, and under moves, at any size and place."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.tree import Operation
from partwright.errors import ParameterError
from partwright.fields import Box, Extrusion, Profile, Sphere
from partwright.fields.operations import smooth_union
from partwright.fields.swept import Swept
from tests.assembly.strategies import ASSEMBLIES, PARTS, SIMILARITIES, SWEPT
from tests.counting import points_asked

POINTS = np.random.default_rng(0).uniform(-2, 2, (400, 3))


def length(points: np.ndarray, centre: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    return np.linalg.norm(points - np.array(centre), axis=1)


def test_operations_are_exact_for_spheres() -> None:
    a, b = Part(Sphere(1.0)), Part(Sphere(0.5), (1, 0, 0))
    da, db = length(POINTS) - 1.0, length(POINTS, (1, 0, 0)) - 0.5
    assert np.allclose((a | b).distance(POINTS), np.minimum(da, db), atol=1e-6)
    assert np.allclose((a - b).distance(POINTS), np.maximum(da, -db), atol=1e-6)
    assert np.allclose((a & b).distance(POINTS), np.maximum(da, db), atol=1e-6)


def test_union_folds_first_to_last_each_child_with_its_own_blend() -> None:
    spheres = [Part(Sphere(0.5), (0.4 * i, 0, 0), blend=0.1 * i) for i in range(4)]
    expected = length(POINTS) - 0.5
    for i in range(1, 4):
        expected = smooth_union(expected, length(POINTS, (0.4 * i, 0, 0)) - 0.5, 0.1 * i)
    flat = Assembly(tuple(spheres))
    nested_first = Assembly((Assembly(tuple(spheres[:2])), *spheres[2:]))
    for assembly in (flat, nested_first):
        assert np.allclose(assembly.distance(POINTS), expected, atol=1e-6)


def test_nested_node_joins_with_its_own_blend() -> None:
    pair = Assembly((Part(Sphere(0.5), (1, 0, 0)), Part(Sphere(0.5), (1.5, 0, 0))), blend=0.3)
    inner = np.minimum(length(POINTS, (1, 0, 0)), length(POINTS, (1.5, 0, 0))) - 0.5
    got = Assembly((Part(Sphere(1.0)), pair)).distance(POINTS)
    assert np.allclose(got, smooth_union(length(POINTS) - 1.0, inner, 0.3), atol=1e-6)


@settings(max_examples=60)
@given(ASSEMBLIES)
def test_kernel_and_reference_agree(assembly: Assembly) -> None:
    reference = assembly.distance(torch.tensor(POINTS, dtype=torch.float64)).numpy()
    size = np.ptp(assembly.bounds(), axis=0).max()
    assert np.abs(assembly.distance(POINTS) - reference).max() < 2e-5 * max(size, 4.0)


@settings(max_examples=80)
@given(st.lists(SWEPT | PARTS, min_size=2, max_size=5), st.sampled_from(["union", "difference"]))
def test_boxes_that_are_far_away_change_nothing(parts: list[Part], operation: Operation) -> None:
    """A solid of a profile is asked only near its box, and the result is the reference."""
    assembly = Assembly(tuple(parts), operation)
    reference = assembly.distance(torch.tensor(POINTS, dtype=torch.float64)).numpy()
    assert np.abs(assembly.distance(POINTS) - reference).max() < 1e-4


def test_a_solid_of_a_profile_is_not_asked_where_it_is_far_away(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = points_asked(monkeypatch, Swept, "__call__")
    plate = Part(Extrusion(Profile.rectangle(0.2, 0.2), 0.2), (1.5, 0.0, 0.0))
    (Part(Sphere(1.0)) | plate).distance(POINTS)
    (Part(Sphere(1.0)) - plate).distance(POINTS)
    assert 0 < asked[0] < len(POINTS) / 2
    assert asked[1] < len(POINTS) / 20


def test_an_assembly_of_unit_size_answers_as_it_does_elsewhere() -> None:
    """It is evaluated where it is; all others are first brought to the unit frame."""
    assembly = Assembly(
        (Part(Box((1.6, 0.3, 0.2)), (0.4, 0.1, 0.0)), Part(Sphere(0.4), (-0.5, 0, 0.2), blend=0.1))
    )
    direct = assembly.distance(POINTS)
    move = Similarity(50.0, translation=(300.0, -20.0, 7.0))
    np.testing.assert_allclose(assembly.transformed(move).distance(move(POINTS)) / 50, direct, atol=2e-6)


def test_torch_points_get_gradients() -> None:
    points = torch.tensor([[0.9, 0.0, 0.0], [0.0, 2.0, 0.0]], dtype=torch.float64, requires_grad=True)
    (Part(Sphere(1.0)) | Part(Box((1, 1, 1)), (5, 0, 0))).distance(points).sum().backward()
    assert torch.allclose(points.grad, torch.tensor([[1.0, 0, 0], [0, 1.0, 0]], dtype=torch.float64))


@settings(max_examples=40)
@given(ASSEMBLIES, SIMILARITIES)
def test_distance_moves_with_the_assembly(assembly: Assembly, move: Similarity) -> None:
    before = assembly.distance(POINTS)
    after = assembly.transformed(move).distance(move(POINTS))
    assert np.allclose(after, move.scale * before, atol=1e-4 * move.scale)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("place", [0.0, 1e3])
def test_sizes_and_places_keep_their_digits(scale: float, place: float) -> None:
    centre = np.array([place, -place, place]) * scale
    assembly = (Part(Sphere(1.0)) | Part(Sphere(0.5), (1, 0, 0))).scaled(scale).translated(centre)
    d = np.minimum(length(POINTS) - 1.0, length(POINTS, (1, 0, 0)) - 0.5) * scale
    assert np.abs(assembly.distance(POINTS * scale + centre) - d).max() < 1e-6 * scale


def test_dtype_follows_the_points() -> None:
    part = Part(Sphere(1.0))
    assert part.distance(POINTS.astype(np.float32)).dtype == np.float32
    assert part.distance(POINTS).dtype == np.float64
    assert part.distance([[2, 0, 0]]).tolist() == pytest.approx([1.0])


def test_part_distances_are_unblended(mug: Assembly) -> None:
    values = mug.part_distances(POINTS)
    assert values.shape == (3, len(POINTS))
    for row, part in zip(values, mug.parts, strict=True):
        assert np.allclose(row, part.distance(POINTS), atol=1e-6)


def test_points_of_the_wrong_shape_are_refused(mug: Assembly) -> None:
    with pytest.raises(ParameterError, match=r"\(N, 3\), got \(3,\)"):
        mug.distance(np.zeros(3))
