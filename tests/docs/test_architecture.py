"""docs/architecture.md: the drawing of the rooms is what import-linter holds the code to."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SEPARATOR = re.compile(r"([|:])")


def floor(text: str) -> list[str]:
    """Rooms and what separates them, without rooms that are yet to be built: "(name)" and no such file."""
    tokens = [token.strip() for token in SEPARATOR.split(text)]
    rooms = [(tokens[i - 1] if i else "", tokens[i].strip("()")) for i in range(0, len(tokens), 2)]
    built = [(mark, name) for mark, name in rooms if is_there(name)]
    return [token for i, (mark, name) in enumerate(built) for token in ((mark, name) if i else (name,))]


def is_there(room: str) -> bool:
    place = ROOT / "partwright" / room
    return place.is_dir() or place.with_suffix(".py").is_file()


def test_the_drawing_is_the_import_contract() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    (layers,) = (c["layers"] for c in project["tool"]["importlinter"]["contracts"] if c["type"] == "layers")
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    drawn = [line.split("│")[1] for line in page.splitlines() if line.startswith("│")]
    assert [floor(line) for line in drawn] == [rooms for layer in layers if (rooms := floor(layer))]


def test_every_room_is_in_the_drawing() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    drawn = {name for line in page.splitlines() if line.startswith("│") for name in floor(line.split("│")[1])}
    packages = {path.parent.name for path in (ROOT / "partwright").glob("*/__init__.py")}
    assert packages <= drawn
