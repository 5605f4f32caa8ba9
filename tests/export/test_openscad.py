"""OpenSCAD renders the source to our volume; without it the text is still checked."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part
from partwright.assembly.euler_angles import fixed_axes_angles, own_axes_angles
from partwright.assembly.similarity import Similarity, rotation_matrix
from partwright.errors import NoSurfaceError, OutputError, SettingError
from partwright.export import export
from partwright.fields import Field, Sphere, SuperFrustum
from partwright.meshing import mesh_assembly, mesh_part
from tests.export.trees import SOLIDS, SUPERFRUSTA, UNDRAWN, flange, lone


def rendered(path: Path) -> trimesh.Trimesh:
    program = shutil.which("openscad")
    if program is None:
        pytest.skip("openscad is missing (Debian: openscad)")
    stl = path.with_suffix(".stl")
    done = subprocess.run([program, "-o", stl, path], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return trimesh.load_mesh(stl)


@pytest.mark.parametrize(("field", "volume"), SOLIDS.items(), ids=lambda v: getattr(v, "kind", ""))
def test_openscad_renders_the_same_solid(tmp_path: Path, field: Field, volume: float) -> None:
    assembly = lone(field)
    export(assembly, tmp_path / "a.scad")
    mesh = rendered(tmp_path / "a.scad")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume, rel=2e-3)
    assert np.abs(assembly.distance(mesh.vertices)).max() < 1e-3
    assert not (tmp_path / "a.scad.report.json").exists()


def test_openscad_renders_a_tree_with_hostile_names(tmp_path: Path) -> None:
    assembly, volume = flange()
    export(assembly, tmp_path / "flange.scad")
    mesh = rendered(tmp_path / "flange.scad")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume, rel=1e-3)


def test_the_source_reads_well(tmp_path: Path) -> None:
    export(flange()[0], tmp_path / "flange.scad", facets=64)
    text = (tmp_path / "flange.scad").read_text("ascii")
    assert "$fn = 64;" in text
    assert "boss_radius = 0.5;  // mm: radius\n" in text
    assert "module boss() {  // boss/\n" in text
    assert text.index("boss_radius =") < text.index("difference() {") < text.index("module boss()")
    assert text.count("module ") == 5


@pytest.mark.parametrize("field", SUPERFRUSTA, ids=str)
def test_superfrusta_are_exact_to_their_facets(tmp_path: Path, field: SuperFrustum) -> None:
    assembly = lone(field)
    export(assembly, tmp_path / "a.scad")
    mesh = rendered(tmp_path / "a.scad")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(mesh_part(Part(field), 128).volume, rel=3e-3)
    assert np.abs(assembly.distance(mesh.vertices)).max() < 1e-4
    assert not (tmp_path / "a.scad.report.json").exists()


def test_openscad_subtracts_superfrusta(tmp_path: Path) -> None:
    """The boolean operations of OpenSCAD take closed solids only."""
    first, second = SUPERFRUSTA[2:4]
    parts = Part(first, name="a"), Part(second, (0.3, 0, 0), name="b")
    export(parts[0] - parts[1], tmp_path / "a.scad", facets=48)
    wanted = mesh_assembly(parts[0] - parts[1], 128).volume
    assert rendered(tmp_path / "a.scad").volume == pytest.approx(wanted, rel=5e-3)


@pytest.mark.parametrize("field", UNDRAWN, ids=str)
def test_what_is_approximated_is_reported(tmp_path: Path, field: SuperFrustum) -> None:
    bent = Part(field, name="bent")
    export(Assembly((Part(Sphere(1.0), name="ball"), bent)), tmp_path / "a.scad")
    (entry,) = json.loads((tmp_path / "a.scad.report.json").read_text())["approximated"]
    assert entry["parts"] == ["bent"]
    assert entry["max_deviation"] > 0


def test_nothing_to_export_and_unknown_units_are_named(tmp_path: Path) -> None:
    with pytest.raises(NoSurfaceError, match="nothing to export"):
        export(Assembly((Part(SuperFrustum((1, 1, 0))),)), tmp_path / "a.scad")
    with pytest.raises(SettingError, match="parsec"):
        export(lone(Sphere(1.0), unit="parsec"), tmp_path / "a.scad")
    with pytest.raises(OutputError):
        export(lone(Sphere(1.0)), tmp_path / "none" / "a.scad")
    assert not list(tmp_path.iterdir())


@given(st.tuples(*[st.sampled_from([0.0, 0.5, -0.5, 1.0, 0.3, -0.7])] * 4).filter(any))
def test_angles_give_the_rotation_back(quaternion: tuple[float, float, float, float]) -> None:
    matrix = rotation_matrix(Similarity(rotation=quaternion).rotation)

    def about(axis: int, degrees: float) -> np.ndarray:
        return trimesh.transformations.rotation_matrix(np.radians(degrees), np.eye(3)[axis])[:3, :3]

    x, y, z = fixed_axes_angles(matrix)
    assert np.allclose(about(2, z) @ about(1, y) @ about(0, x), matrix, atol=1e-7)
    x, y, z = own_axes_angles(matrix)
    assert np.allclose(about(0, x) @ about(1, y) @ about(2, z), matrix, atol=1e-7)
