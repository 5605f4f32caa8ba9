"""Many shapes at once: the same assemblies as one by one, errors in place, interruptions."""

from __future__ import annotations

import os
import pickle
import signal
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.batch import Limits, fit_many
from partwright.errors import EmptyShapeError, SettingError, UnreadableFileError, WorkerError
from partwright.fitting import Result, fit
from partwright.methods import Cancellation, Progress

SHAPES = [
    trimesh.creation.box((2, 1, 0.6)),
    trimesh.creation.cylinder(0.5, 2.0, sections=48),
    trimesh.creation.annulus(0.4, 1.0, 0.5),
]


def test_the_assemblies_are_those_of_single_fits(tmp_path: Path) -> None:
    file, cut = tmp_path / "box.stl", tmp_path / "cut.stl"
    SHAPES[0].export(file)
    cut.write_bytes(file.read_bytes()[:300])
    shapes = [pw.load_shape(SHAPES[2])]
    seen: set[int] = set()
    together = fit_many([cut, file, *shapes], 2, progress=lambda i, _: seen.add(i), quality="draft")
    assert seen == {1, 2}
    assert isinstance(together[0], UnreadableFileError)
    for shape, result in zip([pw.load_shape(file), *shapes], together[1:], strict=True):
        assert isinstance(result, Result)
        alone = fit(shape, quality="draft", threads=1)
        assert result.assembly == alone.assembly
        assert result.scores.iou == alone.scores.iou


def test_a_worker_that_falls_or_hangs_costs_its_own_shape(fake: Path) -> None:
    names = ["a.stl", "segfault.stl", "hang.stl", "z.stl"]
    found = fit_many(names, at_once=2, limits=Limits(seconds=2.0))
    assert [(type(one), str(one)) for one in found] == [
        (EmptyShapeError, "a.stl"),  # what the fake makes of every shape
        (WorkerError, "segfault.stl: the worker died by signal 11: about to fall"),
        (WorkerError, "hang.stl: took more than 2 s"),
        (EmptyShapeError, "z.stl"),
    ]
    assert Counter(fake.read_text().split())["segfault.stl"] == 2  # it got a second worker


def test_ctrl_c_ends_what_runs_with_what_it_has_and_begins_no_more(fake: Path) -> None:
    def stop(index: int, step: Progress) -> None:
        assert (index, step.parts, step.assembly()) == (0, 3, None)
        os.kill(os.getpid(), signal.SIGINT)

    asked = []
    results = fit_many(["steps", "z"], 1, lambda i, step: asked.append(i) or len(asked) > 1 or stop(i, step))
    assert isinstance(results[0], EmptyShapeError)
    assert results[1] is None
    assert fake.read_text().split() == ["steps"]


def test_an_error_in_a_progress_callback_ends_everything(fake: Path) -> None:
    def fall(index: int, step: Progress) -> None:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fit_many(["steps", "hang"], at_once=2, progress=fall)


def test_results_are_whole_after_their_journey(tmp_path: Path) -> None:
    shape = pw.load_shape(SHAPES[0], unit="mm")
    (result,) = fit_many([shape], quality="draft", method="solids")
    assert isinstance(result, Result)
    assert result.shape is shape
    assert result.surface.is_watertight
    assert result.with_density(1000.0).report["mass_properties"]["mass"] == pytest.approx(1.2e-6, rel=1e-3)
    result.save(tmp_path / "out")
    assert pw.load_assembly(tmp_path / "out" / "assembly.json") == result.assembly


def test_a_shape_is_the_same_after_pickling() -> None:
    shape = pw.load_shape(SHAPES[2], unit="cm", up="y")
    again = pickle.loads(pickle.dumps(shape))
    points = np.random.default_rng(0).uniform(-1.2, 1.2, (200, 3))
    assert np.array_equal(again.signed_distance(points), shape.signed_distance(points))
    assert (again.unit, again.up, again.volume, again.repairs) == ("cm", "y", shape.volume, shape.repairs)
    assert np.array_equal(again.samples(50, 50).points, shape.samples(50, 50).points)


def test_an_interruption_keeps_what_there_is_and_begins_no_more() -> None:
    shapes = [pw.load_shape(mesh) for mesh in SHAPES]
    cancel = Cancellation()
    results = fit_many(
        shapes, at_once=1, progress=lambda index, step: cancel.request(), cancel=cancel, quality="high"
    )
    assert len(results) == 3
    assert results[1] is results[2] is None
    assert results[0] is None or (isinstance(results[0], Result) and results[0].outcome == "interrupted")


def test_an_option_that_cannot_travel_is_an_error() -> None:
    with pytest.raises(SettingError, match="cannot be sent"):
        fit_many([pw.load_shape(SHAPES[0])], start=lambda: None)


@pytest.mark.parametrize("limits", [(0, 1), (float("nan"), 1), (float("inf"), 1), (1, 0)])
def test_bad_limits(limits: tuple[float, int]) -> None:
    with pytest.raises(SettingError, match="limits of"):
        Limits(*limits)


@pytest.mark.parametrize("at_once", [-1, 1.5, True])
def test_bad_counts(at_once: object) -> None:
    with pytest.raises(SettingError, match="at_once"):
        fit_many([], at_once=at_once)  # type: ignore[arg-type]


def test_a_wrong_option_is_an_error_not_a_result() -> None:
    with pytest.raises(SettingError, match="quality"):
        fit_many([pw.load_shape(SHAPES[0])], quality="best")


def test_no_shapes_no_results() -> None:
    assert fit_many([]) == []
