"""The last steps of a fit, that feel how far off parts are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from partwright.fields.columns import Column
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import Settings
from partwright.superfrusta.close_look import CloseLook
from partwright.superfrusta.deviations import norm
from partwright.superfrusta.last_polish import Polish, Trial, last_polished
from partwright.superfrusta.objective import score, volume_iou
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.symmetric_fit import LeafSteps, RepeatedPart, expanded
from partwright.superfrusta.symmetry import Isometry
from tests.superfrusta.meshes import box, union
from tests.superfrusta.rows import box as box_row

SETTINGS = dataclasses.replace(Settings.for_quality("draft"), looks=24)
BOTH = np.ones(2, bool)
BODY, ARM = ((1.2, 0.8, 0.5), (-0.3, 0.0, 0.0)), ((0.6, 0.2, 0.5), (0.6, 0.0, 0.0))


@pytest.fixture(scope="module")
def shape() -> Shape:
    return load_shape(union(box(*BODY), box(*ARM)))


@pytest.fixture(scope="module")
def samples(shape: Shape) -> FitSamples:
    return FitSamples.of(shape, SETTINGS)


def leaves(out: float = 0.05) -> list[RepeatedPart]:
    """The arm is too long, and a bit too thin."""
    arm = box_row((0.6 + out, 0.19, 0.5), (0.6 + out / 2, 0.0, 0.0))
    return [RepeatedPart(box_row(*BODY)), RepeatedPart(arm)]


def off(shape: Shape, samples: FitSamples, found: list[RepeatedPart]) -> float:
    return CloseLook.at(shape, samples).deviations(expanded(found)).norm


def test_what_sticks_out_is_taken_in(shape: Shape, samples: FitSamples) -> None:
    before = leaves()
    after = last_polished(shape, samples, before, SETTINGS, BOTH)
    assert off(shape, samples, after) < 0.5 * off(shape, samples, before)
    assert score(samples, expanded(after)) > score(samples, expanded(before))


def test_what_is_near_and_what_is_not_to_move_stays(shape: Shape, samples: FitSamples) -> None:
    right, before = leaves(0.0), leaves()
    right[1] = RepeatedPart(box_row(*ARM))
    assert all(
        (a.row == b.row).all()
        for a, b in zip(last_polished(shape, samples, right, SETTINGS, BOTH), right, strict=True)
    )
    assert last_polished(shape, samples, before, dataclasses.replace(SETTINGS, looks=0), BOTH) is before
    assert last_polished(shape, samples, before, SETTINGS, np.zeros(2, bool)) is before
    turned = [before[1], before[0]]
    half = last_polished(shape, samples, turned, SETTINGS, np.array([False, True]))
    assert (half[0].row == turned[0].row).all()


def test_copies_move_as_one() -> None:
    arms = [((0.3, 0.2, 0.5), (x, 0.0, 0.0)) for x in (-0.75, 0.75)]
    shape = load_shape(union(box((1.2, 0.8, 0.5)), *(box(*arm) for arm in arms)))
    samples = FitSamples.of(shape, SETTINGS)
    mirror = Isometry(np.diag([-1.0, 1.0, 1.0]), np.zeros(3))
    arm = RepeatedPart(box_row((0.36, 0.2, 0.5), (0.78, 0.0, 0.0)), (mirror,))
    before = [RepeatedPart(box_row((1.2, 0.8, 0.5))), arm]
    after = last_polished(shape, samples, before, SETTINGS, BOTH)
    assert after[1].isometries == (mirror,)
    assert off(shape, samples, after) < 0.6 * off(shape, samples, before)
    # The further copy is as near as the first.
    seen = CloseLook.at(shape, samples).deviations(expanded(after)).by_part
    assert norm(seen) < 0.06
    assert seen[1] == pytest.approx(seen[2], abs=0.012)


def test_each_place_that_a_part_is_off_counts(shape: Shape, samples: FitSamples) -> None:
    """A body that is too long on one side, and on two: by the same length, but twice."""

    def polish(low: float, high: float) -> Trial:
        body = box_row((1.2 + low + high, 0.8, 0.5), (-0.3 + (high - low) / 2, 0.0, 0.0))
        given = [RepeatedPart(body), RepeatedPart(box_row(*ARM))]
        made = Polish(CloseLook.at(shape, samples), SETTINGS, LeafSteps.of(given, SETTINGS, BOTH))
        return made.trial(np.stack([one.row for one in given]))

    one, two = polish(0.06, 0.0), polish(0.06, 0.06)
    assert one.by_place.max() == pytest.approx(two.by_place.max(), rel=0.1)
    assert norm(two.by_place) > 1.1 * norm(one.by_place)
    for trial in (one, two):
        assert len(trial.by_place) == len(np.unique(trial.place)) > 1
        for place, furthest in enumerate(trial.by_place):
            mine = trial.place == place
            assert trial.off.off[mine].max() == pytest.approx(furthest)
            assert (np.ptp(trial.off.points[mine], axis=0) < 0.2 + 1e-6).all()
            assert len(np.unique(trial.off.part[mine])) == 1


def test_an_iou_that_is_asked_for_is_kept(shape: Shape, samples: FitSamples) -> None:
    before = leaves()
    there = volume_iou(samples, expanded(before))
    asked = dataclasses.replace(SETTINGS, min_iou=there)
    assert volume_iou(samples, expanded(last_polished(shape, samples, before, asked, BOTH))) >= there


def test_few_looks_are_few(shape: Shape, samples: FitSamples, monkeypatch: pytest.MonkeyPatch) -> None:
    looked = []
    whole = CloseLook.deviations
    monkeypatch.setattr(CloseLook, "deviations", lambda self, rows: looked.append(1) or whole(self, rows))
    turned = leaves()
    turned[1].row[4:7] += 0.1
    after = last_polished(shape, samples, turned, dataclasses.replace(SETTINGS, looks=3), BOTH)
    assert len(looked) == 3
    looked.clear()
    last_polished(shape, samples, after, dataclasses.replace(SETTINGS, looks=1), BOTH)
    assert len(looked) == 1


def test_the_same_again(shape: Shape, samples: FitSamples) -> None:
    one, other = (last_polished(shape, samples, leaves(), SETTINGS, BOTH) for _ in range(2))
    assert (expanded(one) == expanded(other)).all()


def test_lengths_are_not_bought_with_parts_that_cover_one_another(
    shape: Shape, samples: FitSamples, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = LeafSteps.of(leaves(), SETTINGS, BOTH)
    polish = Polish(CloseLook.at(shape, samples), SETTINGS, steps)
    rows = np.array([leaf.row for leaf in leaves()])
    assert polish.overlap(rows) == 0
    moved = rows.copy()
    moved[1, 0] -= 0.3
    volume, both = 1.2 * 0.8 * 0.5 + 0.65 * 0.19 * 0.5, 0.3 * 0.19 * 0.5
    assert polish.overlap(moved) == pytest.approx(both / (volume - both), rel=0.25)
    shares = iter([0.0] + [1.0] * SETTINGS.looks)
    monkeypatch.setattr(Polish, "overlap", lambda *_: next(shares))
    assert (polish.best(rows) == rows).all()


def test_a_part_that_is_bent_too_far_already_does_not_jump() -> None:
    bent = box_row(*ARM)
    bent[Column.BULGE] = 1.0  # wider than long
    bent[Column.SX], bent[Column.SZ] = 0.8, 0.4
    leaves = [RepeatedPart(box_row(*BODY)), RepeatedPart(bent)]
    rows = np.array([leaf.row for leaf in leaves])
    steps = LeafSteps.of(leaves, SETTINGS, BOTH)
    still = np.zeros(steps.projected(np.zeros(30), np.zeros((30, 30)))[0].shape)
    assert np.allclose(steps.taken(rows, still), rows, atol=1e-6)
    assert steps.taken(rows, still + 0.1)[1, Column.BULGE] <= 1.0
