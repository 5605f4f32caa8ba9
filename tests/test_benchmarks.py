"""The benchmarks keep up with the package: all that they import of it is there."""

from __future__ import annotations

import ast
import importlib.util
import re
import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"
SCRIPTS = sorted(FOLDER.glob("*.py"))


OF_BENCH = ("coacd", "fast_simplification", "ray")  # which those who test need not have


def benchmark(name: str) -> Any:
    """A benchmark's module, by its file: tests have a module `solids`, too. What it imports of its neighbours
    does not stay either."""
    spec = importlib.util.spec_from_file_location(f"benchmarks_{name}", FOLDER / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        for path in SCRIPTS:  # as it is now, it is again
            patch.setitem(sys.modules, path.stem, None)
            del sys.modules[path.stem]
        patch.setitem(sys.modules, spec.name, module)  # dataclasses look there
        patch.syspath_prepend(FOLDER)
        spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_a_benchmark_can_be_imported(path: Path) -> None:
    try:
        benchmark(path.stem)
    except ModuleNotFoundError as error:
        if error.name not in OF_BENCH:
            raise


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_what_a_benchmark_imports_later_is_there(path: Path) -> None:
    """Names in imports inside functions, which an import of the script does not reach."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "partwright":
            module = import_module(str(node.module))
            for alias in node.names:
                assert hasattr(module, alias.name) or import_module(f"{node.module}.{alias.name}")


def test_the_list_of_tables_names_scripts_and_options_that_are_there() -> None:
    """`make benchmarks` would tell after minutes only."""
    for table in benchmark("tables").TABLES:
        script = (FOLDER / table.script).read_text()
        for name in re.findall(r"--[a-z-]+", f"{table.quick or ''} {table.full or ''}"):
            assert f'"{name}"' in script or table.script == "partsdf.py", f"{table.script} has no {name}"


def test_a_quality_is_told_beside_the_first() -> None:
    module = benchmark("fit_page")

    def runs(quality: str, *seen: tuple[float, float, float]) -> list:
        return [
            module.Run(
                f"toys, {quality}", str(i), 0, "converged", iou, iou, parts=n, seconds=s, cpu_seconds=2 * s
            )
            for i, (iou, n, s) in enumerate(seen)
        ]

    rows = runs("normal", (0.90, 20, 10), (0.92, 30, 20)) + runs("high", (0.91, 16, 30), (0.95, 24, 80))
    *_, row = module.beside(rows, ["normal", "high"])
    assert row == "| toys, high | +0.0200 | +0.0200 | 0.80 | 3.50 | 3.50 |"
    *_, untimed = module.beside([replace(run, seconds=None) for run in rows], ["normal", "high"])
    assert untimed == "| toys, high | +0.0200 | +0.0200 | 0.80 | - | 3.50 |"


def test_how_far_seeds_are_apart_is_told() -> None:
    module = benchmark("fit_page")

    def runs(name: str, *seen: tuple[float, float]) -> list:
        return [
            module.Run("toys", name, str(i), "converged", iou, parts=n) for i, (iou, n) in enumerate(seen)
        ]

    many = runs("many", (0.9, 30.0), (0.92, 32.0), (0.91, 33.0))  # three of 33 are a tenth
    few = runs("few", (0.95, 5.0), (0.95, 8.0), (0.96, 6.0))
    *_, row = module.apart([many, few])
    assert row == "| toys | 0.0150 | 0.0200 (many) | 3.0 | 3 (many) | 1 of 2 |"


def test_a_benchmark_takes_no_name_from_the_tests(monkeypatch: pytest.MonkeyPatch) -> None:
    helper = ModuleType("solids")
    monkeypatch.setitem(sys.modules, "solids", helper)
    before = dict(sys.modules), list(sys.path)
    assert benchmark("solids").find_shapes.__module__ == "fit"
    assert sys.modules["solids"] is helper
    assert "fit" in before[0] or "fit" not in sys.modules
    assert sys.path == before[1]


def test_solids_that_are_far_off_are_named_with_their_place() -> None:
    module = benchmark("solids")
    entry = module.Entry

    def row(name: str, deviation: float, place: str = "", warnings: str = "") -> object:
        return module.Row(
            "solids", name, "converged", 0.9, 0.8, 5, 6, 0.1, deviation, None, 20.0, 1.0, place, warnings
        )

    entries = [
        entry("cad", "hinge", Path("hinge.stl"), source="a/b@0123: hinge.stl"),
        entry("cad", "x", Path("x")),
    ]
    text = module.document(
        [row("hinge", 3.1, "upper left"), row("x", 2.9, "top", "a piece floats")], "made", 2, entries
    )
    assert "| hinge | 0.900 | 0.800 | 5 (1) | 3.1 | 20.0 |" in text
    assert "- hinge (solids): 3.1 % off, upper left" in text
    assert "x (solids): 2.9" not in text
    assert "- x (solids) says: a piece floats" in text
    assert "- hinge: a/b@0123: hinge.stl" in text
    assert "Unfinished" not in text
