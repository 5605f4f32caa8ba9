"""What the tests of superfrusta share."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def coarse(coarse_scores: None) -> None:
    """Fits are told by their assemblies here, hardly by scores."""
