"""Extrusions and revolutions in every format as what they are: sketches, faces, functions, drawings."""

from __future__ import annotations

import json
import math
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.atomic_io import report_path
from partwright.errors import UnsupportedFormatError
from partwright.export import export
from partwright.export.glsl import to_glsl
from partwright.fields import Box, Extrusion, Profile, Revolution, Sphere, Tube
from partwright.fields.profile import circle
from partwright.meshing import mesh_assembly
from tests.export.opengl import run_sdf
from tests.export.test_openscad import rendered

PLATE = Profile(
    [(-10, -6), (10, -6, 0.5), (10, 4), (-10, 4)], [circle(2), Profile.rectangle(3, 2).moved((6, -3)).outline]
)
BESIDE = Similarity(translation=(0, 20, 0))
KNOB = Profile([(0, -5), (6, -5), (6, 1), (3, 5, 0.4), (0, 6)])


def assembly() -> Assembly:
    """A plate with holes, lugs with taper, a knob of which a wedge is missing, twice, and a ring."""
    return Assembly(
        (
            Part(Extrusion(PLATE, 5), name="plate"),
            Part(Extrusion(Profile.rectangle(8, 6, 2), 4, 10), (0, 0, 4), (1, 0, 0, 1), name="lug"),
            Part(
                Revolution(KNOB, 250),
                (30, 0, 0),
                name="knob",
                instances=(Similarity(translation=(0, 20, 0)),),
            ),
            Part(Revolution(Profile.circle(1, (4, 0))), (-20, 0, 0), name="ring"),
        ),
        unit="mm",
        up="z",
    )


def volume() -> float:
    """By Pappus and Cavalieri, but for the lug."""
    arc = 6.25**2 / 2 * (4 * math.atan(0.5) - math.sin(4 * math.atan(0.5)))
    plate = (20 * 10 + arc - 4 * math.pi - 6) * 5
    ring = 2 * math.pi * 4 * math.pi
    rest = mesh_assembly(Assembly((assembly()["lug"],)), 512).volume
    return plate + ring + rest + mesh_assembly(Assembly((assembly()["knob"],)), 512).volume - 0.5 * _lid()


def _lid() -> float:
    """Twice what the lug and the plate share: they overlap by half a millimetre."""
    lug, plate = assembly()["lug"], assembly()["plate"]
    return 2 * float(mesh_assembly(Assembly((lug, plate), "intersection"), 512).volume)


def test_step_has_analytic_faces_and_the_volume(tmp_path: Path) -> None:
    bd = pytest.importorskip("build123d")
    export(assembly(), tmp_path / "a.step")
    assert not report_path(tmp_path / "a.step").exists()
    read = bd.import_step(tmp_path / "a.step")
    assert read.is_valid
    assert read.volume == pytest.approx(volume(), rel=2e-3)
    kinds = {str(face.geom_type).rpartition(".")[2] for face in read.faces()}
    assert (
        {"PLANE", "CYLINDER", "CONE", "TORUS"}
        <= kinds
        <= {"PLANE", "CYLINDER", "CONE", "TORUS", "REVOLUTION"}
    )


def test_build123d_draws_and_sweeps(tmp_path: Path) -> None:
    pytest.importorskip("build123d")
    path = tmp_path / "a.build123d.py"
    export(assembly(), path)
    assert not report_path(path).exists()
    text = path.read_text()
    assert "bd.Circle(PLATE_HOLE_1_RADIUS)" in text
    assert "bd.Rectangle(*PLATE_HOLE_2_SIZE)" in text
    assert "bd.revolve(bd.Plane.XZ * (loop(*KNOB_OUTLINE)), bd.Axis.Z, KNOB_ANGLE)" in text
    assert "LUG_TAPER = 10  # degrees: by which the walls lean inwards on their way up" in text
    assert runpy.run_path(str(path))["assembly"].volume == pytest.approx(volume(), rel=2e-3)


def test_openscad_extrudes_and_turns(tmp_path: Path) -> None:
    path = tmp_path / "a.scad"
    export(assembly(), path, facets=32)
    text = path.read_text()
    assert "linear_extrude(height = plate_height, center = true)" in text
    assert "rotate_extrude(angle = knob_angle) polygon(loop(knob_outline));" in text
    changes = json.loads(report_path(path).read_text())["approximated"]
    assert [change["parts"] for change in changes] == [["lug"]]
    mesh = rendered(path)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume(), rel=2e-2)


def test_an_inner_corner_under_a_taper_is_said_to_stay_sharp(tmp_path: Path) -> None:
    bracket = Profile.polygon([(-1, -1), (1, -1), (1, 0), (0, 0), (0, 1), (-1, 1)])
    path = tmp_path / "a.build123d.py"
    export(Assembly((Part(Extrusion(bracket, 0.8, 10), name="b"),)), path)
    assert "inner corners" in json.loads(report_path(path).read_text())["approximated"][0]["note"]


def test_the_shader_finds_the_distances() -> None:
    whole = assembly()
    lower, upper = whole.bounds()
    points = np.random.default_rng(0).uniform(lower - 3, upper + 3, (10_000, 3)).astype(np.float32)
    np.testing.assert_allclose(run_sdf(to_glsl(whole), points), whole.distance(points), atol=1e-4)


@pytest.mark.parametrize("suffix", [".mjcf.xml", ".urdf"])
def test_engines_get_what_they_collide(tmp_path: Path, suffix: str) -> None:
    export(assembly(), tmp_path / f"a{suffix}")
    changes = json.loads(report_path(tmp_path / f"a{suffix}").read_text())["approximated"]
    assert {name.split("/")[0] for change in changes for name in change["parts"]} >= {"plate", "lug"}


def entities(path: Path) -> list[dict[int, Any]]:
    """Each entity of a DXF as its codes and values; written by hand, so that no package is needed."""
    lines = [line.strip() for line in path.read_text().splitlines()]
    result: list[dict[int, Any]] = []
    for code, value in zip(lines[::2], lines[1::2], strict=True):
        if code == "0":
            result.append({})
        result[-1][int(code)] = value
    return result


def test_dxf_has_a_layer_a_part_and_exact_arcs(tmp_path: Path) -> None:
    export(assembly(), tmp_path / "a.dxf")
    found = entities(tmp_path / "a.dxf")
    drawn = [one for one in found if one[0] in ("CIRCLE", "POLYLINE", "VERTEX")]
    assert {one[8] for one in drawn} == {"PLATE", "LUG", "KNOB", "RING"}
    plate = [one for one in drawn if one[8] == "PLATE"]
    assert [one[0] for one in plate].count("VERTEX") == 8
    assert [float(one[40]) for one in plate if one[0] == "CIRCLE"] == [2.0]
    assert [float(one[42]) for one in plate if 42 in one] == [0.5]
    assert "$INSUNITS\n 70\n4\n" in (tmp_path / "a.dxf").read_text()
    ezdxf = pytest.importorskip("ezdxf")
    assert not ezdxf.readfile(tmp_path / "a.dxf").audit().errors


def test_svg_is_of_true_size_and_draws_boxes_and_tubes_too(tmp_path: Path) -> None:
    from xml.etree import ElementTree

    parts = (Part(Box((4, 2, 1)), name="box"), Part(Tube(3, 1, 9), name="<tube>"), Part(Sphere(1)))
    export(Assembly(parts, unit="cm"), tmp_path / "a.svg")
    root = ElementTree.fromstring((tmp_path / "a.svg").read_text())
    paths = list(root.iter("{http://www.w3.org/2000/svg}path"))
    assert [path.get("id") for path in paths] == ["box", "<tube>"]
    assert paths[0].get("d") == "M -2 -1 L 2 -1 L 2 1 L -2 1 L -2 -1 Z"
    assert paths[1].get("d", "").count("A 3 3 0 0 1") == 2
    assert paths[1].get("d", "").count("A 2 2 0 0 0") == 2
    width, span = float(root.get("width", "")[:-2]), 4 + 0.6 + 6
    assert width == pytest.approx(10 * span * 1.04)


@pytest.mark.parametrize("suffix", [".dxf", ".svg"])
def test_drawings_need_a_profile(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(UnsupportedFormatError, match="holds profiles"):
        export(Assembly((Part(Sphere(1)),)), tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())
