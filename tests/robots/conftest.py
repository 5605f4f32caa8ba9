"""What the tests of robots share."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of the picture that every command draws a sixteenth: hardly a test says anything of it."""
    monkeypatch.setattr("partwright.robots.picture._PANEL", (140, 155))
