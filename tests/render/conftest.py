"""What the tests of pictures share."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="module", autouse=True)
def small_previews() -> None:
    """As large as a user's."""
