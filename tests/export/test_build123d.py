"""build123d runs the source, and its exact volume is ours."""

from __future__ import annotations

import ast
import json
import math
import runpy
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.group_copies import GroupCopy
from partwright.errors import NoSurfaceError, SettingError, UnsupportedFormatError
from partwright.export import export
from partwright.fields import Field, Sphere, SuperFrustum
from partwright.meshing import mesh_part
from tests.export.trees import SOLIDS, SUPERFRUSTA, UNDRAWN, flange, lone


def run(path: Path):  # type: ignore[no-untyped-def]
    pytest.importorskip("build123d", reason="build123d is missing: pip install build123d")
    return runpy.run_path(str(path))["assembly"]


@pytest.mark.parametrize(("field", "volume"), SOLIDS.items(), ids=lambda v: getattr(v, "kind", ""))
def test_named_solids_are_exact(tmp_path: Path, field: Field, volume: float) -> None:
    assembly = lone(field)
    export(assembly, tmp_path / "a.build123d.py")
    solid = run(tmp_path / "a.build123d.py")
    assert solid.is_valid
    assert solid.volume == pytest.approx(volume, rel=1e-6)
    corners = np.array([[tuple(v)] for v in solid.vertices()], dtype=float).reshape(-1, 3)
    assert np.abs(assembly.distance(corners)).max(initial=0) < 1e-5


@pytest.mark.parametrize(
    "field",
    [
        pytest.param(field, marks=pytest.mark.heavy if field.taper == 1.4 else (), id=str(field))
        for field in SUPERFRUSTA
    ],
)
def test_superfrusta_are_lofts(tmp_path: Path, field: SuperFrustum) -> None:
    assembly = lone(field)
    export(assembly, tmp_path / "a.build123d.py")
    solid = run(tmp_path / "a.build123d.py")
    assert solid.is_valid
    assert solid.volume == pytest.approx(mesh_part(Part(field), 128).volume, rel=7e-3)
    corners = np.array([tuple(v) for v in solid.vertices()], dtype=float)
    assert np.abs(assembly.distance(corners)).max() < 1e-3
    assert not (tmp_path / "a.build123d.py.report.json").exists()


def test_nearly_round_parts_are_round_and_told(tmp_path: Path) -> None:
    nearly = SuperFrustum((1.0, 0.996, 1.0), 0.995, 0.05, 0.8)
    export(lone(nearly), tmp_path / "a.build123d.py")
    (entry,) = json.loads((tmp_path / "a.build123d.py.report.json").read_text())["approximated"]
    assert 0 < entry["max_deviation"] < 2e-3
    assert "A_PART_SIZE = (0.998, 0.998, 1)" in (tmp_path / "a.build123d.py").read_text()


@pytest.mark.parametrize("field", UNDRAWN, ids=str)
def test_what_is_approximated_is_reported(tmp_path: Path, field: SuperFrustum) -> None:
    export(lone(field), tmp_path / "a.build123d.py")
    (entry,) = json.loads((tmp_path / "a.build123d.py.report.json").read_text())["approximated"]
    assert entry["to"] != "superfrustum"
    assert entry["max_deviation"] > 0


def test_a_tree_with_hostile_names(tmp_path: Path) -> None:
    assembly, volume = flange()
    export(assembly, tmp_path / "flange.build123d.py")
    assert run(tmp_path / "flange.build123d.py").volume == pytest.approx(volume, rel=1e-6)


def test_parts_called_as_what_the_source_calls(tmp_path: Path) -> None:
    """A part called range, and one called as the variable of the loop that puts a group in its places."""
    ball, turn = Sphere(0.1), Similarity.turn((0, 0, 1), math.radians(120))
    names = "range", "zip", "enumerate", "len"
    pins = [Part(ball, (x, 0, 0), name=name, instances=(turn,)) for x, name in enumerate(names, start=1)]
    foot = Assembly((Part(ball, name="pose"), Part(ball, (0, 0, 0.5), name="flip")))
    copy = GroupCopy(Similarity(translation=(0.0, 0.0, 1.0))).of(foot, 2)
    export(Assembly((*pins, foot, copy), unit="mm"), tmp_path / "a.build123d.py")
    solid = run(tmp_path / "a.build123d.py")
    assert solid.volume == pytest.approx(12 * 4 / 3 * math.pi * 0.1**3, rel=1e-6)


def test_the_source_reads_well(tmp_path: Path) -> None:
    export(flange()[0], tmp_path / "flange.build123d.py")
    text = (tmp_path / "flange.build123d.py").read_text("ascii")
    functions = [node.name for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
    assert len(functions) == 5
    assert "BOSS_RADIUS = 0.5  # mm: radius\n" in text
    assert "unit=bd.Unit.MM" in text


def test_a_plain_python_file_is_no_format(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedFormatError, match=r"'.py' names no format"):
        export(flange()[0], tmp_path / "flange.py")


def test_nothing_to_export_and_unknown_units_are_named(tmp_path: Path) -> None:
    with pytest.raises(NoSurfaceError, match="nothing to export"):
        export(Assembly((Part(SuperFrustum((1, 1, 0))),)), tmp_path / "a.build123d.py")
    with pytest.raises(SettingError, match="parsec"):
        export(lone(Sphere(1.0), unit="parsec"), tmp_path / "a.build123d.py")
