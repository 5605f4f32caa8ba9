"""Starting parts for regions of known form."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from partwright.fields.columns import ROTATION, SHAPE, SIZE, TRANSLATION, WIDTH, Column
from partwright.superfrusta.initialisation import starts, thinned
from partwright.superfrusta.limits import LIMITS

SPACING = 0.03


def voxels_of_box(size: np.ndarray, rotation: Rotation, centre: np.ndarray) -> np.ndarray:
    """Grid points (n, 3) inside a turned box."""
    reach = float(np.linalg.norm(size)) / 2 + SPACING
    axis = np.arange(-reach, reach, SPACING)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    return (points[(np.abs(rotation.inv().apply(points)) < size / 2).all(axis=1)] + centre).astype(np.float32)


def local(rows: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (K, n, 3) in the frame of each row."""
    rotations = Rotation.from_quat(rows[:, ROTATION], scalar_first=True).as_matrix()
    return np.einsum("nki,kij->knj", points[:, None] - rows[:, TRANSLATION], rotations)


def check(rows: np.ndarray) -> None:
    """What every start must be, whatever the region: finite, in range, with a proper rotation."""
    assert rows.dtype == np.float32
    assert rows.shape[1] == WIDTH
    assert len(rows) > 0
    assert np.isfinite(rows).all()
    np.testing.assert_allclose(np.linalg.norm(rows[:, ROTATION], axis=1), 1, atol=1e-5)
    lower, upper, _ = LIMITS.array()
    assert (rows[:, SHAPE] >= lower[6:]).all()
    assert (rows[:, SHAPE] <= upper[6:]).all()


@settings(max_examples=30)
@example(size=(0.5, 0.5625, 0.25), angles=(0, 0, 1), centre=(0, 0, 0))  # rows of eight voxels, a step of four
@given(
    size=st.tuples(*[st.floats(0.1, 0.8)] * 3),
    angles=st.tuples(*[st.floats(-3, 3)] * 3),
    centre=st.tuples(*[st.floats(-0.4, 0.4)] * 3),
)
def test_starts_are_in_range_and_cover_their_region(size, angles, centre) -> None:
    region = voxels_of_box(np.array(size), Rotation.from_rotvec(angles), np.array(centre))
    rows = starts(region, SPACING)
    check(rows)
    straight = rows[rows[:, Column.BULGE] == 0]
    inside = (np.abs(local(straight, region)) < straight[:, None, SIZE] / 2 + SPACING).all(axis=2)
    assert inside.mean(axis=1).min() > 0.8
    assert np.linalg.norm(straight[:, TRANSLATION] - np.array(centre), axis=1).max() < 0.5 * max(size)


@pytest.mark.parametrize("count", [1, 599, 600, 1199, 1200, 1201, 2400, 9001])
def test_thinning_takes_points_from_everywhere(count) -> None:
    points = np.arange(count, dtype=np.float32)[:, None].repeat(3, axis=1)
    taken = thinned(points, 600)[:, 0]
    assert min(count, 600) <= len(taken) < 1200
    assert np.diff(taken, prepend=-1).min() > 0
    step = max(1, count // 600)
    assert np.diff(taken, prepend=-1, append=count).max() <= 2 * step
    for row in (2, 4, 8, 10):  # no layer of a grid is left out
        assert len(np.unique(taken % row)) == min(row, count)


def test_a_turned_bar_has_a_start_that_is_the_bar() -> None:
    size, turned = np.array([0.9, 0.5, 0.2]), Rotation.from_rotvec((0.4, -0.7, 0.3))
    rows = starts(voxels_of_box(size, turned, np.array([0.1, 0.2, -0.1])), 0.02)
    axes = Rotation.from_quat(rows[:, ROTATION], scalar_first=True).as_matrix()
    aligned = np.abs(np.einsum("ij,kjl->kil", turned.as_matrix().T, axes)).max(axis=1).min(axis=1) > 0.995
    fitting = (np.abs(np.sort(rows[:, SIZE], axis=1) - np.sort(size)) < 0.06).all(axis=1)
    placed = np.linalg.norm(rows[:, TRANSLATION] - (0.1, 0.2, -0.1), axis=1) < 0.03
    assert (aligned & fitting & placed).any()
    # Each of the bar's axes is the profile axis of some start: it may be a plate, a blade or a rod.
    for axis in turned.as_matrix().T:
        assert np.abs(axes[:, :, 2] @ axis).max() > 0.995


def test_there_are_solid_hollow_and_bent_ones_boxy_and_round() -> None:
    rows = starts(voxels_of_box(np.array([0.3, 0.3, 0.9]), Rotation.identity(), np.zeros(3)), SPACING)
    roundness, bulge, onion = rows[:, Column.ROUNDNESS], rows[:, Column.BULGE], rows[:, Column.ONION]
    assert ((roundness < 0.5) & (bulge == 0) & (onion == 0)).any()
    assert ((roundness > 0.5) & (bulge == 0) & (onion == 0)).any()
    assert (onion > 0.5).any()
    bent = rows[bulge > 0]
    directions = Rotation.from_quat(bent[:, ROTATION], scalar_first=True).apply((-1.0, 0, 0))
    assert len(np.unique(directions.round(3), axis=0)) == 4  # bulging to all four sides
    assert np.allclose(
        Rotation.from_quat(bent[:, ROTATION], scalar_first=True).apply((0, 0, 1.0))[:, 2] ** 2, 1, atol=1e-3
    )


@pytest.mark.parametrize(
    "region",
    [
        np.zeros((1, 3)),
        np.array([[0, 0, 0], [SPACING, 0, 0]]),
        np.stack([np.linspace(-0.6, 0.6, 60)] * 3, axis=1),
        np.array([[x, y, 0.2] for x in np.linspace(-1, 1, 40) for y in np.linspace(-1, 1, 40)]),
    ],
    ids=["voxel", "pair", "diagonal", "sheet"],
)
def test_degenerate_regions_still_get_proper_starts(region: np.ndarray) -> None:
    check(starts(region.astype(np.float32), SPACING))


def test_the_same_region_gives_the_same_starts() -> None:
    region = voxels_of_box(np.array([0.5, 0.4, 0.3]), Rotation.identity(), np.zeros(3))
    np.testing.assert_array_equal(starts(region, SPACING), starts(region.copy(), SPACING))
