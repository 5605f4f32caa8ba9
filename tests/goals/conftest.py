"""What the tests of goals share."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def small_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ninth of the pixels: what the tests say of pictures and films does not depend on their size."""
    monkeypatch.setattr("partwright.goals.pictures._PANEL", (153, 133))
    monkeypatch.setattr("partwright.goals.pictures._FRAME", (120, 107))
