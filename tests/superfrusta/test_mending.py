"""Deviations that no overlap feels: found on the part that they are of, and mended."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

from partwright.fields import kernel
from partwright.fields.columns import WIDTH, Column
from partwright.shapes import load_shape
from partwright.superfrusta import Settings
from partwright.superfrusta.deviations import OUTSIDE, deviations, walked
from partwright.superfrusta.mending import Mending, Trial, next_to_mend
from partwright.superfrusta.objective import score
from partwright.superfrusta.part_surfaces import surface_points
from partwright.superfrusta.samples import FitSamples
from tests.superfrusta.meshes import box, union
from tests.superfrusta.rows import box as box_row
from tests.superfrusta.rows import random_rows, row

SETTINGS = dataclasses.replace(Settings.for_quality("draft"), mends=6)

# In the unit frame already: 1.8 long.
BODY = ((1.2, 0.8, 0.5), (-0.3, 0.0, 0.0))
ARM = ((0.6, 0.2, 0.5), (0.6, 0.0, 0.0))


@pytest.fixture(scope="module")
def samples() -> FitSamples:
    return FitSamples.of(load_shape(union(box(*BODY), box(*ARM))), SETTINGS)


@pytest.fixture(scope="module")
def exact() -> np.ndarray:
    return np.array([box_row(*BODY), box_row(*ARM)])


@pytest.mark.parametrize(
    "shape",
    [
        {},
        {"roundness": 0.7},
        {"taper": 0.4, "roundness": 1.0},
        {"taper": 1.6},
        {"bulge": 0.6, "roundness": 0.5},
        {"onion": 0.6, "taper": 0.8},
        {"bulge": 0.3, "onion": 0.5, "dilation": 0.02},
    ],
)
def test_points_of_a_part_lie_on_its_surface(shape: dict[str, float]) -> None:
    one = row((0.1, -0.2, 0.3), (1.0, 0.3, -0.2, 0.5), (0.4, 0.5, 0.9), **shape)[None]
    points = surface_points(one)[0].astype(np.float32)
    on_it = np.abs(kernel.evaluate(one, points)) < 1e-4
    # A solid part's inner edge is its axis; a dilated one's corners are cut.
    assert on_it.mean() > 0.6
    # They go all around it: what the field says of its extents is met from within.
    around = points[on_it]
    lattice = np.random.default_rng(0).uniform(-1.2, 1.2, (60_000, 3)).astype(np.float32)
    inside = lattice[kernel.evaluate(one, lattice) < 0]
    assert (around.max(axis=0) > inside.max(axis=0) - 0.03).all()
    assert (around.min(axis=0) < inside.min(axis=0) + 0.03).all()


def test_a_disc_is_looked_at_all_around() -> None:
    """Its rim may stick out of the gap between two teeth alone."""
    disc = row((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), (1.6, 1.6, 0.004), roundness=1.0)
    x, y, _ = surface_points(disc[None])[0].T
    rim = np.hypot(x, y) > 0.79
    angles = np.sort(np.degrees(np.arctan2(y[rim], x[rim])))
    assert np.diff(np.append(angles, angles[0] + 360)).max() < 15.5


def test_points_of_many_parts_are_those_of_each() -> None:
    rows = random_rows(5, seed=3)
    alone = np.concatenate([surface_points(one[None]) for one in rows])
    assert np.allclose(surface_points(rows), alone)


def test_an_exact_assembly_is_nowhere_off(samples: FitSamples, exact: np.ndarray) -> None:
    off = deviations(samples, exact)
    assert len(off.points) == 0
    assert off.norm == 0


def void_rows(blend: float) -> np.ndarray:
    """Six slabs about a void in the middle of BODY, and the arm."""
    (width, depth, height), (x, y, z) = BODY
    hole = 0.04  # half of it, between the slabs
    walls = [box_row(*ARM)]
    for axis, size in ((0, width), (1, depth), (2, height)):
        for side in (-1, 1):
            slab, centre = [width, depth, height], [x, y, z]
            slab[axis] = size / 2 - hole
            centre[axis] += side * (size / 2 + hole) / 2
            walls.append(box_row(tuple(slab), tuple(centre)))
    rows = np.array(walls)
    rows[1:, Column.BLEND] = blend
    return rows


def test_a_void_that_only_blends_wall_is_off_by_its_depth(samples: FitSamples) -> None:
    """Blends fill the corners, so that few points of any part's own surface are at its walls."""
    rows = void_rows(0.05)
    field = kernel.evaluate(rows, np.array([BODY[1]], np.float32))
    assert 0 < field[0] < 0.04
    off = deviations(samples, rows)
    assert off.by_part.max() == pytest.approx(BODY[0][2] / 2, abs=0.04)
    void = off.points[off.distance < -0.1]
    assert (np.abs(void - np.array(BODY[1])).max(axis=1) < 0.05).all()


def test_a_void_that_blends_nearly_fill_is_one(samples: FitSamples) -> None:
    centre = np.array([BODY[1]], np.float32)
    blends = np.linspace(0.06, 0.07, 21)
    fields = np.array([kernel.evaluate(void_rows(blend), centre)[0] for blend in blends])
    rows = void_rows(blends[np.flatnonzero((fields > 1e-3) & (fields < 2e-3))[0]])
    assert deviations(samples, rows).by_part.max() == pytest.approx(BODY[0][2] / 2, abs=0.04)
    filled = void_rows(blends[np.flatnonzero(fields < -1e-3)[0]])
    assert deviations(samples, filled).by_part.max() < 0.1  # blends bulge


def chip_rows(low: tuple[float, float, float], high: tuple[float, float, float], blend: float) -> np.ndarray:
    """Of a block far above the body what lies between two corners: six cuts take the rest of it, and with a
    blend a little more."""
    middle, size = np.array([0.1, 0.05, 0.85]), np.array([0.7, 0.6, 0.5])
    rows = [box_row(tuple(size), tuple(middle))]
    for axis in range(3):
        for side, end in ((-1, low[axis]), (1, high[axis])):
            outer = middle[axis] + side * (size[axis] / 2 + 0.1)
            cut, centre = size + 0.2, middle.copy()
            cut[axis], centre[axis] = abs(outer - end), (outer + end) / 2
            one = box_row(tuple(cut), tuple(centre))
            one[Column.SIGN], one[Column.BLEND] = -1, blend
            rows.append(one)
    return np.array(rows)


@pytest.mark.parametrize("blend", [0.001, 0.02])
@pytest.mark.parametrize(
    ("low", "high"),
    [
        ((0.161, 0.083, 0.778), (0.229, 0.147, 0.842)),  # a crumb
        ((-0.1, 0.098, 0.836), (0.26, 0.142, 0.876)),  # a rod
        ((-0.06, -0.06, 0.832), (0.22, 0.22, 0.861)),  # a sheet
    ],
)
def test_a_chip_far_from_the_shape_is_off(
    samples: FitSamples,
    exact: np.ndarray,
    low: tuple[float, float, float],
    high: tuple[float, float, float],
    blend: float,
) -> None:
    """Within the cube of the samples, but no voxel is there, and it is between the points of all surfaces."""
    rows = np.vstack([exact, chip_rows(low, high, blend)])
    middle = (np.array(low) + high) / 2
    assert kernel.evaluate(rows, middle[None].astype(np.float32))[0] < 0
    off = deviations(samples, rows)
    told = off.points[off.worst(2)]
    assert (np.abs(told - middle) < (np.array(high) - low) / 2 + 0.005).all()
    assert off.by_part[2] == pytest.approx(OUTSIDE * (middle[2] - BODY[0][2] / 2), abs=0.06)


def test_a_chip_beyond_all_samples_is_off(samples: FitSamples, exact: np.ndarray) -> None:
    """A bar that reaches far out, and is cut away but for its end."""
    bar, cut = box_row((1.0, 0.3, 0.3), (1.3, 0.0, 0.0)), box_row((0.55, 0.5, 0.5), (1.175, 0.0, 0.0))
    cut[Column.SIGN] = -1
    rows = np.vstack([exact, bar, cut])
    off = deviations(samples, rows)
    far = off.points[:, 0] > 1.2
    assert np.count_nonzero(far) > 100
    assert set(off.part[far]) == {2, 3}  # the bar and what cuts it
    assert np.abs(off.points[far, 0] - 1.625).max() < 0.18
    error = np.abs(off.distance[far] - (off.points[far, 0] - 0.9))
    assert np.count_nonzero(error < 0.003) > 100  # places in the bar
    assert error.max() < 0.03  # of surfaces: read off the grid, which ends far from them
    # Growth, which comes first, makes samples of such places; they are off all the same.
    after = samples.with_stray_samples(rows)
    assert len(after.points) > len(samples.points)
    assert np.array_equal(deviations(after, rows).points, off.points)


def test_a_thin_tab_is_off_by_its_length(samples: FitSamples, exact: np.ndarray) -> None:
    tab = box_row((0.3, 0.3, 0.006), (-0.3, 0.55, 0.1))
    off = deviations(samples, np.vstack([exact, tab]))
    assert off.by_part == pytest.approx([0.0, 0.0, OUTSIDE * 0.3], abs=0.02)
    assert off.distance[off.worst(2)] == pytest.approx(0.3, abs=0.02)
    assert off.points[off.worst(2), 1] == pytest.approx(0.7, abs=0.01)
    # It has next to no volume.
    assert score(samples, exact) - score(samples, np.vstack([exact, tab])) < 0.01


def test_a_place_that_is_left_out_belongs_to_the_part_beside_it(
    samples: FitSamples, exact: np.ndarray
) -> None:
    short = exact.copy()
    short[1] = box_row((0.4, 0.2, 0.5), (0.5, 0.0, 0.0))
    assert deviations(samples, short).by_part == pytest.approx([0.0, 0.2], abs=0.02)


def test_what_is_missing_beside_a_blend_is_as_far_off_as_it_looks(samples: FitSamples) -> None:
    """The field of a blend is less than the distance; the surface itself says how far off a point is."""
    rows = np.stack(
        [row((0, 0, z), (1, 0, 0, 0), (size, size, 0.3)) for z, size in ((-0.2, 0.3), (0.2, 0.25))]
    )
    rows[1, Column.BLEND] = 0.3
    drawn = np.random.default_rng(0).uniform(-0.55, 0.55, (600_000, 3)).astype(np.float32)
    field = kernel.evaluate(rows, drawn)
    surface = drawn[np.abs(field) < 0.005]
    points = drawn[(field > 0.05) & (field < 0.15)][:500]
    gap = kernel.evaluate(rows, points)
    true, _ = cKDTree(surface).query(points)
    assert np.quantile(gap / true, 0.25) < 0.95
    assert walked(samples, rows, points, gap) == pytest.approx(true, rel=0.08, abs=0.02)


def test_a_gap_inside_is_off_and_a_seam_is_not(samples: FitSamples, exact: np.ndarray) -> None:
    halves = [box_row((0.6, 0.8, 0.5), (x, 0.0, 0.0)) for x in (-0.6, 0.0)]
    seam = np.array([*halves, exact[1]])
    assert deviations(samples, seam).norm == 0
    apart = seam.copy()
    apart[0] = box_row((0.56, 0.8, 0.5), (-0.62, 0.0, 0.0))
    off = deviations(samples, apart)
    assert off.by_part.max() == pytest.approx(0.25, abs=0.02)  # its depth


def test_mending_draws_a_part_back(samples: FitSamples, exact: np.ndarray) -> None:
    stretched = exact.copy()
    stretched[1] = box_row((0.6, 0.2, 0.62), (0.6, 0.0, 0.06))
    mended = Mending(samples, SETTINGS)(stretched)
    assert deviations(samples, stretched).norm > 0.1
    assert deviations(samples, mended).norm < 0.02
    assert len(mended) == 2


def test_mending_adds_the_part_that_is_missing(samples: FitSamples, exact: np.ndarray) -> None:
    mended = Mending(samples, SETTINGS)(exact[:1])
    assert len(mended) == 2
    assert deviations(samples, mended).norm < 0.03
    assert score(samples, mended) > 0.97


def test_mending_takes_away_what_only_sticks_out(samples: FitSamples, exact: np.ndarray) -> None:
    tab = box_row((0.3, 0.3, 0.01), (-0.3, 0.55, 0.1))
    mended = Mending(samples, SETTINGS)(np.vstack([exact, tab]))
    assert len(mended) == 2
    assert deviations(samples, mended).norm < 0.02


def test_a_pin_that_has_become_a_box_is_round_again() -> None:
    """It is nowhere so far off that it would be mended."""
    radius, height, place = 0.05, 0.8, (0.1, 0.2, 0.0)
    pin = trimesh.creation.cylinder(radius, height, sections=48).apply_translation(place)
    samples = FitSamples.of(load_shape(union(box(*BODY), box(*ARM), pin)), SETTINGS)
    block = box_row((1.77 * radius, 1.77 * radius, height), place)
    mending, rows = Mending(samples, SETTINGS), np.array([box_row(*BODY), box_row(*ARM), block])
    given = mending.trial(rows)
    assert next_to_mend(given, []) is None
    renewed = mending.renewed(given)
    assert renewed.rows[2, Column.ROUNDNESS] > 0.9
    assert np.array_equal(renewed.rows[:2], rows[:2])
    assert renewed.value > given.value + 0.01
    assert np.array_equal(dataclasses.replace(mending, locked=3).renewed(given).rows, rows)


def test_mending_keeps_locked_parts_and_budgets(samples: FitSamples, exact: np.ndarray) -> None:
    tab = box_row((0.3, 0.3, 0.01), (-0.3, 0.55, 0.1))
    rows = np.vstack([tab, exact])
    mended = Mending(samples, SETTINGS, locked=1)(rows)
    assert np.array_equal(mended[0], tab)
    assert mended.shape[1] == WIDTH
    one = Mending(samples, dataclasses.replace(SETTINGS, max_parts=1))(exact[:1])
    assert len(one) == 1


@pytest.mark.parametrize("subtract", [None, False])
def test_mending_carves_holes_unless_forbidden(subtract: bool | None) -> None:
    plate = ((1.8, 1.2, 0.3), (0.0, 0.0, 0.0))
    drills = [
        trimesh.creation.cylinder(0.15, 1.0, sections=48).apply_translation((x, 0.2, 0)) for x in (-0.4, 0.5)
    ]
    drilled = trimesh.boolean.difference([box(*plate), *drills], engine="manifold")
    found = FitSamples.of(load_shape(drilled), SETTINGS)
    solid = np.array([box_row(*plate)])
    assert deviations(found, solid).norm > 0.12  # both mouths are covered
    mended = Mending(found, dataclasses.replace(SETTINGS, subtract=subtract))(solid)
    cuts = mended[mended[:, Column.SIGN] < 0]
    if subtract is None:
        assert len(cuts) == 2
        assert np.allclose(np.sort(cuts[:, Column.TX]), [-0.4, 0.5], atol=0.02)
        assert np.allclose(cuts[:, Column.TY], 0.2, atol=0.02)
        assert deviations(found, mended).norm < 0.03
    else:
        assert len(cuts) == 0


def test_a_hole_that_is_narrower_than_voxels_tell_is_seen_and_carved() -> None:
    """No voxel lies deep in it; the shape's surface lies deep under the part."""
    plate, radius = ((1.8, 1.2, 0.3), (0.0, 0.0, 0.0)), 0.04
    drill = trimesh.creation.cylinder(radius, 1.0, sections=48).apply_translation((0.3, 0.2, 0))
    drilled = trimesh.boolean.difference([box(*plate), drill], engine="manifold")
    found = FitSamples.of(load_shape(drilled), SETTINGS)
    assert 2 * radius < 3 * found.grid.spacing
    solid = np.array([box_row(*plate)])
    off = deviations(found, solid)
    assert off.by_part == pytest.approx([OUTSIDE * 0.15], abs=0.02)  # half of the plate's thickness
    assert np.linalg.norm(off.points[off.worst(0), :2] - (0.3, 0.2)) < radius + 0.01
    mended = Mending(found, SETTINGS)(solid)
    (cut,) = mended[mended[:, Column.SIGN] < 0]
    assert cut[[Column.TX, Column.TY]] == pytest.approx([0.3, 0.2], abs=0.01)
    assert deviations(found, mended).norm < 0.03


def test_what_was_given_up_is_tried_again_after_progress(samples: FitSamples, exact: np.ndarray) -> None:
    tab = box_row((0.3, 0.3, 0.01), (-0.3, 0.55, 0.1))
    best = Mending(samples, SETTINGS).trial(np.vstack([exact, tab]))
    place = best.off.points[best.off.worst(2)]
    assert next_to_mend(best, []) == 2
    assert next_to_mend(best, [(place, best.value)]) is None
    assert next_to_mend(best, [(place, best.value - 0.02)]) == 2


def test_mending_ends_when_nothing_bears_fruit_any_more(
    samples: FitSamples, exact: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    tabs = [box_row((0.1, 0.1, 0.3), (x, 0.3, 0.3)) for x in np.linspace(-0.8, 0.2, 11)]
    rows = np.vstack([exact, *tabs])
    tried: list[int] = []

    def in_vain(mending: Mending, best: Trial, part: int) -> list[Trial]:
        tried.append(part)
        return []

    monkeypatch.setattr(Mending, "ways", in_vain)
    monkeypatch.setattr(Mending, "firmed", lambda mending, given, moving: given)
    Mending(samples, dataclasses.replace(SETTINGS, mends=16))(rows)
    assert len(tried) == len(set(tried)) == 5


def test_a_sheet_over_a_hole_is_off_although_it_passes_between_voxels() -> None:
    plate, radius = ((1.8, 1.2, 0.3), (0.0, 0.0, 0.0)), 0.1
    drill = trimesh.creation.cylinder(radius, 1.0, sections=48).apply_translation((-0.36, 0.1, 0))
    found = FitSamples.of(load_shape(trimesh.boolean.difference([box(*plate), drill])), SETTINGS)
    cut = row((-0.36, 0.1, 0.0), (1, 0, 0, 0), (2 * radius, 2 * radius, 1.0), roundness=1.0)
    cut[Column.SIGN] = -1
    sheet = box_row((1.7, 1.1, 0.002), (0.0, 0.0, 0.013))
    rows = np.array([box_row(*plate), cut, sheet])
    assert deviations(found, rows[:2]).norm < 0.02
    off = deviations(found, rows)
    assert off.by_part == pytest.approx([0.0, 0.0, radius], abs=0.02)
    assert off.points[off.worst(2)] == pytest.approx([-0.36, 0.1, 0.013], abs=0.03)


def test_two_that_are_missing_beside_one_part_are_found() -> None:
    """While one is missing still, the other alone is no gain: the part is as far off as before."""
    body = ((1.0, 0.8, 1.2), (0.0, 0.0, -0.3))
    rods = [((0.07, 0.07, 0.6), (x, 0.0, 0.6)) for x in (-0.3, 0.3)]
    samples = FitSamples.of(load_shape(union(box(*body), *(box(*rod) for rod in rods))), SETTINGS)
    mended = Mending(samples, SETTINGS)(np.array([box_row(*body)]))
    assert len(mended) == 3
    assert deviations(samples, mended).norm < 0.06 < 0.5 < deviations(samples, mended[:1]).norm


def test_the_changes_that_promise_most_are_those_that_are_worth_most(
    samples: FitSamples, exact: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    mending, rng = Mending(samples, SETTINGS), np.random.default_rng(1)
    changes = [(exact, np.ones(2, bool))]
    for amount in rng.uniform(0, 0.4, 12):
        moved = exact.copy()
        moved[:, :3] += amount * rng.normal(size=(2, 3))
        changes.append((moved.astype(np.float32), np.ones(2, bool)))
    best = sorted((mending.trial(rows).value for rows, _ in changes), reverse=True)
    looked: list[int] = []
    whole = Mending.trial
    monkeypatch.setattr(Mending, "trial", lambda *given: looked.append(1) or whole(*given))
    assert [trial.value for trial, _ in mending.promising(changes)] == best[:2]
    assert len(looked) < len(changes)
