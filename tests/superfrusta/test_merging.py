"""Pairs of parts that become one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from partwright.methods import Run
from partwright.shapes import load_shape
from partwright.superfrusta import Settings, merging
from partwright.superfrusta.merging import carried_out, merge, mergers
from partwright.superfrusta.objective import score
from partwright.superfrusta.samples import FitSamples
from tests.superfrusta.meshes import box, union
from tests.superfrusta.rows import box as box_row

DRAFT = replace(Settings.for_quality("draft"), near=6000, uniform=6000, resolution=48)

# A plank in two halves, in the unit frame, and what stands on it.
HALVES = [((0.9, 0.5, 0.12), (x, 0.0, 0.0)) for x in (-0.45, 0.45)]
POSTS = [((0.12, 0.12, 0.3), (x, 0.0, 0.2)) for x in (-0.5, 0.3)]
PLANK = ((1.8, 0.5, 0.12), (0.0, 0.0, 0.0))


def test_halves_of_a_plank_are_tried_though_each_is_worth_more_than_what_is_cheap(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    samples = FitSamples.of(load_shape(union(box(*PLANK), *(box(*post) for post in POSTS))), DRAFT)
    (dx, dy, dz) = load_shape(union(box(*PLANK), *(box(*post) for post in POSTS))).frame.centre
    found = np.array([box_row(size, (x - dx, y - dy, z - dz)) for size, (x, y, z) in (*HALVES, *POSTS)])
    monkeypatch.setattr(merging, "_FITTED", 2)  # of four pairs that touch
    first = mergers(samples, found, DRAFT, 0)[0]
    assert first.pair == (0, 1)
    assert first.gain > -0.01
    alone = carried_out(samples, found, *first.pair, first.part, DRAFT, 0, alone=True)
    assert np.array_equal(alone[1:], found[2:])
    assert score(samples, alone) > score(samples, found) - 1e-3
    assert len(merge(samples, found, DRAFT)) == 3


def test_mergers_are_tried_beside_those_that_were_kept_at_any_number_of_threads() -> None:
    """Both halves of the plank and both posts' halves become one each, one after another."""
    stacked = [((0.12, 0.12, 0.15), (x, 0.0, z)) for x in (-0.5, 0.3) for z in (0.135, 0.275)]
    shape = load_shape(union(box(*PLANK), *(box(*post) for post in POSTS)))
    middle = np.array(shape.frame.centre)
    found = np.array([box_row(size, tuple(place - middle)) for size, place in (*HALVES, *stacked)])
    merged = [merge(FitSamples.of(shape, DRAFT, Run(threads=threads)), found, DRAFT) for threads in (1, 2, 4)]
    assert len(merged[0]) < len(found) - 1
    assert len({rows.tobytes() for rows in merged}) == 1
