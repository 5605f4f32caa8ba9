"""Counting what is asked of a method while it goes on doing its work."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


def points_asked(patch: pytest.MonkeyPatch, owner: type, method: str) -> list[int]:
    """How many points each call of `owner.method(points, ...)` from now on is given, as they come."""
    asked: list[int] = []
    original = getattr(owner, method)

    def counted(self: Any, points: np.ndarray) -> np.ndarray:
        asked.append(len(points))
        return np.asarray(original(self, points))

    patch.setattr(owner, method, counted)
    return asked
