"""Runs in CSV files, a dataclass a line, so that a benchmark that was stopped goes on where it was."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar

Run = TypeVar("Run")


def read(path: Path, kind: Callable[..., Run]) -> list[Run]:
    """The file's runs; none where there is no file. An empty cell of a number is None."""
    if not path.is_file():
        return []
    types = {field.name: str(field.type) for field in fields(kind)}  # type: ignore[arg-type]
    with path.open(encoding="utf-8", newline="") as stream:
        lines = list(csv.DictReader(stream))
    return [kind(**{name: _value(text, types[name]) for name, text in line.items()}) for line in lines]


def _value(text: str, kind: str) -> Any:
    if kind.startswith("str"):
        return text
    if text == "":
        return None
    return int(text) if kind == "int" else float(text)


def append(path: Path, run: Any) -> None:
    """Adds a line to the file, and a header to a new one; a file of fewer columns gets what it lacks."""
    header, lines = text([run]).split("\n", 1)
    if not path.is_file():
        lines = f"{header}\n{lines}"
    elif path.read_text(encoding="utf-8").split("\n", 1)[0] != header:
        path.write_text(text(read(path, type(run)), type(run)), encoding="utf-8")
    with path.open("a", encoding="utf-8", newline="") as stream:
        stream.write(lines)


def text(runs: Iterable[Any], kind: Any = None) -> str:
    """A header and a line a run; `kind` is their class, which matters where there are none."""
    every = list(runs)
    stream = io.StringIO()
    names = [field.name for field in fields(kind or every[0])]
    writer = csv.DictWriter(stream, names, lineterminator="\n")
    writer.writeheader()
    for run in every:
        writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in asdict(run).items()})
    return stream.getvalue()
