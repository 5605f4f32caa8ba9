"""Samples that a fit adds where an assembly is astray."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.fields import kernel
from partwright.fields.columns import SIZE, WIDTH, Column
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
    row = np.zeros((2, WIDTH), np.float32)
    row[:, [Column.QW, Column.TAPER, Column.SIGN]] = 1.0
    row[0, SIZE] = 1.8, 0.9, 0.9
    row[1, SIZE] = 2 * radius, 2 * radius, 2 * reach
    return row


def test_the_field_on_the_grid_is_that_of_its_points(box: FitSamples) -> None:
    field = box.distance_of(bar(1.0), box.grid_points).reshape(box.grid.values.shape)
    np.testing.assert_array_equal(box.grid_field(bar(1.0)), field)


def test_the_field_on_the_lattice_is_that_of_its_points(box: FitSamples) -> None:
    points, _ = box.lattice
    np.testing.assert_array_equal(box.lattice_field(bar(1.0)), box.distance_of(bar(1.0), points))


def test_the_field_is_that_of_the_assembly_that_is_asked_for(box: FitSamples) -> None:
    for reach in (1.0, 1.0, 0.7, 1.0):
        np.testing.assert_array_equal(box.field(bar(reach)), box.distance_of(bar(reach), box.points))
    some = np.arange(5, len(box.points), 7)
    for reach in (1.0, 0.6):  # of which the first is known
        at = box.distance_of(bar(reach), box.points[some])
        np.testing.assert_array_equal(box.field_at(bar(reach), some), at)
    more = box.with_stray_samples(bar(1.0))
    assert len(more.field(bar(1.0))) == len(more.points) > len(box.points)


def test_a_grid_to_carve_by_is_exact_where_that_takes_it() -> None:
    """What is covered too much is max(F, -S): there, beside it and in its sign all is as in the slow grid."""
    ring = trimesh.creation.annulus(0.12, 0.9, 0.6, sections=40)
    samples = FitSamples.of(load_shape(ring), SETTINGS)
    disc = np.zeros((1, WIDTH), np.float32)
    disc[0, [Column.QW, Column.TAPER, Column.SIGN, Column.ROUNDNESS]] = 1.0
    disc[0, SIZE] = 1.7, 1.7, 0.6
    corner = np.array([0.3, 0.25, 0.35])
    slow, quick = samples.about(-corner, corner), samples.about(-corner, corner, disc)
    field, spacing = slow.grid_field(disc), slow.grid.spacing
    wanted, found = (np.maximum(field, -one.grid.values) for one in (slow, quick))
    beside = wanted < spacing
    assert np.count_nonzero(wanted < 0) > 1000
    np.testing.assert_array_equal(found < spacing, beside)
    np.testing.assert_array_equal(found[beside], wanted[beside])
    assert quick.inside_voxels == slow.inside_voxels
    missed = [(one.grid.values - field > spacing)[beside] for one in (slow, quick)]
    np.testing.assert_array_equal(*missed)
    assert (quick.grid.values != slow.grid.values).mean() > 0.2  # or nothing would be saved


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


def test_a_chip_that_cuts_leave_beyond_all_probes_becomes_samples(box: FitSamples) -> None:
    """A bar whose end lies 1.6 above the middle is cut off between 0.45 and 1.3."""
    chip = np.append(bar(0.8, radius=0.05), bar(0.8)[[0]], axis=0)
    chip[1, Column.TZ] = 0.8
    chip[2, [Column.TZ, Column.SZ, Column.SIGN]] = 0.875, 0.85, -1
    assert (kernel.evaluate(chip, box.probes) > 0).all()
    more = box.with_stray_samples(chip)
    added = more.points[len(box.points) :]
    assert ((added[:, 2] > 1.3) & (added[:, 2] < 1.6)).all()
    volume = more.weight[len(box.points) :].sum() / box.density
    assert volume == pytest.approx(0.3 * 0.1**2, rel=0.2)
    assert more.with_stray_samples(chip) is more


def test_faces_between_bodies_that_meet_are_no_surface_to_cover() -> None:
    """What covers both bodies covers them: as walls of something filled they would hide all that is off."""
    halves = [trimesh.creation.box((1, 1, 1)), trimesh.creation.box((1, 1, 1))]
    for half, side in zip(halves, (-1, 1), strict=True):
        half.apply_translation((0.501 * side, 0, 0))
    shape = load_shape(trimesh.util.concatenate(halves))
    drawn = shape.unit_surface(8000, 0).points
    met = (np.abs(drawn[:, 0]) < 0.01) & (np.abs(drawn[:, 1:]).max(axis=1) < 0.43)
    assert met.sum() > 1000
    surface = FitSamples.of(shape, SETTINGS).surface
    assert surface.dtype == np.float32
    assert len(surface) == pytest.approx(len(drawn) - met.sum(), rel=0.03)
    assert not ((np.abs(surface[:, 0]) < 0.01) & (np.abs(surface[:, 1:]).max(axis=1) < 0.43)).any()
