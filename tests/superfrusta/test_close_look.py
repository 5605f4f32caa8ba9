"""Deviations as the report measures them, where a search's own look is too hasty."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from trimesh.util import concatenate

from partwright.fields.columns import Column
from partwright.metrics.comparison import Comparison
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import Settings
from partwright.superfrusta.close_look import CloseLook
from partwright.superfrusta.deviations import deviations
from partwright.superfrusta.outcome import assembly_of
from partwright.superfrusta.samples import FitSamples, Rows
from tests.superfrusta.meshes import box, union
from tests.superfrusta.rows import box as box_row

SETTINGS = Settings.for_quality("draft")
WIDTH, DEPTH = 0.08, 0.3  # of a groove


def seen(
    shape: Shape, rows: Rows, settings: Settings = SETTINGS
) -> tuple[FitSamples, np.ndarray, np.ndarray]:
    """What a close look sees: lengths, and how often each counts."""
    samples = FitSamples.of(shape, settings)
    found = CloseLook.at(shape, samples).deviations(rows)
    return samples, found.off / found.times, found.times


def grooved() -> Shape:
    """1.8 long; a groove goes across its top."""
    side = (1.8 - WIDTH) / 2
    blocks = [box((side, 0.8, 0.8), (x * (side + WIDTH) / 2, 0, 0)) for x in (-1, 1)]
    return load_shape(union(*blocks, box((1.0, 0.8, 0.8 - DEPTH), (0, 0, -DEPTH / 2))))


def test_the_depth_of_a_groove_that_is_filled_is_seen() -> None:
    """Two blocks meet in it: nowhere is one deeper than half of its width under their surfaces."""
    over = np.array([box_row((0.92, 0.8, 0.8), (x * 0.44, 0, 0)) for x in (-1, 1)])
    shape = grooved()
    samples, lengths, _ = seen(shape, over)
    assert deviations(samples, over).by_part.max() < WIDTH
    assert lengths.max() == pytest.approx(DEPTH, rel=0.08)


@pytest.mark.parametrize("seed", range(3))
def test_it_sees_what_the_report_will_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = load_shape(union(box((1.8, 0.6, 0.5)), box((0.5, 0.6, 1.1), (0.2, 0.0, 0.3))))
    low = shape.frame.to_unit(shape.vertices)
    middle = (low.min(axis=0) + low.max(axis=0)) / 2
    exact = [box_row((1.8, 0.6, 0.5)), box_row((0.5, 0.6, 1.1), (0.2, 0.0, 0.3))]
    rows = np.array(exact)
    rows[:, :3] += shape.frame.to_unit(np.zeros((1, 3)))[0]
    rows[:, :3] += rng.uniform(-0.05, 0.05, (2, 3))
    assert np.abs(middle).max() < 1e-6
    _, lengths, times = seen(shape, rows)
    told = Comparison(assembly_of(shape, rows, SETTINGS), shape).deviation
    assert lengths.max() == pytest.approx(told.maximum, rel=0.1)
    assert lengths[times > 1].max(initial=0) == pytest.approx(told.protrusion, rel=0.1, abs=0.01)


def test_what_a_cut_leaves_nothing_of_is_not_there() -> None:
    """A plate over a block is taken away by a cut that goes just beyond it, and a tower is missing."""
    height, plate = 0.8, ((0.1, 0.1, 0.04), (0.0, 0.0, 0.65))
    shape = load_shape(union(box((1.8, 0.8, 0.5)), box((0.3, 0.3, height), (0.0, 0.0, 0.25 + height / 2))))
    down = shape.frame.to_unit(np.zeros((1, 3)))[0]
    size, place = plate
    cut = box_row(tuple(side + 0.004 for side in size), tuple(place + down))
    cut[Column.SIGN] = -1
    whole = [box_row((1.8, 0.8, 0.5), tuple(down)), box_row(size, tuple(place + down)), cut]
    _, lengths, _ = seen(shape, np.array(whole))
    assert lengths.max() == pytest.approx(height, rel=0.05)


def test_what_cannot_be_seen_is_not_off() -> None:
    """A crack of 0.2 % of the longest side, that one block fills."""
    side = 0.898
    halves = [box((side, 0.8, 0.8), (x * (0.9 - side / 2), 0, 0)) for x in (-1, 1)]
    shape = load_shape(union(*halves))
    _, lengths, _ = seen(shape, box_row((1.8, 0.8, 0.8))[None])
    assert not len(lengths)
    wider = [box((0.87, 0.8, 0.8), (x * (0.9 - 0.435), 0, 0)) for x in (-1, 1)]
    _, lengths, _ = seen(load_shape(union(*wider)), box_row((1.8, 0.8, 0.8))[None])
    assert lengths.max() > 0.3


def test_of_what_sticks_out_the_exact_length_counts_most() -> None:
    shape = load_shape(box((1.8, 0.8, 0.8)))
    samples = FitSamples.of(shape, dataclasses.replace(SETTINGS, resolution=32))
    rows = np.array([box_row((1.8, 0.8, 0.8)), box_row((0.2, 0.2, 0.2), (0.3, 0.1, 0.375))])
    found = CloseLook.at(shape, samples).deviations(rows)
    worst = found.off.argmax()
    assert found.times[worst] > 1
    assert found.off[worst] / found.times[worst] == pytest.approx(0.075, abs=0.003)
    assert found.part[worst] == 1


@pytest.mark.parametrize("place", [0.11, 0.215, -0.33])
def test_what_sticks_out_the_furthest_is_found_beside_the_points_that_do(place: float) -> None:
    """A block goes over a slot; in the middle of the slot it is half of its width from both walls."""
    wide, deep = 0.13, 0.4
    left, right = place - wide / 2 + 0.9, 0.9 - place - wide / 2
    shape = union(
        box((left, 0.8, 0.8), (left / 2 - 0.9, 0, 0)),
        box((right, 0.8, 0.8), (0.9 - right / 2, 0, 0)),
        box((1.8, 0.8, 0.8 - deep), (0, 0, -deep / 2)),
    )
    _, lengths, times = seen(load_shape(shape), box_row((1.8, 0.8, 0.8))[None], Settings())
    assert lengths[times > 1].max() == pytest.approx(wide / 2, rel=0.05)


@pytest.mark.parametrize("gap", [0.0, 0.05])
def test_a_blend_is_seen_to_stick_out(gap: float) -> None:
    """Two blocks in a corner, that touch or hardly so, with a blend that the shape lacks."""
    sizes, places = ((1.8, 0.6, 0.4), (0.4, 0.6, 0.8)), ((0.0, 0.0, 0.0), (-0.4, 0.0, 0.6 + gap))
    shape = load_shape(concatenate([box(size, place) for size, place in zip(sizes, places, strict=True)]))
    rows = np.array([box_row(size, place, blend=0.4) for size, place in zip(sizes, places, strict=True)])
    rows[:, :3] += shape.frame.to_unit(np.zeros((1, 3)))[0]
    _, lengths, times = seen(shape, rows)
    told = Comparison(assembly_of(shape, rows, SETTINGS), shape).deviation
    assert told.protrusion == pytest.approx(0.1, abs=1e-3)
    assert lengths[times > 1].max() == pytest.approx(told.protrusion, rel=0.01)
