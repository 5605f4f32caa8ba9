"""Samples that a fit adds where an assembly is astray."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.fields.columns import SIZE, UNSIGNED, Column
from partwright.shapes import load_shape
from partwright.superfrusta.objective import score
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings

SETTINGS = Settings.for_quality("draft")


@pytest.fixture
def box() -> FitSamples:
    """Of a box 1.8 x 0.9 x 0.9."""
    mesh = trimesh.creation.box((1.8, 0.9, 0.9))
    return FitSamples.of(load_shape(mesh), SETTINGS)


def bar(reach: float, radius: float = 0.04) -> np.ndarray:
    """The box, and a thin bar along z that ends `reach` above its middle."""
    row = np.zeros((2, UNSIGNED), np.float32)
    row[:, Column.QW], row[:, Column.TAPER] = 1.0, 1.0
    row[0, SIZE] = 1.8, 0.9, 0.9
    row[1, SIZE] = 2 * radius, 2 * radius, 2 * reach
    return row


def test_an_assembly_that_stays_near_the_shape_brings_no_samples(box: FitSamples) -> None:
    assert box.with_stray_samples(bar(0.3)) is box
    assert box.stray_weight(bar(0.3)).tolist() == [0.0, 0.0]


def test_a_thin_bar_that_shoots_out_is_met_and_weighs_its_volume(box: FitSamples) -> None:
    stray = bar(1.0)
    count, before = len(box.points), score(box, stray)
    weights = box.stray_weight(stray)
    more = box.with_stray_samples(stray)
    assert len(box.points) == count
    assert score(box, stray) == before
    points, distance = more.points[count:], more.distance[count:]
    assert (np.abs(points[:, :2]) <= 0.04 + 1e-6).all()
    assert (np.abs(points[:, 2]) <= 1.0).all()
    height = np.abs(points[:, 2]) - 0.45
    np.testing.assert_allclose(distance, height, atol=1e-4)
    assert distance.min() > 0.05
    # both ends stick out by 0.55, of which the nearest 0.05 is no stray
    volume = 2 * 0.5 * 0.08**2
    assert weights[1] == pytest.approx(more.weight[count:].sum(), rel=0.1)  # some are nearer than a stray is
    assert weights[1] / box.density == pytest.approx(volume, rel=0.35)
    assert weights[0] == 0
    assert score(more, stray) < before
    assert len(more.inside) == len(more.voxel) == len(more.points)
    assert set(range(count, len(more.points))) & set(more.optimised_indices.tolist())


def test_what_is_known_is_not_sampled_again(box: FitSamples) -> None:
    more = box.with_stray_samples(bar(1.0))
    assert len(more.points) > len(box.points)
    assert more.with_stray_samples(bar(1.0)) is more
