"""3MF, and meshes by part: every part closed by itself, under its name, in its place and unit."""

from __future__ import annotations

import xml.etree.ElementTree as xml
import zipfile
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.assembly.palette import palette
from partwright.errors import NothingToExportError, SettingError, UnitError
from partwright.export import export
from partwright.fields import Box, Sphere, SuperFrustum
from tests.export.robotics import natives

MODEL = "3D/3dmodel.model"
CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
BALL = 4 / 3 * np.pi


def balls(**about: str) -> Assembly:
    """Two that touch, so that their blended surface is one."""
    parts = (Part(Sphere(1.0), name="left"), Part(Sphere(1.0), (1.5, 0, 0), blend=0.2, name="right & up"))
    return Assembly(parts, **about)  # type: ignore[arg-type]


def model(path: Path) -> xml.Element:
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        return xml.fromstring(archive.read(MODEL))


def test_3mf_is_one_closed_surface(tmp_path: Path) -> None:
    export(balls(unit="in"), tmp_path / "a.3mf", resolution=48)
    scene = trimesh.load_scene(tmp_path / "a.3mf")
    (mesh,) = scene.geometry.values()
    assert mesh.is_watertight
    assert np.allclose(mesh.bounds, balls().bounds(), atol=0.1)
    assert scene.units == "inch"


def test_3mf_by_part_has_a_named_coloured_closed_object_each(tmp_path: Path) -> None:
    export(balls(unit="mm"), tmp_path / "a.3mf", by_part=True)
    scene = trimesh.load_scene(tmp_path / "a.3mf")
    assert set(scene.geometry) == {"left", "right & up"}
    for mesh in scene.geometry.values():
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(BALL, rel=0.01)
    root = model(tmp_path / "a.3mf")
    colours = [base.get("displaycolor") for base in root.iter(f"{CORE}base")]
    assert colours == ["#" + bytes(row).hex().upper() for row in palette(2)]
    assert [o.get("pindex") for o in root.iter(f"{CORE}object")] == ["0", "1"]


@pytest.mark.parametrize(
    ("unit", "word"),
    [("um", "micron"), ("mm", "millimeter"), ("cm", "centimeter"), ("m", "meter"), ("ft", "foot")],
)
def test_3mf_says_the_unit(tmp_path: Path, unit: str, word: str) -> None:
    export(balls(unit=unit), tmp_path / "a.3mf", resolution=16)
    assert model(tmp_path / "a.3mf").get("unit") == word


def test_3mf_says_that_the_unit_is_unknown_and_has_z_up(tmp_path: Path) -> None:
    export(Assembly((Part(Box((1, 2, 3))),), up="y"), tmp_path / "a.3mf", resolution=16)
    root = model(tmp_path / "a.3mf")
    texts = {e.get("name"): e.text for e in root.iter(f"{CORE}metadata")}
    assert "unit is unknown" in str(texts["Description"])
    assert np.allclose(trimesh.load_scene(tmp_path / "a.3mf").extents, (1, 3, 2), atol=0.01)


def test_3mf_cannot_say_kilometres_or_furlongs(tmp_path: Path) -> None:
    with pytest.raises(UnitError, match="3MF cannot say km, only um, mm"):
        export(balls(unit="km"), tmp_path / "a.3mf")
    with pytest.raises(SettingError, match="furlong"):
        export(balls(unit="furlong"), tmp_path / "a.3mf")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl"])
def test_meshes_by_part_are_closed_shells(tmp_path: Path, suffix: str) -> None:
    export(natives(), tmp_path / f"a{suffix}", by_part=True)
    mesh = trimesh.load_mesh(tmp_path / f"a{suffix}")
    shells = mesh.split(only_watertight=True)
    assert len(shells) == 4
    expected = [6e6, np.pi * 50**2 * 200, BALL * 60**3, np.pi * 40**2 * 120 + BALL * 40**3]
    assert np.allclose(sorted(s.volume for s in shells), sorted(expected), rtol=0.01)


def test_obj_by_part_has_its_objects_named(tmp_path: Path) -> None:
    export(balls(), tmp_path / "a.obj", by_part=True)
    lines = (tmp_path / "a.obj").read_text().splitlines()
    assert [line for line in lines if line.startswith("o ")] == ["o left", "o right & up"]
    second = lines.index("o right & up")
    vertices = sum(line.startswith("v ") for line in lines[:second])
    corners = [int(n) for line in lines[second:] if line.startswith("f ") for n in line.split()[1:]]
    assert min(corners) == vertices + 1


def test_a_difference_is_one_piece_with_its_hole(tmp_path: Path) -> None:
    holed = Part(Box((2, 2, 2)), name="block") - Part(Sphere(0.8), name="hole")
    export(Assembly((holed, Part(Sphere(1.0), (5, 0, 0)))), tmp_path / "a.obj", by_part=True)
    mesh = trimesh.load_mesh(tmp_path / "a.obj")
    assert mesh.volume == pytest.approx(8 - BALL * 0.8**3 + BALL, rel=0.01)


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".stl", ".3mf"])
def test_nothing_to_export(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(NothingToExportError, match="none of the 1 parts has a volume"):
        export(Assembly((Part(SuperFrustum((1, 1, 1), onion=1.0)),)), tmp_path / f"a{suffix}", by_part=True)
    assert not list(tmp_path.iterdir())
