"""STEP read back by OpenCASCADE itself: exact volumes, analytic faces, names, units; and by `load_shape`."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.errors import (
    EmptyShapeError,
    MissingDependencyError,
    NoSurfaceError,
    OutputError,
    SettingError,
    UnreadableFileError,
)
from partwright.export import export
from partwright.fields import Box, Cylinder, Field, Sphere, SuperFrustum, Tube
from partwright.shapes import load_shape, reading
from partwright.shapes.step_process import STEP_SUFFIXES
from tests.export.step_faces import ANALYTIC, read_back
from tests.export.trees import SOLIDS, TURNED, flange, lone

pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")


def counted_volume(field: Field) -> float:
    """Of the field itself, on cells of equal sides."""
    lower, upper = field.bounds()
    cell = float((upper - lower).max()) / 120
    axes = [np.arange(a + cell / 2, b + cell, cell) for a, b in zip(lower, upper, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float32)
    return float(np.clip(0.5 - field(points) / cell, 0, 1).sum()) * cell**3


@pytest.mark.parametrize(("field", "volume"), SOLIDS.items(), ids=lambda v: getattr(v, "kind", ""))
def test_named_solids_are_exact(tmp_path: Path, field: Field, volume: float) -> None:
    path = tmp_path / "solid.step"
    export(lone(field, unit="mm"), path)
    measured, kinds = read_back(path)
    assert measured == pytest.approx(volume, rel=1e-6)
    assert set(kinds) <= ANALYTIC
    assert not (tmp_path / "solid.step.report.json").exists()


@pytest.mark.parametrize(
    ("field", "kinds"),
    [
        (SuperFrustum((1, 1, 1), 1, 0.1), {"Plane": 2, "Torus": 2, "Cylinder": 1}),
        (SuperFrustum((1, 1, 1), 1, 0.1, 0.4), {"Plane": 2, "Torus": 2, "Cone": 1}),
        (SuperFrustum((1, 1, 1), 1, 0.1, 0.0), {"Plane": 1, "Torus": 1, "Cone": 1, "Sphere": 1}),
        (SuperFrustum((1, 1, 1), 1, 0.05, 1.7, 0, 0.5), {"Plane": 2, "Torus": 4, "Cone": 2}),
        (SuperFrustum((1, 1, 0), 1, 0.1, 1, 0, 0.8), {"Plane": 2, "Torus": 4}),
        (SuperFrustum((1, 2, 1), 0, 0.1), {"Plane": 6, "Cylinder": 12, "Sphere": 8}),
        (SuperFrustum((1, 2, 1), 0.5), {"Plane": 6, "Cylinder": 4}),
        (SuperFrustum((1, 2, 1), 0.5, 0.1), {"Plane": 6, "Cylinder": 12, "Torus": 8}),
        (SuperFrustum((1, 2, 1), 1, 0.1), {"Plane": 4, "Cylinder": 6, "Torus": 4}),
    ],
)
def test_rounded_solids_are_exact(tmp_path: Path, field: SuperFrustum, kinds: dict[str, int]) -> None:
    path = tmp_path / "solid.step"
    export(lone(field), path)
    volume, faces = read_back(path)
    assert volume == pytest.approx(counted_volume(field), rel=1e-3)
    assert faces == kinds


@pytest.mark.parametrize(
    "field",
    [
        SuperFrustum((1, 2, 1), taper=0.7),  # a pyramid cut off: its sides meet in mitres
        SuperFrustum((1, 2, 1), taper=0.0),  # to an edge
        SuperFrustum((1, 2, 1), 0.2, 0.05, 0.6),  # corners round below, sharp above
        SuperFrustum((1, 2, 1), 0.3, 0.05, 1.8),
        SuperFrustum((1, 2, 1), 0.3, 0.05, 0.7, 0.0, 0.6),  # hollow
        SuperFrustum((1, 2, 1), 0.3, 0.2, 0.4, 0.0, 0.6),  # whose hole the dilation closes above
        SuperFrustum((0.24, 0.25, 0.7), 0.96, 0.03, 1.002),  # as fits have them: nearly a cylinder
        SuperFrustum((1, 2, 3), bulge=0.3),  # bent
        SuperFrustum((1, 2, 4), 0.5, 0.1, 1.0, 0.5),
        SuperFrustum((0.6, 0.6, 4), 1.0, 0.1, 1.0, 0.5, 0.7),  # a bent tube
    ],
)
def test_what_no_cad_program_has_a_name_for_is_exact(tmp_path: Path, field: SuperFrustum) -> None:
    path = tmp_path / "solid.step"
    export(lone(field, unit="mm"), path)
    volume, kinds = read_back(path)
    assert volume == pytest.approx(counted_volume(field), rel=2e-3)
    assert set(kinds) <= ANALYTIC | {"SurfaceOfRevolution"}  # of an arc that would cross its axis
    assert not (tmp_path / "solid.step.report.json").exists()


def test_a_bend_with_taper_is_a_surface_through_sections(tmp_path: Path) -> None:
    field = SuperFrustum((1, 2, 5), 0.5, 0.1, 0.6, 0.3)
    export(lone(field, unit="m"), tmp_path / "horn.step")
    assert read_back(tmp_path / "horn.step")[0] / 1e9 == pytest.approx(counted_volume(field), rel=1e-3)
    (change,) = json.loads((tmp_path / "horn.step.report.json").read_text())["approximated"]
    assert change["to"] == "superfrustum"
    assert 0 < change["max_deviation"] < 1e-3
    assert 0 < change["volume_error_ratio"] < 1e-3


def test_a_tree_of_operations_with_hostile_names(tmp_path: Path) -> None:
    assembly, volume = flange()
    export(assembly, tmp_path / "flange.stp")
    measured, kinds = read_back(tmp_path / "flange.stp")
    assert measured == pytest.approx(volume, rel=1e-6)
    assert set(kinds) == {"Plane", "Cylinder"}
    assert [node.name for node in load_shape(tmp_path / "flange.stp").nodes] == ["Flansch ä"]


@pytest.fixture
def read_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """By this process: one of its own takes two seconds to begin. Other tests read by it, and the same."""
    from partwright.shapes.step import source_of_step

    for suffix in STEP_SUFFIXES:
        monkeypatch.setitem(reading._READERS, suffix, source_of_step)


@pytest.mark.usefixtures("read_here")
@pytest.mark.parametrize(("unit", "millimetres"), [("m", 1000.0), ("in", 25.4), ("um", 1e-3), ("mm", 1.0)])
def test_the_unit_is_written_and_read(tmp_path: Path, unit: str, millimetres: float) -> None:
    size = 0.05 if unit == "m" else 5000.0 if unit == "um" else 2.0
    path = tmp_path / "box.step"
    export(Assembly((Part(Box((size, size, size)), (size, 0, 0)),), unit=unit), path)
    assert read_back(path)[0] == pytest.approx((size * millimetres) ** 3)
    shape = load_shape(path)
    assert shape.unit == unit
    assert np.allclose(shape.vertices.min(axis=0) / size, [0.5, -0.5, -0.5])
    assert np.allclose(shape.vertices.max(axis=0) / size, [1.5, 0.5, 0.5])


def test_what_is_approximated_is_reported(tmp_path: Path) -> None:
    bent = Part(SuperFrustum((4, 1, 1), 0.5, 0.05, 0.8, bulge=0.5), name="bent")  # about a place inside it
    assembly = Assembly((bent, Part(Sphere(1.0), (0, 0, 2), name="ball", blend=0.2)))
    export(assembly, tmp_path / "a.step")
    report = json.loads((tmp_path / "a.step.report.json").read_text())
    bent_entry, ball = report["approximated"]
    assert bent_entry["parts"] == ["bent"]
    assert bent_entry["volume_error_ratio"] > 0
    assert (ball["parts"], ball["to"], ball["blend_dropped"]) == (["ball"], "sphere", 0.2)
    assert "millimetres" in report["notes"][0]


def test_separate_parts_come_back_as_named_nodes(tmp_path: Path) -> None:
    parts = (Part(Box((1, 1, 1)), name="left"), Part(Tube(1, 0.3, 2), (3, 0, 0), TURNED, name="right"))
    export(Assembly(parts, unit="cm"), tmp_path / "two.step", separate=True)
    shape = load_shape(tmp_path / "two.step")
    assert [node.name for node in shape.nodes] == ["left", "right"]
    assert shape.unit == "cm"
    box, tube = shape.split_nodes()
    assert box.volume == pytest.approx(1.0)
    assert tube.volume == pytest.approx(np.pi * (1 - 0.49) * 2, rel=5e-3)


@pytest.mark.usefixtures("read_here")
def test_reading_is_watertight_and_within_the_tolerance(tmp_path: Path) -> None:
    export(Assembly((Part(Sphere(1.0)), Part(Cylinder(0.5, 4)))), tmp_path / "a.step")
    shape = load_shape(tmp_path / "a.step")
    assert shape.confidence == 1.0
    assembly = Assembly((Part(Sphere(1.0)), Part(Cylinder(0.5, 4))))
    assert np.abs(assembly.distance(shape.vertices)).max() < 1e-5
    middle = shape.vertices[shape.faces].mean(axis=1)
    assert np.abs(assembly.distance(middle)).max() < 0.01


def test_the_same_assembly_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        export(flange()[0], tmp_path / name / "x.step")
    assert (tmp_path / "a" / "x.step").read_bytes() == (tmp_path / "b" / "x.step").read_bytes()


def test_nothing_to_export_and_bad_places_are_named(tmp_path: Path) -> None:
    with pytest.raises(NoSurfaceError, match="no part of the assembly has a volume"):
        export(Assembly((Part(SuperFrustum((1, 1, 0))),)), tmp_path / "a.step")
    apart = Assembly((Part(Sphere(1.0)), Part(Sphere(1.0), (5, 0, 0))), "intersection")
    with pytest.raises(NoSurfaceError, match="empty"):
        export(apart, tmp_path / "a.step")
    with pytest.raises(SettingError, match="parsec"):
        export(lone(Sphere(1.0), unit="parsec"), tmp_path / "a.step")
    with pytest.raises(OutputError):
        export(lone(Sphere(1.0)), tmp_path / "no folder" / "a.step")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"ISO-10303-21;\nHEADER;", b"\x00\x01garbage", b"solid x\nendsolid x\n"])
def test_damaged_files_are_named(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "x.step").write_bytes(content)
    with pytest.raises((UnreadableFileError, EmptyShapeError), match=r"x\.step"):
        load_shape(tmp_path / "x.step")


def test_without_opencascade_the_install_line_is_given(tmp_path: Path, monkeypatch: Any) -> None:
    export(lone(Sphere(1.0)), tmp_path / "a.step")
    for name in ["OCP", *(name for name in sys.modules if name.startswith("OCP."))]:
        monkeypatch.setitem(sys.modules, name, None)
    for work in (
        lambda: export(lone(Sphere(1.0)), tmp_path / "b.step"),
        lambda: load_shape(tmp_path / "a.step"),
    ):
        with pytest.raises(MissingDependencyError, match=r"pip install 'partwright\[cad\]'"):
            work()
