"""A small piece of `benchmarks/fuzz.py`: broken files and odd commands end well, or with one named line."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize(
    ("files", "commands"), [(16, 2), pytest.param(40, 20, marks=pytest.mark.heavy)], ids=["few", "sixty"]
)
def test_cases_end_well(files: int, commands: int, tmp_path: Path) -> None:
    table = tmp_path / "fuzz.md"
    cases = ["--files", str(files), "--commands", str(commands), "--seed", "4"]
    ended = subprocess.run(
        [sys.executable, BENCHMARKS / "fuzz.py", *cases, "--to", table],
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout + ended.stderr
    assert f"**all files** | {files} |" in table.read_text()
    assert f"**all commands** | {commands} |" in table.read_text()


def fails(_: str) -> int:
    raise ValueError("of no kind that we know")


def breaks_down(_: str) -> int:
    os.abort()


def runs_for_ever(_: str) -> int:
    while True:
        pass


def says_nothing(_: str) -> int:
    return 2


def leaves_a_piece(_: str) -> int:
    Path("half.part").touch()
    os.write(1, b"error: disk full\n")
    return 2


@pytest.mark.parametrize(
    ("load", "way"),
    [
        (fails, "traceback"),
        (breaks_down, "crash"),
        (runs_for_ever, "hang"),
        (says_nothing, "traceback"),
        (leaves_a_piece, "left output"),
    ],
)
def test_what_is_no_good_end_is_noticed(
    load: Callable[[str], int], way: str, tmp_path: Path, monkeypatch: Any
) -> None:
    monkeypatch.syspath_prepend(BENCHMARKS)
    fuzz = pytest.importorskip("fuzz")
    monkeypatch.setattr(fuzz, "load", load)
    monkeypatch.setattr(fuzz, "MEMORY", 1 << 40)  # a forked process has its parent's, of all tests before
    folder = tmp_path / "case"
    folder.mkdir()
    assert fuzz.run_case(["load", "a.stl"], folder, 1).way == way
