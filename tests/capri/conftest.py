"""What tests of CAPRI share."""

from __future__ import annotations

from typing import Any

import pytest

from partwright.capri import tree_search
from partwright.capri.detection import DetectedQuadric, detect
from partwright.capri.oriented_points import OrientedPoints


@pytest.fixture
def detected_once(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Most of a quick fit is the detection of quadrics, the same for a shape whatever else is asked."""
    if "detected_anew" not in request.fixturenames:
        monkeypatch.setattr(tree_search, "detect", _remembered)


@pytest.fixture
def detected_anew() -> None:
    """For what is to find the same twice."""


def _remembered(surface: OrientedPoints, *rest: Any) -> list[DetectedQuadric]:
    key = surface.points.tobytes(), surface.normals.tobytes(), rest
    if key not in _detected:
        _detected[key] = detect(surface, *rest)
        for one in _detected[key]:  # a test that changed them would change what others find
            one.row.setflags(write=False)
            one.inliers.setflags(write=False)
    return list(_detected[key])


_detected: dict[Any, list[DetectedQuadric]] = {}
