"""Fillets and chamfers of extrusions in every format that has words for them."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.atomic_io import report_path
from partwright.errors import NoSurfaceError
from partwright.export import brep_rims, brep_swept_profile, export
from partwright.export.brep import solid_of
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


def test_openscads_slices_are_one_body(tmp_path: Path) -> None:
    """Heights whose sums round, so that slices which only touch came apart in it."""
    ring = Profile(circle(12.3), (circle(7.5),))
    whole = Assembly((Part(Extrusion(ring, 5.75, top_chamfer=0.5), name="ring").translated((0, 0, -0.125)),))
    export(whole, tmp_path / "a.scad", facets=96)
    assert rendered(tmp_path / "a.scad").body_count == 1


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


SLOT = Extrusion(Profile.rectangle(20, 6, 3), 8, top_fillet=3, bottom_chamfer=1)
BUMP = Profile([(0, 0), (20, 0), (20, 12), (11, 12, 1.0), (9, 12), (0, 12)])


@pytest.mark.parametrize(
    "field",
    [
        SLOT,
        Extrusion(Profile.rectangle(20, 12, 1), 8, top_chamfer=2),
        Extrusion(Profile([(0, 0), (20, 0), (20, 11.5), (19.5, 12), (0, 12)]), 8, top_fillet=2),
        Extrusion(BUMP, 8, top_chamfer=2, bottom_chamfer=0.5),
    ],
    ids=["a dome as wide as its slot", "corners less round", "a corner cut off", "half a circle"],
)
def test_rims_along_which_sides_vanish_are_exact_in_step(field: Extrusion, tmp_path: Path) -> None:
    """OpenCASCADE gets them wrong by itself: facets stood for them, or rims that were less deep."""
    bd = pytest.importorskip("build123d")
    whole = Assembly((Part(field, name="body"),), unit="mm")
    export(whole, tmp_path / "a.step")
    assert not report_path(tmp_path / "a.step").exists()
    read = bd.import_step(tmp_path / "a.step")
    assert read.is_valid
    assert read.volume == pytest.approx(mesh_assembly(whole, 512).volume, rel=2e-3)
    assert len(read.faces()) < 30


def test_build123d_has_them_as_deep_as_all_sides_reach_and_says_so(tmp_path: Path) -> None:
    pytest.importorskip("build123d")
    field = Extrusion(Profile.rectangle(20, 12, 1), 8, top_chamfer=2)
    path = tmp_path / "a.build123d.py"
    export(Assembly((Part(field, name="body"),), unit="mm"), path)
    (change,) = json.loads(report_path(path).read_text())["approximated"]
    assert change["parts"] == ["body"]
    assert change["max_deviation"] == pytest.approx(0.5**0.5, rel=0.1)
    made = runpy.run_path(str(path))["assembly"]
    less = Extrusion(field.profile, 8, top_chamfer=1)
    assert made.volume == pytest.approx(mesh_assembly(Assembly((Part(less),)), 256).volume, rel=5e-3)


def test_rims_that_cannot_be_built_are_a_little_less_deep_and_say_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = brep_rims.with_rims

    def failing(field: Extrusion, *faces: Any) -> Any:
        if field.top_fillet == pytest.approx(30, rel=1e-6):  # mm
            raise NoSurfaceError("OpenCASCADE cannot")
        return real(field, *faces)

    monkeypatch.setattr(brep_swept_profile, "with_rims", failing)
    bd = pytest.importorskip("build123d")
    solid_of.cache_clear()
    whole = Assembly((Part(SLOT, name="slot"), Part(ROUND, (30, 0, 0), name="block")), unit="cm")
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
