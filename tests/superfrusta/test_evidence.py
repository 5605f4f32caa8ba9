"""Samples that a fit adds where an assembly is astray."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.shapes import load_shape
from partwright.superfrusta.evidence import Evidence
from partwright.superfrusta.objective import score
from partwright.superfrusta.settings import Settings

SETTINGS = Settings.for_quality("draft", threads=1)


@pytest.fixture
def box() -> Evidence:
    """Of a box 1.8 x 0.9 x 0.9."""
    mesh = trimesh.creation.box((1.8, 0.9, 0.9))
    return Evidence.of(load_shape(mesh), SETTINGS)


def bar(reach: float, radius: float = 0.04) -> np.ndarray:
    """The box, and a thin bar along z that ends `reach` above its middle."""
    row = np.zeros((2, 16), np.float32)
    row[:, 3], row[:, 12] = 1.0, 1.0
    row[0, 7:10] = 1.8, 0.9, 0.9
    row[1, 7:10] = 2 * radius, 2 * radius, 2 * reach
    return row


def test_nothing_is_learned_from_an_assembly_that_stays_near_the_shape(box: Evidence) -> None:
    count = len(box.points)
    assert not box.learn(bar(0.3))
    assert len(box.points) == count
    assert box.astray(bar(0.3)).tolist() == [0.0, 0.0]


def test_a_thin_bar_that_shoots_out_is_met_and_weighs_its_volume(box: Evidence) -> None:
    stray = bar(1.0)
    count, before = len(box.points), score(box, stray)
    weights = box.astray(stray)
    assert box.learn(stray)
    points, distance = box.points[count:], box.distance[count:]
    assert (np.abs(points[:, :2]) <= 0.04 + 1e-6).all()
    assert (np.abs(points[:, 2]) <= 1.0).all()
    height = np.abs(points[:, 2]) - 0.45
    np.testing.assert_allclose(distance, height, atol=1e-4)
    assert distance.min() > 0.05
    # both ends stick out by 0.55, of which the nearest 0.05 is no stray
    volume = 2 * 0.5 * 0.08**2
    assert weights[1] == pytest.approx(box.weight[count:].sum(), rel=0.1)  # some are nearer than a stray is
    assert weights[1] / box.density == pytest.approx(volume, rel=0.35)
    assert weights[0] == 0
    assert score(box, stray) < before
    assert len(box.inside) == len(box.voxel) == len(box.points)
    assert set(range(count, len(box.points))) & set(box.training.tolist())


def test_what_is_known_is_not_learned_again(box: Evidence) -> None:
    assert box.learn(bar(1.0))
    count = len(box.points)
    assert not box.learn(bar(1.0))
    assert len(box.points) == count
