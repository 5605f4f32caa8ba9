"""Fillets and chamfers of extrusions in every format that has words for them."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.atomic_io import report_path
from partwright.export import export
from partwright.export.glsl import to_glsl
from partwright.fields import Extrusion, Profile
from partwright.fields.profile import circle
from partwright.meshing import mesh_assembly
from tests.export.opengl import run_sdf
from tests.export.test_openscad import rendered

ROUND = Extrusion(Profile.rectangle(20, 12, 3), 6, top_fillet=2, bottom_chamfer=1)
BALLS = Extrusion(Profile.rectangle(10, 8, 2), 5, bottom_fillet=2, top_fillet=2)
HOLED = Extrusion(Profile(Profile.rectangle(14, 10, 2).outline, [circle(2, (1, 0))]), 4, top_fillet=1)
BRACKET = Profile.polygon([(-5, -5), (5, -5), (5, 0), (0, 0), (0, 5), (-5, 5)])


def assembly() -> Assembly:
    """A block, one all of whose edges are round, and a plate with a hole whose edge is."""
    parts = (
        Part(ROUND, name="block"),
        Part(BALLS, (20, 0, 0), (1, 0, 0, 1), name="pad"),
        Part(HOLED, (0, 20, 0), (0, 1, 0, 0), name="plate"),
    )
    return Assembly(parts, unit="mm")


def volume() -> float:
    return float(mesh_assembly(assembly(), 512).volume)


def test_step_has_the_faces_of_rims(tmp_path: Path) -> None:
    bd = pytest.importorskip("build123d")
    export(assembly(), tmp_path / "a.step")
    assert not report_path(tmp_path / "a.step").exists()
    read = bd.import_step(tmp_path / "a.step")
    assert read.is_valid
    assert read.volume == pytest.approx(volume(), rel=1e-3)
    kinds = {str(face.geom_type).rpartition(".")[2] for face in read.faces()}
    # Where a fillet is wider than the corner that it runs around, its circle crosses the axis.
    assert kinds == {"PLANE", "CYLINDER", "CONE", "TORUS", "SPHERE", "REVOLUTION"}


def test_build123d_calls_them_by_their_names(tmp_path: Path) -> None:
    pytest.importorskip("build123d")
    path = tmp_path / "a.build123d.py"
    export(assembly(), path)
    assert not report_path(path).exists()
    text = path.read_text()
    assert "solid = bd.fillet(solid.edges().group_by(bd.Axis.Z)[-1], BLOCK_TOP_FILLET)" in text
    assert "solid = bd.chamfer(solid.edges().group_by(bd.Axis.Z)[0], BLOCK_BOTTOM_CHAMFER)" in text
    assert "BLOCK_TOP_FILLET = 2  # mm: radius of the fillet around the upper end" in text
    assert runpy.run_path(str(path))["assembly"].volume == pytest.approx(volume(), rel=1e-3)


def test_openscad_stacks_slices(tmp_path: Path) -> None:
    path = tmp_path / "a.scad"
    two = Assembly((assembly()["block"], assembly()["plate"]))
    export(two, path, facets=24)
    text = path.read_text()
    assert (
        "extrude_with_rims(block_height, [0, block_bottom_chamfer], [block_top_fillet, 0], convex = true)"
        in text
    )
    assert "[0, 0], [plate_top_fillet, 0], convex = false)" in text
    changes = json.loads(report_path(path).read_text())["approximated"]
    assert [change["parts"] for change in changes] == [["block"], ["plate"]]
    mesh = rendered(path)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(mesh_assembly(two, 256).volume, rel=1e-2)
    assert np.abs(two.distance(mesh.vertices)).max() < 0.25


def test_the_shader_rounds_rims() -> None:
    whole = assembly()
    lower, upper = whole.bounds()
    points = np.random.default_rng(0).uniform(lower - 3, upper + 3, (10_000, 3)).astype(np.float32)
    np.testing.assert_allclose(run_sdf(to_glsl(whole), points), whole.distance(points), atol=1e-4)


def test_mitres_about_inner_corners_are_told(tmp_path: Path) -> None:
    pytest.importorskip("build123d")
    bracket = Assembly((Part(Extrusion(BRACKET, 4, top_fillet=1), name="b"),))
    for suffix in (".step", ".build123d.py"):
        export(bracket, tmp_path / f"a{suffix}")
        (change,) = json.loads(report_path(tmp_path / f"a{suffix}").read_text())["approximated"]
        assert change["parts"] == ["b"]
        assert "corners" in change["note"]


def test_rims_that_take_all_of_a_side_are_a_little_less_deep_and_say_so(tmp_path: Path) -> None:
    """OpenCASCADE gets a dome as wide as its slot wrong, and facets stood for it."""
    bd = pytest.importorskip("build123d")
    slot = Extrusion(Profile.rectangle(20, 6, 3), 8, top_fillet=3, bottom_chamfer=1)
    whole = Assembly((Part(slot, name="slot"), Part(ROUND, (30, 0, 0), name="block")), unit="cm")
    export(whole, tmp_path / "a.step")
    (change,) = json.loads(report_path(tmp_path / "a.step").read_text())["approximated"]
    assert change["parts"] == ["slot"]
    assert change["to"] == "extrusion"
    assert change["max_deviation"] == pytest.approx(0.003)
    assert "a thousandth less deep" in change["note"]
    read = bd.import_step(tmp_path / "a.step")
    assert read.is_valid
    assert read.volume == pytest.approx(1000 * mesh_assembly(whole, 512).volume, rel=2e-3)
    assert len(read.faces()) < 50
