"""Repeated parts: one leaf with several instances is the union of its moved copies, wherever it stands."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch
from hypothesis import given, settings

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.file_text import to_text
from partwright.assembly.files import from_text
from partwright.assembly.rows import rows
from partwright.errors import AssemblyFileError, ParameterError
from partwright.fields import Box, Sphere
from partwright.meshing import mesh_part
from partwright.metrics.overlap import overlap
from tests.assembly.strategies import ASSEMBLIES, PARTS, SIMILARITIES

POINTS = np.random.default_rng(0).uniform(-2, 2, (300, 3))
QUARTER = Similarity(1.0, (1.0, 0.0, 0.0, 1.0))
LEG = Part(
    Sphere(0.2), (1.0, 0.0, 0.0), name="leg", instances=(QUARTER, QUARTER @ QUARTER, QUARTER.inverse())
)
PLACES = [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)]


def test_copies_stand_where_the_moves_take_them() -> None:
    assert np.allclose([copy.translation for copy in LEG.copies], PLACES)
    expected = np.min([np.linalg.norm(POINTS - p, axis=1) for p in PLACES], axis=0) - 0.2
    assert np.allclose(LEG.distance(POINTS), expected, atol=1e-6)
    assert np.allclose(LEG.bounds(), [[-1.2, -1.2, -0.2], [1.2, 1.2, 0.2]], atol=2e-3)
    assert rows([LEG]).shape == (4, 16)


def test_a_repeated_part_is_one_leaf() -> None:
    table = Assembly((Part(Box((2, 2, 0.1)), name="top"), LEG))
    assert len(table) == 2
    values = table.part_distances(POINTS)
    assert values.shape == (2, len(POINTS))
    assert np.allclose(values[1], LEG.distance(POINTS), atol=1e-6)


@settings(max_examples=60)
@given(ASSEMBLIES)
def test_instances_equal_the_union_of_the_moved_copies(assembly: Assembly) -> None:
    apart = assembly.expanded()
    assert not any(part.instances for part in apart.parts)
    assert len(apart) == sum(len(part.copies) for part in assembly.parts)
    size = max(float(np.ptp(assembly.bounds(), axis=0).max()), 4.0)
    assert np.abs(assembly.distance(POINTS) - apart.distance(POINTS)).max() < 2e-5 * size


@settings(max_examples=40)
@given(PARTS)
def test_a_part_is_the_blended_union_of_its_copies(part: Part) -> None:
    expected = Assembly(part.copies).distance(POINTS)
    assert np.allclose(part.distance(POINTS), expected, atol=1e-4)
    torched = part.distance(torch.tensor(POINTS)).numpy()
    assert np.allclose(torched, expected, atol=1e-4)


@settings(max_examples=40)
@given(PARTS, SIMILARITIES)
def test_similarities_take_the_copies_along(part: Part, move: Similarity) -> None:
    moved = part.transformed(move)
    assert all(instance.scale == 1.0 for instance in moved.instances)
    for copy, original in zip(moved.copies, part.copies, strict=True):
        assert np.allclose(copy.translation, move(np.array(original.translation)), atol=1e-9)


def test_bounds_of_subtracted_and_shared_copies() -> None:
    plate = Part(Box((4, 4, 1)))
    assert np.allclose((plate - LEG).bounds(), plate.bounds())
    assert np.allclose((plate & LEG).bounds(), LEG.bounds(), atol=2e-3)
    expected = np.maximum(plate.distance(POINTS), -LEG.distance(POINTS))
    assert np.allclose((plate - LEG).distance(POINTS), expected, atol=1e-5)


def test_file_lists_the_moves_and_old_files_load() -> None:
    text = to_text(Assembly((LEG,)))
    entry = json.loads(text)["children"][0]
    assert entry["instances"][1] == {"translation": [0, 0, 0], "rotation": pytest.approx([0, 0, 0, 1])}
    assert from_text(text) == Assembly((LEG,))
    assert "instances" not in to_text(Assembly((Part(Sphere(1.0)),)))


@pytest.mark.parametrize(
    ("instances", "message"),
    [
        ({}, r"children\[0\].instances: expected a list, got an object"),
        ([3], r"children\[0\].instances\[0\]: expected an object, got 3"),
        ([{"scale": 2}], r"instances\[0\].scale: unknown key; expected rotation, translation"),
        ([{"rotation": "x"}], r"instances\[0\].rotation: expected a list"),
        ([{}, {"translation": [0, 1]}], r"instances\[1\].translation: expected 3 numbers"),
        ([{"rotation": [0, 0, 0, 0]}], r"instances\[0\].rotation: .* is no rotation"),
        ([{}] * 100_000, "more than 100,000 parts, counting every instance"),
    ],
)
def test_broken_instances_are_refused(instances: object, message: str) -> None:
    data = json.loads(to_text(Assembly((LEG,))))
    data["children"][0]["instances"] = instances
    with pytest.raises(AssemblyFileError, match=message):
        from_text(json.dumps(data))


def test_instances_must_be_rigid() -> None:
    with pytest.raises(ParameterError, match=r"instances\[0\]: expected a Similarity of scale 1"):
        Part(Sphere(1.0), instances=(Similarity(2.0),))
    with pytest.raises(ParameterError, match=r"instances\[1\]"):
        Part(Sphere(1.0), instances=(QUARTER, (1, 0, 0, 0)))


def test_mesh_holds_every_copy() -> None:
    mesh = mesh_part(LEG, resolution=24)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 * 4 / 3 * np.pi * 0.2**3, rel=0.03)
    assert np.allclose(mesh.bounds, LEG.bounds(), atol=0.02)


def test_copies_that_overlap_count_as_overlap() -> None:
    ball = Part(Sphere(0.5), instances=(Similarity(1.0, translation=(0.5, 0, 0)),))
    alone = Assembly((Part(Sphere(0.5)), Part(Sphere(0.5), (0.5, 0, 0))))
    assert overlap(alone) > 0.1
    assert overlap(Assembly((ball,))) == pytest.approx(overlap(alone))
