"""Growth that subtracts beside growth that adds: which of them is gone on with, and when."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from partwright.methods import Run
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import Settings, carving
from partwright.superfrusta.carving import Carving
from partwright.superfrusta.frontier import Frontier
from partwright.superfrusta.objective import score, volume_iou
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.samples import NOTHING, FitSamples, Rows
from tests.superfrusta import meshes
from tests.superfrusta.meshes import drilled_block, table, union
from tests.superfrusta.rows import box

SETTINGS = Settings(near=8000, uniform=8000, resolution=64, mends=0, symmetry=False)
SLAB = box((1.8, 1.0, 0.2), (0.0, 0.0, 0.0))[None]


def search_of(shape: Shape) -> ResidualFit:
    return ResidualFit(FitSamples.of(shape, SETTINGS, Run(threads=1)), SETTINGS)


def rounds_that_add(search: ResidualFit) -> int:
    """Rounds of growth before an attempt that subtracts was gone on with, all of them where none was."""
    stages = [step["stage"] for step in search.history]
    return stages[: stages.index("start") if "start" in stages else None].count("grow")


def test_what_leads_by_far_is_gone_on_with_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    leading, sceptical = search_of(load_shape(drilled_block())), search_of(load_shape(drilled_block()))
    leading.run()
    assert rounds_that_add(leading) == 2
    assert leading.best is not None
    assert volume_iou(leading.samples, leading.best) > 0.98
    monkeypatch.setattr(carving, "_TELLING", 2.0)
    sceptical.run()
    assert rounds_that_add(sceptical) > 2


def test_what_has_lost_its_lead_when_it_ends_is_not_kept_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    search = search_of(load_shape(table()))
    led = []

    def kept(carving: Carving, cut: Rows) -> bool:
        led.append(cut)
        search.settings = carving.settings
        search.best, search.best_objective = cut, search.objective(cut)
        return False

    monkeypatch.setattr(carving, "_PROMISING", 2.0)
    monkeypatch.setattr(Carving, "opened", lambda _: SLAB)
    monkeypatch.setattr(Carving, "lead", lambda *_: 1.0)
    monkeypatch.setattr(carving, "_TELLING", -1.0)
    monkeypatch.setattr(Carving, "tried", kept)
    assert Carving(search).contest()
    assert led[0] is SLAB
    assert search.best is not None
    assert volume_iou(search.samples, search.best) > 0.98
    assert search.settings is SETTINGS


def test_what_is_far_behind_with_as_many_parts_is_not_gone_on_with(monkeypatch: pytest.MonkeyPatch) -> None:
    search = search_of(load_shape(table()))
    search.attempt(NOTHING)
    monkeypatch.setattr(carving, "_GOOD", 2.0)  # so that it would be tried although the table is whole
    cut = np.repeat(Carving(search).opened(), 2, axis=0)  # enough parts to tell
    told = len(search.history)
    search.reached.add(1, 2.0)
    assert Carving(search).tried(cut)
    assert len(search.history) == told


@pytest.mark.parametrize(
    ("pace", "rounds", "others", "given_up"),
    [
        pytest.param(0.01, 3, 0.7, True, id="too slow"),
        pytest.param(0.05, 3, 0.7, False, id="quick enough"),
        pytest.param(0.01, 12, 0.7, False, id="time enough"),
        pytest.param(0.01, 3, 0.5, False, id="better with as many parts"),
    ],
)
def test_an_attempt_that_its_pace_leaves_behind_is_given_up(
    table_search: ResidualFit, pace: float, rounds: int, others: float, given_up: bool
) -> None:
    search = table_search
    search.best, search.best_objective, search.rival = np.repeat(SLAB, 8, axis=0), 0.6, 0.75
    search.reached_before = Frontier([(4, 0.4), (8, others), (12, 0.8)])
    reached = [0.6 - pace * ago for ago in range(5, -1, -1)]
    assert search.too_slow(reached, rounds) == given_up
    assert not search.too_slow(reached[-2:], rounds)  # which say no pace
    search.rival = None
    assert not search.too_slow(reached, rounds)


@pytest.fixture
def table_search() -> ResidualFit:
    return search_of(load_shape(table()))


POSTS = [((0.2, 0.2, 1.0), (x, 0.0, 0.0)) for x in (-0.6, 0.6)]


def slab_search(**changes: object) -> ResidualFit:
    """Of a slab with two posts through it, with an attempt that has found the second post alone."""
    shape = load_shape(union(meshes.box((1.8, 1.0, 0.2)), *(meshes.box(*post) for post in POSTS)))
    settings = replace(SETTINGS, mends=4, **changes)
    search = ResidualFit(FitSamples.of(shape, settings, Run(threads=1)), settings)
    search.attempts = [box((1.6, 1.2, 0.15), (0.0, 0.0, 0.0))[None], box(*POSTS[1])[None]]
    return search


def test_what_another_attempt_has_found_is_taken_from_it() -> None:
    search = slab_search()
    best = np.concatenate([SLAB, box(*POSTS[0])[None]])
    found = Carving(search).recombined(best)
    assert len(found) == 3
    assert score(search.samples, found) > 0.98 > 0.95 > score(search.samples, best)
    assert Carving(search).recombined(found) is found  # there is nothing more to take


@pytest.mark.parametrize("asked", [{"max_parts": 2}, {"min_iou": 0.5}, {"curve": True}])
def test_nothing_is_taken_from_others_where_a_size_or_an_iou_is_asked_for(asked: dict[str, object]) -> None:
    best = np.concatenate([SLAB, box(*POSTS[0])[None]])
    assert len(Carving(slab_search(**asked)).recombined(best)) == 2


def test_what_each_attempt_came_to_is_kept_until_all_have_ended() -> None:
    search = search_of(load_shape(table()))
    search.attempt(NOTHING)
    first = search.best
    search.settings = Carving(search).settings
    search.attempt(NOTHING, 9)
    assert search.attempts[0] is first
    assert search.attempts[-1] is search.best
