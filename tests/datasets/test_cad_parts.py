"""CAD parts: closed, in one piece, stout, what their tree says, the same every time, and varied."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.datasets.cad_parts import KINDS, CadPart, cad_part, cad_parts, pieces, write_cad_parts
from partwright.datasets.cad_parts.__main__ import main
from partwright.errors import SettingError
from partwright.fields import Quadric, Solid
from partwright.meshing.csg import solid_of


@pytest.fixture(scope="module")
def parts() -> list[CadPart]:
    return list(cad_parts(2 * len(KINDS), seed=3))


def test_every_part_is_closed_in_one_piece_and_neither_flat_nor_empty(parts: list[CadPart]) -> None:
    for part in parts:
        assert part.mesh.is_watertight
        assert part.mesh.body_count == 1, part.name
        sides = np.ptp(part.mesh.vertices, axis=0)
        assert sides.min() >= 0.1 * sides.max()
        assert part.mesh.volume > 0.03 * sides.prod()
        assert part.mesh.euler_number == 2 - 2 * part.genus


def test_the_mesh_is_the_surface_of_the_tree(parts: list[CadPart]) -> None:
    for part in parts:
        longest = np.ptp(part.mesh.vertices, axis=0).max()
        off = np.abs(part.assembly.distance(part.mesh.vertices.astype(np.float32)))
        assert off.max() < 1e-3 * longest  # two chords of 5e-4 that meet
        inward = part.mesh.triangles_center - 1e-3 * longest * part.mesh.face_normals
        outward = part.mesh.triangles_center + 1e-3 * longest * part.mesh.face_normals
        large = part.mesh.area_faces > 1e-4 * part.mesh.area
        assert (part.assembly.distance(inward[large].astype(np.float32)) < 0).mean() > 0.99
        assert (part.assembly.distance(outward[large].astype(np.float32)) > 0).mean() > 0.99


def test_leaves_are_quadrics_and_named_solids_with_names(parts: list[CadPart]) -> None:
    for part in parts:
        assert all(isinstance(leaf.field, Quadric | Solid) for leaf in part.assembly.parts)
        assert all(leaf.name for leaf in part.assembly.parts)
        assert (part.assembly.unit, part.assembly.up) == ("mm", "z")


def test_a_part_is_the_same_every_time_and_by_itself(parts: list[CadPart]) -> None:
    for number in (0, 7, 11):
        again = cad_part(number, seed=3)
        assert again.name == parts[number].name
        assert np.array_equal(again.mesh.vertices, parts[number].mesh.vertices)
        assert np.array_equal(again.mesh.faces, parts[number].mesh.faces)
    assert not np.array_equal(cad_part(7, seed=4).mesh.vertices, parts[7].mesh.vertices)


def test_parts_of_one_kind_vary_in_size_and_in_topology() -> None:
    made = list(cad_parts(12, seed=1, kind="flange"))
    assert {part.kind for part in made} == {"flange"}
    assert len({round(part.mesh.volume, 3) for part in made}) == 12
    assert len({part.genus for part in made}) >= 3


def test_volumes_are_those_of_the_formulas() -> None:
    drilled = pieces.without(
        pieces.rounded_plate(60.0, 40.0, 10.0, 5.0),
        [pieces.hole(4.0, 11.0, (0.0, 0.0, 10.0)), pieces.slot(20.0, 3.0, 11.0, (0.0, 12.0, 10.0))],
    )
    expected = 10 * (60 * 40 - (4 - np.pi) * 25 - np.pi * 16 - 20 * 6 - np.pi * 9)
    assert solid_of(drilled, 1e-3).volume() == pytest.approx(expected, rel=2e-4)
    corner = pieces.fillet(3.0, 7.0, (1.0, 2.0, 3.0), (-1, 1))
    assert solid_of(corner, 1e-4).volume() == pytest.approx(7 * (16 - 9 * np.pi / 4), rel=1e-3)
    rib = solid_of(pieces.gusset(6.0, 8.0, 2.0, (1.0, 0.0, 1.0)), 1e-3)
    assert rib.volume() == pytest.approx(2 * (24 + 6 + 8 + 1), rel=1e-6)  # and what it stands in
    for along in ("x", "y", "z"):
        upward = solid_of(pieces.cone(2.0, 5.0, 6.0, (0.0, 0.0, 0.0), along), 1e-4)
        lower, upper = np.reshape(upward.bounding_box(), (2, 3))
        axis = "xyz".index(along)
        assert (lower[axis], upper[axis]) == pytest.approx((0.0, 6.0))
        assert upward.volume() == pytest.approx(np.pi * 2 * (4 + 10 + 25), rel=1e-3)
        wide = upward.trim_by_plane(tuple(np.eye(3)[axis].tolist()), 5.9)
        assert wide.volume() == pytest.approx(0.1 * np.pi * 24.6, rel=0.02)  # it widens upwards


def test_written_parts_are_read_again(tmp_path: Path) -> None:
    write_cad_parts(tmp_path / "a", 3, seed=2)
    index = json.loads((tmp_path / "a" / "index.json").read_text())
    for number, entry in enumerate(index["parts"]):
        part = cad_part(number, seed=2)
        mesh = trimesh.load(tmp_path / "a" / f"{entry['name']}.ply")
        assert mesh.volume == pytest.approx(entry["volume"], rel=1e-5)
        assert (entry["kind"], entry["genus"]) == (part.kind, part.genus)
        assert len(pw.load_assembly(tmp_path / "a" / f"{entry['name']}.json")) == entry["leaves"]


def test_the_command_writes_parts_and_a_sheet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = tmp_path / "sheet.png"
    assert main([str(tmp_path / "a"), "--count", "1", "--kind", "plate", "--sheet", str(sheet)]) == 0
    assert sheet.stat().st_size > 1000
    assert main([str(tmp_path / "a"), "--seed", "-1"]) == 2
    assert "start at 0" in capsys.readouterr().err


def test_what_cannot_be_drawn_is_said() -> None:
    with pytest.raises(SettingError, match="kind 'sphere' is unknown"):
        cad_part(0, kind="sphere")
    with pytest.raises(SettingError, match="start at 0"):
        cad_part(-1)
