"""Growing into a residual and pruning what does not pay, on assemblies whose answer is known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh

from partwright.fields import kernel
from partwright.fields.columns import SIZE, WIDTH, Column
from partwright.shapes import load_shape
from partwright.superfrusta import Settings
from partwright.superfrusta.growing import Region, _guesses, grow
from partwright.superfrusta.merging import owners
from partwright.superfrusta.objective import score
from partwright.superfrusta.pruning import cheapest_removal, neighbours, prune
from partwright.superfrusta.refining import POLISH, refine
from partwright.superfrusta.samples import FitSamples
from tests.superfrusta.meshes import box, union
from tests.superfrusta.rows import box as box_row
from tests.superfrusta.rows import row

SETTINGS = Settings.for_quality("draft")
NONE = np.empty((0, WIDTH), np.float32)

# Two blocks apart along x, in the unit frame already: 1.8 long.
LEFT = ((0.6, 0.8, 0.5), (-0.6, 0.0, 0.0))
RIGHT = ((0.6, 0.4, 0.5), (0.6, 0.0, 0.0))


@pytest.fixture(scope="module")
def pair() -> FitSamples:
    return FitSamples.of(load_shape(union(box(*LEFT), box(*RIGHT))), SETTINGS)


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return np.array([box_row(*LEFT), box_row(*RIGHT)])


def test_two_blocks_grow_two_parts(pair: FitSamples, exact: np.ndarray) -> None:
    grown = grow(pair, NONE, SETTINGS, most=5).last
    assert len(grown) == 2
    assert score(pair, grown) > 0.95
    assert np.sort(grown[:, 0]) == pytest.approx([-0.6, 0.6], abs=0.02)


@pytest.mark.parametrize("smooth", [True, False])
def test_starts_blend_unless_unions_are_plain(pair: FitSamples, smooth: bool) -> None:
    region = Region(pair.grid.values.ravel() < 0, NONE, 0.1, 0.2, 0.15)
    points = pair.grid_points[region.voxels]
    blends = _guesses(pair, region, points, Settings.for_quality("draft", smooth=smooth))[:, Column.BLEND]
    assert (blends > 0).all() if smooth else (blends == 0).all()


def test_what_is_explained_already_grows_nothing(pair: FitSamples, exact: np.ndarray) -> None:
    assert score(pair, exact) > 0.998
    assert len(grow(pair, exact, SETTINGS, most=5)) == 0


def test_the_other_block_grows_where_one_is_missing(pair: FitSamples, exact: np.ndarray) -> None:
    for there, missing in ((0, 1), (1, 0)):
        grown = grow(pair, exact[[there]], SETTINGS, most=5).last
        assert len(grown) == 1
        points = pair.points[pair.near :]
        occupied, wanted = (kernel.evaluate(r, points) < 0 for r in (grown, exact[[missing]]))
        assert np.count_nonzero(occupied & wanted) > 0.95 * np.count_nonzero(occupied | wanted)


@pytest.mark.parametrize("thickness", [0.012, 0.02])  # of a voxel: 0.4 and 0.7
def test_a_collar_thinner_than_a_voxel_grows_as_one_ring(thickness: float) -> None:
    """Its voxels lie here and there, and were found as four or five pieces of a ring, or not at all."""
    inner = 2 * (0.9 - thickness)
    drum, collar = (trimesh.creation.cylinder(d / 2, h, sections=180) for d, h in ((inner, 1.0), (1.8, 0.2)))
    samples = FitSamples.of(load_shape(union(drum, collar)), SETTINGS)
    rows = row(size=(inner, inner, 1.0), roundness=1.0)[None]
    grown = grow(samples, rows, SETTINGS, most=5).last
    assert len(grown) == 1
    np.testing.assert_allclose(grown[0, SIZE], (1.8, 1.8, 0.2), atol=0.02)
    assert score(samples, np.concatenate([rows, grown])) > 0.996


def test_no_more_than_wanted_grow_and_the_best_comes_first(pair: FitSamples) -> None:
    assert len(grow(pair, NONE, SETTINGS, most=0)) == 0
    one = grow(pair, NONE, SETTINGS, most=1).last
    assert len(one) == 1
    assert one[0, 0] < 0  # the larger block


def test_growing_repeats_at_any_number_of_threads(pair: FitSamples) -> None:
    first = grow(pair, NONE, SETTINGS, most=5).last
    for threads in (1, 2):
        again = dataclasses.replace(pair, threads=threads)
        np.testing.assert_array_equal(grow(again, NONE, SETTINGS, most=5).last, first)


def test_pruning_drops_copies_crumbs_and_strays_only(pair: FitSamples, exact: np.ndarray) -> None:
    copy = box_row((0.5, 0.6, 0.4), LEFT[1])  # inside the left block
    crumb = box_row((0.02, 0.02, 0.02), (0.6, 0.21, 0.0))
    stray = box_row((0.2, 0.2, 0.2), (0.0, 0.3, 0.0))  # outside the shape
    rows = np.array([copy, exact[0], crumb, stray, exact[1]])
    np.testing.assert_array_equal(prune(pair, rows, alpha=1e-3), exact)
    # Free parts stay unless they do harm; dear parts go, but never the last one.
    assert len(prune(pair, exact, alpha=0.0)) == 2
    np.testing.assert_array_equal(prune(pair, exact, alpha=10.0), exact[:1])


def test_locked_parts_are_never_pruned(pair: FitSamples, exact: np.ndarray) -> None:
    stray = box_row((0.2, 0.2, 0.2), (0.0, 0.3, 0.0))
    rows = np.array([stray, exact[0], exact[1]])
    np.testing.assert_array_equal(prune(pair, rows, alpha=1e-3, locked=1), rows)
    np.testing.assert_array_equal(prune(pair, rows, alpha=10.0, locked=1), rows[:1])


def test_the_cheapest_removal_is_the_part_that_explains_least(pair: FitSamples, exact: np.ndarray) -> None:
    halves = np.array(
        [
            exact[0],
            box_row((0.3, 0.4, 0.5), (0.45, 0.0, 0.0)),
            box_row((0.3, 0.4, 0.5), (0.75, 0.0, 0.0)),
        ]
    )
    thinned, kept, whole = cheapest_removal(pair, halves, SETTINGS)
    assert len(thinned) == 2
    assert whole == pytest.approx(score(pair, halves))
    assert kept == pytest.approx(score(pair, thinned))
    # The other half moves over to take the place of both.
    assert kept > whole - 0.01
    np.testing.assert_array_equal(thinned[0], exact[0])


def test_neighbours_touch(pair: FitSamples, exact: np.ndarray) -> None:
    touching = box_row((0.3, 0.4, 0.5), (0.15, 0.0, 0.0))
    rows = np.array([*exact, touching])
    assert neighbours(pair, rows, 1).tolist() == [False, False, True]
    assert neighbours(pair, rows, 0).tolist() == [False, False, False]


def test_refining_moves_the_marked_parts_only(pair: FitSamples, exact: np.ndarray) -> None:
    moved = exact.copy()
    moved[:, Column.TX] += 0.03
    refined = refine(pair, moved, POLISH, SETTINGS, np.array([False, True]))
    np.testing.assert_array_equal(refined[0], moved[0])
    assert refined[1, 0] == pytest.approx(0.6, abs=0.003)
    assert score(pair, refined) > score(pair, moved)
    nothing = np.zeros(2, bool)
    np.testing.assert_array_equal(refine(pair, moved, POLISH, SETTINGS, nothing), moved)
    plain = Settings.for_quality("draft", smooth=False)
    np.testing.assert_array_equal(refine(pair, moved, POLISH, plain)[:, Column.BLEND], moved[:, Column.BLEND])


def test_each_voxel_is_owned_by_the_part_it_is_deepest_in(pair: FitSamples, exact: np.ndarray) -> None:
    hole = box_row((0.3, 0.3, 2.0), (0.2, 0.0, 0.0))
    hole[Column.SIGN] = -1
    beside = box_row((0.7, 0.4, 0.5), (0.4, 0.0, 0.0))  # covers some of the gap that the hole reaches into
    rows = np.array([*exact, beside, hole])
    distance = pair.parts_of(rows, pair.grid_points)
    inside = pair.grid.values.ravel() < 0
    cut = ~inside & (distance[:3] < 0).any(axis=0)
    expected = np.where(inside, distance[:3].argmin(axis=0), np.where(cut, 3, -1))
    assert cut.any()
    assert np.array_equal(owners(pair, rows), expected)


def test_samples_within_a_box(pair: FitSamples) -> None:
    low, high = np.float32([-0.9, -0.2, 0.0]), np.float32([0.1, 0.3, 0.2])
    expected = np.flatnonzero(((pair.points > low) & (pair.points < high)).all(axis=1))
    assert len(expected)
    assert np.array_equal(pair.within(low, high), expected)
