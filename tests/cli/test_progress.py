"""The bar: reading, fitting, scores and writing each have a share, and it never goes back."""

from __future__ import annotations

import io
import sys

import pytest

from partwright.cli.progress import Display
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
