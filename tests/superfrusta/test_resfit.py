"""Whole fits of small shapes: quality, part counts, budgets, interruptions, repeatability, units."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly
from partwright.errors import CancelledError, SettingError
from partwright.methods import Cancellation, FitRequest, Fitted, Progress, Run
from partwright.metrics.frames import in_unit_frame
from partwright.metrics.iou import iou
from partwright.shapes import Shape, load_shape
from partwright.superfrusta import Settings, carving, resfit
from partwright.superfrusta.carving import Carving
from partwright.superfrusta.close_look import CloseLook
from partwright.superfrusta.fit import fit
from partwright.superfrusta.flat_tree import flattened
from partwright.superfrusta.outcome import Step, chosen
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.samples import NOTHING, FitSamples
from partwright.superfrusta.symmetric_fit import RepeatedPart
from tests.superfrusta.meshes import box, bracket, corner_tie, drilled_block, half_torus, pipe, table, union
from tests.superfrusta.rows import random_rows

OUTCOMES = {"converged", "budget_reached", "target_reached", "interrupted"}


def draft(shape: Shape, threads: int = 1, progress=None, seed: int = 0, cancel=None, **changes) -> Fitted:
    run = Run(seed, threads=threads, progress=progress, cancel=cancel or Cancellation())
    return FitRequest(shape, Settings.for_quality("draft", **changes), run).fitted()


def reached(assembly: Assembly, shape: Shape) -> float:
    return iou(in_unit_frame(assembly, shape.frame).distance, shape.unit_occupancy(128))


@pytest.mark.parametrize(
    ("mesh", "least", "most"),
    [
        pytest.param(box((2, 1, 0.6)), 0.99, 1, id="box"),
        pytest.param(trimesh.creation.icosphere(3), 0.99, 1, id="ball"),
        pytest.param(trimesh.creation.cone(0.5, 2.0, sections=48), 0.98, 1, id="cone"),
        pytest.param(bracket(), 0.98, 3, id="bracket"),
        pytest.param(table(), 0.97, 7, id="table"),
        pytest.param(half_torus(), 0.95, 3, id="half torus"),
        pytest.param(pipe(), 0.97, 1, id="pipe"),
        pytest.param(box((2, 2, 0.05)), 0.97, 2, id="plate"),
    ],
)
def test_known_solids_need_few_parts(mesh: trimesh.Trimesh, least: float, most: int) -> None:
    shape = load_shape(mesh)
    fitted = draft(shape)
    assert len(fitted.assembly) <= most
    assert reached(fitted.assembly, shape) > least
    assert fitted.outcome in OUTCOMES - {"interrupted"}
    assert all(spent >= 0 for spent in fitted.seconds.values())
    assert fitted.history[-1]["parts"] == len(fitted.assembly)


def test_no_part_runs_out_of_the_shape() -> None:
    shape = load_shape(corner_tie())
    margin = 0.05 * np.ptp(shape.vertices, axis=0).max()
    for seed in (0, 2):
        lower, upper = draft(shape, seed=seed).assembly.bounds()
        assert (lower > shape.vertices.min(axis=0) - margin).all()
        assert (upper < shape.vertices.max(axis=0) + margin).all()


@pytest.fixture(scope="module")
def table_shape() -> Shape:
    return load_shape(table())


def test_the_same_seed_gives_the_same_bytes_at_any_number_of_threads(tmp_path) -> None:
    written = set()
    for threads in (1, 2, 4):
        path = tmp_path / f"{threads}.json"
        draft(load_shape(table()), threads, seed=5).assembly.save(path)
        written.add(path.read_bytes())
    assert len(written) == 1


def test_every_stage_gives_the_same_bytes_at_any_number_of_threads(tmp_path) -> None:
    """Those that try several ways at once: mending, repeats, the last polish and changes, carving."""
    stages = {"mends": 2, "looks": 6, "changes": 2, "trials": 3, "rounds": 6}
    shape = load_shape(trimesh.util.concatenate([table(), box((0.5, 0.05, 0.9), (0, 0.5, 0.6))]))
    spent, written = set(), set()
    for threads in (1, 3):
        path = tmp_path / f"{threads}.json"
        fitted = draft(shape, threads, seed=1, **stages)
        fitted.assembly.save(path)
        written.add(path.read_bytes())
        spent |= set(fitted.seconds)
    assert {"merge", "thin", "mend", "symmetry", "polish", "change"} <= spent
    assert len(written) == 1


@pytest.mark.parametrize("most", [1, 3])
def test_no_more_parts_than_asked_for(table_shape: Shape, most: int) -> None:
    fitted = draft(table_shape, max_parts=most)
    assert len(fitted.assembly) <= most
    assert fitted.outcome == "budget_reached"
    assert reached(fitted.assembly, table_shape) > {1: 0.4, 3: 0.7}[most]


def test_a_target_is_reached_with_fewer_parts_than_a_full_fit() -> None:
    """A long bar with small knobs: the bar alone is 0.93 of the volume."""
    knobs = [box((0.1, 0.1, 0.2), (x, 0, 0.3)) for x in (-0.8, -0.4, 0.0, 0.4, 0.8)]
    shape = load_shape(union(box((2, 0.3, 0.4)), *knobs))
    fitted = draft(shape, min_iou=0.85)
    assert len(fitted.assembly) == 1
    assert fitted.outcome == "target_reached"
    assert reached(fitted.assembly, shape) > 0.85
    unreachable = draft(shape, min_iou=0.99, max_parts=1)
    assert unreachable.outcome == "budget_reached"
    assert reached(unreachable.assembly, shape) > 0.85


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({}, 4),  # not 11, which is worse and larger
        ({"max_parts": 3}, 2),
        ({"min_iou": 0.9}, 2),
        ({"min_iou": 0.99}, 4),
        ({"min_iou": 0.99, "max_parts": 2}, 2),
        ({"alpha": 0.3}, 1),
    ],
)
def test_the_result_of_a_curve_is_the_best_of_its_sizes(changes: dict[str, float], parts: int) -> None:
    sizes = ((1, 0.7), (2, 0.9), (4, 0.983), (11, 0.964))
    steps = [Step(np.zeros((n, 17), np.float32), reached, reached) for n, reached in sizes]
    assert len(chosen(steps, Settings(curve=True, **changes)).rows) == parts


def test_a_curve_has_its_result_among_its_sizes(table_shape: Shape) -> None:
    fitted = draft(table_shape, curve=True, symmetry=False)
    alpha = Settings.for_quality("draft").alpha
    best = max(fitted.curve, key=lambda point: point.score - alpha * point.parts)
    assert len(fitted.assembly) == best.parts
    assert [part.field for part in fitted.assembly.parts] == [part.field for part in best.assembly.parts]
    assert fitted.curve[-1].parts == 1


def test_progress_tells_where_the_fit_is(table_shape: Shape) -> None:
    seen: list[Progress] = []
    fitted = draft(table_shape, progress=seen.append)
    assert len(seen) == len(fitted.history)
    fractions = [step.fraction for step in seen]
    assert fractions == sorted(fractions)
    assert 0 < fractions[0] <= fractions[-1] <= 1
    assert all(step.round >= 1 and step.parts >= 1 and 0 <= step.iou <= 1 for step in seen)
    assert seen[-1].parts == len(fitted.assembly)
    assert seen[-1].iou > 0.95


def test_an_interruption_returns_the_best_so_far(table_shape: Shape) -> None:
    cancel = Cancellation()
    seen: list[Progress] = []

    def interrupt(step: Progress) -> None:
        seen.append(step)
        cancel.request()

    fitted = draft(table_shape, progress=interrupt, cancel=cancel)
    assert len(seen) == 1
    assert seen[0].assembly() == fitted.assembly
    assert fitted.outcome == "interrupted"
    assert len(fitted.assembly) >= 1
    assert reached(fitted.assembly, table_shape) > 0.5


def test_an_interruption_before_there_is_anything_is_an_error(table_shape: Shape) -> None:
    cancel = Cancellation()
    cancel.request()
    with pytest.raises(CancelledError):
        draft(table_shape, cancel=cancel)


@pytest.mark.parametrize(
    ("scale", "centre"),
    [(1e-6, (1e3, -2e3, 5.0)), (1e6, (0.0, 0.0, 0.0)), (1e6, (3e7, 0.0, -1e7))],
    ids=["tiny and far", "huge", "huge and far"],
)
def test_units_and_place_do_not_matter(scale: float, centre: tuple[float, float, float]) -> None:
    mesh = box((2, 1, 0.6))
    mesh.vertices = mesh.vertices * scale + centre
    shape = load_shape(mesh, unit="mm")
    assembly = draft(shape).assembly
    assert len(assembly) == 1
    assert reached(assembly, shape) > 0.99
    assert assembly.unit == "mm"
    part = assembly.parts[0]
    np.testing.assert_allclose(np.array(part.translation) - centre, 0, atol=2e-3 * scale)
    lower, upper = part.bounds()
    np.testing.assert_allclose(upper - lower, np.array([2, 1, 0.6]) * scale, rtol=0.02)


def test_settings_that_cannot_be_used_are_named() -> None:
    for changes, message in [
        ({"max_parts": 0}, "max_parts: expected a number of at least 1, got 0"),
        ({"min_iou": 1.5}, "min_iou: expected a number of at least 0 and at most 1, got 1.5"),
        ({"min_iou": float("nan")}, "min_iou"),
        ({"max_parts": "4"}, "max_parts"),
        ({"optimiser": "sgd"}, "optimiser"),
        ({"colour": "red"}, "unknown settings: colour"),
    ]:
        with pytest.raises(SettingError, match=message):
            Settings.for_quality("draft", **changes)
    with pytest.raises(SettingError, match="quality: expected one of draft, normal, high"):
        Settings.for_quality("best")


BRIEF = {"near": 8000, "uniform": 8000, "resolution": 64, "mends": 0, "symmetry": False}


def test_a_shape_full_of_holes_is_a_body_and_its_holes() -> None:
    shape = load_shape(drilled_block())
    fitted = fit(FitRequest(shape, Settings(**BRIEF), Run(threads=1)))
    added = [part for part, plus in flattened(fitted.assembly) if plus]
    assert (len(added), len(fitted.assembly)) == (1, 5)
    assert reached(fitted.assembly, shape) > 0.99


def test_holes_are_built_around_where_nothing_may_be_subtracted() -> None:
    brief = Settings(**BRIEF | {"rounds": 3, "resolution": 48}, subtract=False)
    fitted = fit(FitRequest(load_shape(drilled_block()), brief, Run(threads=1)))
    assert all(plus for _, plus in flattened(fitted.assembly))


def test_an_attempt_to_carve_that_does_not_pay_changes_nothing(
    table_shape: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(**BRIEF)
    samples = FitSamples.of(table_shape, settings, Run(threads=1))
    search = ResidualFit(samples, settings)
    search.attempt(NOTHING)
    best, objective = search.best, search.best_objective
    monkeypatch.setattr(carving, "_GOOD", 1.0)  # so that it is tried although the table is whole
    assert Carving(search).tried()
    assert search.rival is not None
    assert search.best is best
    assert (search.best_objective, search.settings) == (objective, settings)


def test_an_interruption_while_carving_keeps_what_was_there() -> None:
    cancel = Cancellation()
    seen: list[float] = []

    def stop(step: Progress) -> None:
        seen.append(step.fraction)
        if step.fraction >= 0.5:  # the opening that subtracts is gone on with
            cancel.request()

    shape = load_shape(drilled_block())
    stopped = fit(FitRequest(shape, Settings(**BRIEF), Run(threads=1, progress=stop, cancel=cancel)))
    assert stopped.outcome == "interrupted"
    assert reached(stopped.assembly, shape) > 0.9
    assert seen == sorted(seen)
    assert max(seen) < 0.7


def test_an_interruption_while_all_parts_are_polished_keeps_them(
    table_shape: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Drafts are not polished: this one is to be."""
    cancel = Cancellation()
    begun = CloseLook.at

    def interrupted(shape: Shape, samples: FitSamples) -> CloseLook:
        cancel.request()
        return begun(shape, samples)

    whole = draft(table_shape)
    monkeypatch.setattr(CloseLook, "at", interrupted)
    stopped = draft(table_shape, cancel=cancel, looks=8)
    assert stopped.outcome == "interrupted"
    assert stopped.assembly == whole.assembly


def test_what_is_locked_and_holes_that_are_known_are_not_polished(
    table_shape: Shape, monkeypatch: pytest.MonkeyPatch
) -> None:
    told = []
    monkeypatch.setattr(resfit, "last_polished", lambda *given: told.append(given) or given[2])
    settings = Settings.for_quality("draft")
    search = ResidualFit(FitSamples.of(table_shape, settings), settings, locked=1)
    search.leaves = [RepeatedPart(row) for row in random_rows(5, seed=0)]
    search.polish(table_shape, 2)
    assert told[0][-1].tolist() == [False, True, True, False, False]
