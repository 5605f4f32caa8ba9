"""Fits of several growths: the best is kept, parts are exchanged, cores and interruptions change nothing."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from partwright.errors import CancelledError
from partwright.methods import Cancellation, Checkpoint, FitRequest, Fitted, Progress, Run
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import Settings
from partwright.superfrusta.objective import score
from partwright.superfrusta.recombining import recombined
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.samples import NOTHING, FitSamples
from partwright.superfrusta.several_growths import SeveralGrowths
from partwright.superfrusta.side_by_side import SideBySide
from tests.superfrusta import rows as made
from tests.superfrusta.meshes import corner_tie, table

LEGS = [(x, y, 0.5) for x in (-0.85, 0.85) for y in (-0.5, 0.5)]
SETTINGS = Settings.for_quality("draft", attempts=3)


@pytest.fixture(scope="module")
def table_shape() -> Shape:
    return load_shape(table())


@pytest.fixture(scope="module")
def samples(table_shape: Shape) -> FitSamples:
    return FitSamples.of(table_shape, SETTINGS, Run(threads=2))


def draft(shape: Shape, threads: int = 1, progress=None, cancel=None, **changes) -> Fitted:
    run = Run(0, threads=threads, progress=progress, cancel=cancel or Cancellation())
    return FitRequest(shape, replace(SETTINGS, **changes), run).fitted()


def table_rows(shape: Shape) -> np.ndarray:
    """The top and the four legs, exactly."""
    scale = shape.frame.scale

    def block(size, centre) -> np.ndarray:
        return made.box(
            tuple(scale * s for s in size), tuple(scale * (np.array(centre) - shape.frame.centre))
        )

    return np.stack([block((2, 1.2, 0.15), (0, 0, 1)), *(block((0.15, 0.15, 1.05), leg) for leg in LEGS)])


@pytest.mark.parametrize("best", [0, 1, 2])
def test_of_several_growths_the_best_is_kept(
    best: int, table_shape: Shape, samples: FitSamples, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = table_rows(table_shape)
    worse = whole[:4].copy()  # a leg is missing, and another one hangs out
    worse[3, 2] -= 0.1

    def grown(fit: ResidualFit, start: np.ndarray = NOTHING) -> bool:
        fit.best = fit.unmended = whole if fit.samples.growth == best else worse
        fit.best_objective = fit.objective(fit.best)
        return True

    monkeypatch.setattr(ResidualFit, "grown", grown)
    search = ResidualFit(samples, SETTINGS)
    SeveralGrowths(search).grown(NOTHING)
    assert search.best is whole
    assert search.best_objective == search.objective(whole)


def test_it_is_no_worse_than_any_of_its_growths_and_the_first_is_that_of_a_fit_of_one() -> None:
    settings = Settings.for_quality("draft", attempts=3, rounds=2)
    drawn = FitSamples.of(load_shape(corner_tie()), settings, Run(threads=2))
    search = ResidualFit(drawn, settings)
    several = SeveralGrowths(search)
    growths, _ = several.grown(NOTHING)
    alone = ResidualFit(drawn, replace(settings, attempts=1))
    alone.run()
    found = [one.best for one in growths if one.best is not None]
    assert alone.best is not None
    assert search.best is not None
    np.testing.assert_array_equal(found[0], alone.best)
    assert len({one.tobytes() for one in found}) == 3
    values = [several.value(one) for one in found]
    assert several.value(search.best) == max(values)
    several.recombine(growths)
    assert several.value(search.best) >= max(values)


def test_what_is_better_in_either_is_taken(table_shape: Shape, samples: FitSamples) -> None:
    whole = table_rows(table_shape)
    halves = np.repeat(whole[[1]], 2, axis=0)  # a leg of two parts
    halves[:, 9] *= 0.5
    halves[:, 2] += (-0.5 * halves[0, 9], 0.5 * halves[0, 9])
    first = np.concatenate([whole[[0]], halves, whole[2:]])
    second = whole.copy()
    second[0, 1] += 0.1  # its top is out of place

    def value(rows: np.ndarray) -> float:
        return score(samples, rows) - SETTINGS.alpha * len(rows)

    for one, other in ((first, second), (second, first)):
        found = recombined(samples, one, other, SETTINGS, value)
        assert len(found) == 5
        assert value(found) > value(whole) - 0.01 > max(value(first), value(second)) - 0.01
        assert score(samples, found) > 0.97


def test_locked_parts_are_not_exchanged(table_shape: Shape, samples: FitSamples) -> None:
    whole = table_rows(table_shape)
    bad = whole.copy()
    bad[0, 1] += 0.1
    better = np.concatenate([bad[:1], whole])  # begins with the locked part, and has a better one beside it
    found = recombined(samples, bad, better, SETTINGS, lambda rows: score(samples, rows), locked=1)
    np.testing.assert_array_equal(found[0], bad[0])


@pytest.mark.parametrize("threads", [2, pytest.param(5, marks=pytest.mark.heavy)])
def test_the_number_of_threads_changes_nothing(threads: int) -> None:
    shape = load_shape(corner_tie())
    one, several = (draft(shape, number, rounds=2) for number in (1, threads))
    assert one.assembly == several.assembly
    assert one.history == several.history


def test_progress_only_goes_forward_and_is_told_in_the_waiting_thread(table_shape: Shape) -> None:
    seen: list[tuple[Progress, int]] = []
    fitted = draft(table_shape, 2, progress=lambda step: seen.append((step, threading.get_ident())))
    fractions = [step.fraction for step, _ in seen]
    assert fractions == sorted(fractions)
    assert 0 < fractions[0] < 0.5
    assert fractions[-1] == 1
    assert {thread for _, thread in seen} == {threading.get_ident()}
    assert seen[-1][0].parts == len(fitted.assembly)
    assert fitted.seconds["grow"] > 0


@pytest.mark.parametrize(("share", "threads"), [(0.2, 2), (0.5, 1), (0.76, 2)])
def test_an_interruption_keeps_the_best_so_far(table_shape: Shape, share: float, threads: int) -> None:
    cancel = Cancellation()
    best = []

    def stop(step: Progress) -> None:
        if step.fraction > share:
            best.append(step.assembly())
            cancel.request()

    fitted = draft(table_shape, threads, progress=stop, cancel=cancel, symmetry=False)
    assert fitted.outcome == "interrupted"
    assert best[0] is not None
    assert len(fitted.assembly) >= 1


def test_an_interruption_before_there_is_anything_is_an_error(table_shape: Shape) -> None:
    cancel = Cancellation()
    cancel.request()
    with pytest.raises(CancelledError):
        draft(table_shape, cancel=cancel)


def test_growths_come_back_by_number_and_a_failure_stops_the_others(samples: FitSamples) -> None:
    begun = threading.Event()

    def number(number: int, own: FitSamples, checkpoint: Checkpoint, told) -> tuple[int, int, int]:
        return number, own.growth, own.threads

    assert SideBySide[tuple[int, int, int]](samples)(number, 3) == [(0, 0, 1), (1, 1, 1), (2, 2, 1)]

    def fails(number: int, own: FitSamples, checkpoint: Checkpoint, told) -> None:
        if number == 1:
            assert begun.wait(10)
            raise MemoryError("number 1")
        begun.set()
        while True:
            checkpoint()

    with pytest.raises(MemoryError, match="number 1"):
        SideBySide[None](samples)(fails, 2)


def test_an_error_of_who_is_told_stops_all_growths(table_shape: Shape) -> None:
    def told(step: Progress) -> None:
        raise ValueError("no more")

    with pytest.raises(ValueError, match="no more"):
        draft(table_shape, 2, progress=told)


def test_growths_optimise_on_others_of_the_same_samples(samples: FitSamples) -> None:
    first, second, again = (samples.variant(growth, Checkpoint(), 1) for growth in (0, 1, 1))
    np.testing.assert_array_equal(first.optimised_indices, samples.optimised_indices)
    np.testing.assert_array_equal(second.optimised_indices, again.optimised_indices)
    assert len(second.optimised_indices) == len(first.optimised_indices)
    assert len(np.unique(second.optimised_indices)) == len(second.optimised_indices)
    assert not np.array_equal(second.optimised_indices, first.optimised_indices)
    assert (np.diff(second.optimised_indices) > 0).all()


def test_high_is_normal_several_times() -> None:
    high = Settings.for_quality("high")
    assert high.attempts > 1
    assert replace(high, attempts=1) == Settings.for_quality("normal")
