"""What an export cannot do is one line, exit code 2, and no file."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part, Similarity
from partwright.cli.main import main
from partwright.errors import ParameterError
from partwright.export.formats import FORMATS
from partwright.fields import Box, Quadric, Sphere, SuperFrustum
from partwright.textures import PartMap

CUBE = Assembly((Part(Box((1, 1, 1)), name="box"),), unit="mm", up="z")
SHEET = Assembly((Part(SuperFrustum((1, 1, 1), onion=1.0), name="sheet"),), unit="mm", up="z")
NEEDS = {".step": "OCP.TopoDS", ".usdc": "pxr"}  # suffix -> module without which it is not written
SOLID = (
    ".step",
    ".scad",
    ".build123d.py",
    ".mjcf.xml",
    ".urdf",
    ".ply",
    ".stl",
    ".obj",
    ".3mf",
    ".blender.py",
)


def error(capsys: Any, assembly: Assembly, folder: Path, name: str, *options: str) -> str:
    """The one line; nothing else is printed or written."""
    source = folder.parent / "source.json"
    assembly.save(source)
    before = sorted(folder.rglob("*"))
    assert main(["export", str(source), "-o", str(folder / name), *options]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    assert said[0].startswith("partwright: error: ")
    assert sorted(folder.rglob("*")) == before
    return said[0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "out").mkdir()
    return tmp_path / "out"


def skip_without(suffix: str) -> None:
    if suffix in NEEDS:
        pytest.importorskip(NEEDS[suffix].split(".")[0])


@pytest.mark.parametrize("suffix", SOLID)
def test_nothing_to_export(capsys: Any, folder: Path, suffix: str) -> None:
    skip_without(suffix)
    line = error(capsys, SHEET, folder, f"a{suffix}")
    assert "nothing to export" in line


@pytest.mark.parametrize("suffix", [s for s in FORMATS.own if s not in (".stp", ".mjcf", ".usd")])
def test_a_place_that_cannot_be_written(capsys: Any, folder: Path, suffix: str) -> None:
    skip_without(suffix)
    assert "nowhere" in error(capsys, CUBE, folder, f"nowhere/a{suffix}")


@pytest.mark.parametrize(("suffix", "module"), NEEDS.items())
def test_a_missing_dependency(
    capsys: Any, folder: Path, monkeypatch: pytest.MonkeyPatch, suffix: str, module: str
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    assert "pip install 'partwright[" in error(capsys, CUBE, folder, f"a{suffix}")


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("a.dwg", (), "names no format"),
        ("a", (), "names no format"),
        ("a.py", (), "names no format"),
        ("a.stl", ("--density", "1000"), "has no option 'density'"),
        ("a.mjcf.xml", ("--density", "-1"), "density: expected"),
        ("a.mjcf.xml", ("--tolerance", "-1"), "tolerance: expected"),
        ("a.scad", ("--facets", "2"), "facets: expected"),
        ("a.ply", ("--resolution", "0"), "resolution: expected"),
        ("a.glb", ("--resolution", "0"), "resolution: expected"),
    ],
)
def test_what_the_format_does_not_know(
    capsys: Any, folder: Path, name: str, options: tuple[str, ...], message: str
) -> None:
    assert message in error(capsys, CUBE, folder, name, *options)


def test_a_unit_that_the_format_cannot_say(capsys: Any, folder: Path) -> None:
    kilometres = Assembly(CUBE.children, unit="km", up="z")
    assert "3MF cannot say km" in error(capsys, kilometres, folder, "a.3mf")
    micrometres = Assembly(CUBE.children, unit="um", up="z")
    assert "too small for MuJoCo" in error(capsys, micrometres, folder, "a.mjcf.xml")


def test_more_parts_than_end_within_minutes(capsys: Any, folder: Path, monkeypatch: Any) -> None:
    moves = tuple(Similarity(translation=(3 * i, 0, 0)) for i in range(1, 1002))
    row = Assembly((Part(Sphere(1.0), name="ball", instances=moves),), unit="mm", up="z")
    pytest.importorskip("OCP.TopoDS")
    assert "1,002 parts, copies counted; at most 1,000 are written" in error(capsys, row, folder, "a.step")
    monkeypatch.setattr("partwright.meshing.csg.MOST_PARTS", 1000)
    assert "at most 1,000 are joined into one surface" in error(capsys, row, folder, "a.stl")
    shape = folder.parent / "ball.ply"
    trimesh.creation.icosphere(1).export(shape)
    assert main(["evaluate", str(folder.parent / "source.json"), str(shape)]) == 2
    assert "at most 1,000 are joined into one surface" in capsys.readouterr().err
    assert main(["export", str(folder.parent / "source.json"), "-o", str(folder / "a.glb")]) == 0


APART = Assembly(
    tuple(Part(Quadric.plane(normal, -1.0)) for normal in ((1, 0, 0), (-1, 0, 0))), "intersection"
)
NO_SIZE = Assembly((Part(Box((0, 0, 0))),))


@pytest.mark.parametrize("suffix", [".scad", ".glb", ".mjcf.xml"])
@pytest.mark.parametrize("assembly", [APART, NO_SIZE], ids=["half-spaces without overlap", "box of size 0"])
def test_nothing_inside(assembly: Assembly, suffix: str, tmp_path: Path, capsys: Any) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    assert "nothing is inside" in error(capsys, assembly, folder, f"empty{suffix}")


@pytest.mark.parametrize("place", [(1e200, 0, 0), (0, -1e13, 0)])
def test_a_place_beyond_all_measure(place: tuple[float, float, float]) -> None:
    with pytest.raises(ParameterError, match=r"expected a number between -1e\+12 and 1e\+12"):
        Part(Box((1, 1, 1)), place)


def test_a_value_of_a_megabyte_is_not_quoted(capsys: Any) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["export", "a.json", "-o", "a.glb", "--resolution", "x" * 1_000_000])
    assert ended.value.code == 2
    assert len(capsys.readouterr().err.splitlines()[-1]) < 1100


def test_one_line_says_what_was_written(capsys: Any, folder: Path) -> None:
    ball = Part(Sphere(0.6), (0.7, 0, 0), blend=0.1, name="ball")
    source, target = folder / "source.json", folder / "a.scad"
    Assembly((*CUBE.children, ball), unit="mm", up="z").save(source)
    assert main(["export", str(source), "-o", str(target)]) == 0
    said = capsys.readouterr().out.splitlines()
    assert len(said) == 1
    assert said[0].startswith(f"wrote {target}: OpenSCAD, ")
    assert said[0].endswith(f"1 of 2 parts is approximated, see {target}.report.json for how far off")


@pytest.mark.parametrize(
    ("textured", "suffix", "said"),
    [
        (
            2,
            ".stl",
            "; without the maps of all 2 parts, which Assembly file, GLB, HTML, Blender, USD can hold",
        ),
        (
            1,
            ".glsl",
            "; without the map of 1 of 2 parts, which Assembly file, GLB, HTML, Blender, USD can hold",
        ),
        (2, ".glb", " kB"),
        (0, ".ply", " kB"),
    ],
)
def test_maps_that_a_format_lacks_are_not_lost_in_silence(
    capsys: Any, folder: Path, textured: int, suffix: str, said: str
) -> None:
    image = {"texture": PartMap(np.full((4, 4, 3), 200, np.uint8)).text()}
    parts = [
        Part(Box((1, 1, 1)), (2 * i, 0, 0), name=f"box {i}", metadata=image if i < textured else {})
        for i in range(2)
    ]
    source, target = folder / "source.json", folder / f"a{suffix}"
    Assembly(tuple(parts)).save(source)
    assert main(["export", str(source), "-o", str(target)]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert line.endswith(said)
