"""A method that fits in no time: one box a shape, so that the glue around methods can be tested by itself."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar

import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.fields import Box
from partwright.methods import (
    METHODS,
    Ability,
    FitRequest,
    Fitted,
    Method,
    Outcome,
    Progress,
    check_number,
    preset,
)


@dataclass(frozen=True)
class Settings:
    method: ClassVar[str] = "superfrusta"

    max_parts: int | None = None
    min_iou: float | None = None

    def __post_init__(self) -> None:
        if self.max_parts is not None:
            check_number("max_parts", self.max_parts, low=1)


class BoxMethod(Method[Settings]):
    """Fits the bounding box, shrunk by `shrink`, and ends with `outcome`."""

    name = "superfrusta"
    can = frozenset(Ability)
    shrink = 1.0
    outcome: Outcome = "converged"

    def settings(self, quality: str = "normal", **changes: Any) -> Settings:
        return preset({"draft": Settings(), "normal": Settings()}, quality, changes)

    def fit(self, request: FitRequest[Settings]) -> Fitted:
        corners = request.shape.vertices
        lower, upper = corners.min(axis=0), corners.max(axis=0)
        size = tuple(((upper - lower) * self.shrink).tolist())
        assembly = Assembly((Part(Box(size), tuple(((lower + upper) / 2).tolist())),))
        request.run.told(Progress("optimising", 1, 2, 1, 0.5, 0.5, lambda: assembly))
        outcome = "interrupted" if request.run.cancel.requested else self.outcome
        return Fitted(assembly, outcome, {"seeding": 0.25})


@pytest.fixture(autouse=True)
def coarse(coarse_scores: None) -> None:
    """Commands are told by what they write and say: how exact scores are is tried in tests/metrics."""


@pytest.fixture
def method(monkeypatch: pytest.MonkeyPatch) -> BoxMethod:
    made = BoxMethod()
    monkeypatch.setitem(METHODS._own, "superfrusta", "tests.cli.box_method:METHOD")
    module = ModuleType("tests.cli.box_method")
    module.METHOD = made  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "tests.cli.box_method", module)
    return made


@pytest.fixture
def block(tmp_path: Path) -> Path:
    """A file with a 4 x 2 x 1 block far from the origin."""
    path = tmp_path / "block.stl"
    trimesh.creation.box((4, 2, 1)).apply_translation((10, 20, 30)).export(path)
    return path


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    """A file with two named nodes."""
    made = trimesh.Scene()
    for name, x in (("left", -2.0), ("right", 2.0)):
        made.add_geometry(
            trimesh.creation.box((1, 1, 1)).apply_translation((x, 0, 0)), node_name=name, geom_name=name
        )
    path = tmp_path / "pair.glb"
    made.export(path)
    return path
