"""The bar: each stage has a share, and it never goes back. Plain lines: how much longer it takes."""

from __future__ import annotations

import io
import sys
from types import SimpleNamespace

import pytest

from partwright.cli import progress
from partwright.cli.progress import Count, Display
from partwright.methods import Progress


def test_every_stage_has_a_share(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FORCE_COLOR", "1")  # a bar though no terminal reads it
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    places = []
    with Display() as display:
        assert display._bar is not None

        def place() -> tuple[str, float]:
            (task,) = display._bar.tasks
            return task.description, task.completed

        places.append(place())
        for fraction in (0.0, 0.5, 1.0):
            display.show(Progress("optimising", 1, 2, 1, 0.5, fraction))
            places.append(place())
        display.stage("writing")
        places.append(place())
    assert [name for name, _ in places] == ["reading", "optimising", "optimising", "scores", "writing"]
    shares = [done for _, done in places]
    assert shares == sorted(set(shares))
    assert shares[0] == 0.0
    assert shares[-1] < 1.0


def test_lines_say_how_much_longer_it_takes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By what was done since the first line; anew where something else is counted, as steps after views."""
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    now = 100.0
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: now))
    with Count("training") as count:
        for done, of in ((4, 20), (8, 20), (1, 90), (2, 90), (90, 90)):
            now += 100
            count.show(done, of, "so far")
    assert capsys.readouterr().err.splitlines() == [
        "partwright: training: 4/20  so far",
        "partwright: training: 8/20  so far  5 min left",
        "partwright: training: 1/90  so far",
        "partwright: training: 2/90  so far  2.4 h left",
        "partwright: training: 90/90  so far",
    ]
