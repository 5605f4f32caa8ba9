"""A method that fits in no time: one box a shape, so that the glue around methods can be tested by itself."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import trimesh

from partwright import fitting
from partwright.assembly import Assembly, Part
from partwright.errors import SettingError
from partwright.fields import Box
from partwright.shapes import Shape


@dataclass(frozen=True)
class Settings:
    max_parts: int = 24
    seed: int = 0

    @classmethod
    def for_quality(cls, quality: str, *, max_parts: int | None = None, seed: int = 0, **_: Any) -> Settings:
        if max_parts is not None and max_parts < 1:
            raise SettingError(f"max_parts: expected at least 1, got {max_parts}")
        return cls(max_parts or 24, seed)


@dataclass(frozen=True)
class Progress:
    stage: str = "optimising"
    round: int = 1
    rounds: int = 2
    parts: int = 1
    iou: float = 0.5
    fraction: float = 0.5


@dataclass(frozen=True)
class Fitted:
    assembly: Assembly
    outcome: str = "converged"
    seconds: dict[str, float] = field(default_factory=lambda: {"seeding": 0.25})
    curve: tuple[Any, ...] = ()


class BoxMethod(ModuleType):
    """Fits the bounding box, shrunk by `shrink`, and ends with `outcome`."""

    Settings = Settings
    shrink = 1.0
    outcome = "converged"

    def fit(
        self,
        shape: Shape,
        settings: Settings,
        progress: Callable[[Any], None] | None = None,
        start: Assembly | None = None,
        locked: Sequence[str] = (),
    ) -> Fitted:
        if progress:
            progress(Progress())
        lower, upper = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
        size = tuple(((upper - lower) * self.shrink).tolist())
        part = Part(Box(size), tuple(((lower + upper) / 2).tolist()))
        return Fitted(Assembly((part,)), self.outcome)


@pytest.fixture
def method(monkeypatch: pytest.MonkeyPatch) -> BoxMethod:
    made = BoxMethod("box_method")
    monkeypatch.setitem(sys.modules, "box_method", made)
    monkeypatch.setitem(fitting.METHODS, "superfrusta", "box_method")
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
