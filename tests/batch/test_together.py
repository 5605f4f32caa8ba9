"""Many shapes at once: the same assemblies as one by one, errors in place, interruptions."""

from __future__ import annotations

import os
import signal
import threading
import time

import pytest
import trimesh

import partwright as pw
from partwright.batch import fit_many
from partwright.errors import SettingError
from partwright.fitting import Result, fit

SHAPES = [
    trimesh.creation.box((2, 1, 0.6)),
    trimesh.creation.cylinder(0.5, 2.0, sections=48),
    trimesh.creation.annulus(0.4, 1.0, 0.5),
]


def test_the_assemblies_are_those_of_single_fits() -> None:
    shapes = [pw.load_shape(mesh) for mesh in SHAPES]
    seen: set[int] = set()
    together = fit_many(shapes, at_once=3, progress=lambda i, _: seen.add(i), quality="draft")
    assert seen == {0, 1, 2}
    for shape, result in zip(shapes, together, strict=True):
        assert isinstance(result, Result)
        alone = fit(shape, quality="draft", threads=1)
        assert result.assembly == alone.assembly
        assert result.scores.iou == alone.scores.iou


def test_an_interruption_keeps_what_there_is_and_begins_no_more() -> None:
    shapes = [pw.load_shape(mesh) for mesh in SHAPES]
    asked = threading.Event()

    def stop(index: int, step: object) -> None:
        if not asked.is_set():
            asked.set()
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(1)  # for the main thread to hear it before this shape is done

    results = fit_many(shapes, at_once=1, progress=stop, quality="draft")
    assert len(results) == 3
    assert results[2] is None
    assert all(r is None or (isinstance(r, Result) and r.assembly.parts) for r in results)


@pytest.mark.parametrize("at_once", [-1, 1.5, True])
def test_bad_counts(at_once: object) -> None:
    with pytest.raises(SettingError, match="at_once"):
        fit_many([], at_once=at_once)  # type: ignore[arg-type]


def test_a_wrong_option_is_an_error_not_a_result() -> None:
    with pytest.raises(SettingError, match="quality"):
        fit_many([pw.load_shape(SHAPES[0])], quality="best")


def test_no_shapes_no_results() -> None:
    assert fit_many([]) == []
