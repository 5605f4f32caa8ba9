"""Assemblies of quadrics in other formats: read back, they have the volume of the exact mesh."""

from __future__ import annotations

import dataclasses
import json
import runpy
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.approximation.closed_quadrics import with_closed_quadrics
from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import NoSurfaceError, ParameterError
from partwright.export import brep_booleans, export
from partwright.fields import Box, Cone, Cylinder, Quadric, Sphere
from partwright.meshing import mesh_csg
from tests.export.step_faces import read_back
from tests.export.test_openscad import rendered

TURN = Similarity(1.0, (0.9, 0.1, -0.3, 0.2), (4.0, -1.0, 2.0))
SADDLE = Quadric((1, -1, 0, 0, 0, 1, 0))
# name -> the quadric and the face that STEP gives it
CURVED = {
    "sphere": (Quadric.sphere(0.6, (0.3, 0.2, 0.1)), "Sphere"),
    "cylinder": (Quadric.cylinder(0.5), "Cylinder"),
    "cone": (Quadric.cone(0.4, (0, 0, 1), (0.1, 0, 0.3)), "Cone"),
    "ellipsoid": (Quadric.ellipsoid((0.4, 0.7, 1.3)), "BSplineSurface"),
    "elliptic cylinder": (Quadric.ellipsoid((0.3, 0.6, np.inf)), "BSplineSurface"),
    "elliptic cone": (Quadric((1, 3, -0.5, 0, 0, 0, 0)), "BSplineSurface"),
    "paraboloid": (Quadric((2, 2, 0, 0, 0, -1, 0.1)), "BSplineSurface"),
    "hyperboloid of one sheet": (Quadric((1, 1, -1, 0, 0, 0, -0.1)), "SurfaceOfRevolution"),
    "hyperboloid of two sheets": (Quadric((1, 1, -1, 0, 0, 0, 0.05)), "SurfaceOfRevolution"),
    "parabolic cylinder": (Quadric((1, 0, 0, 0, 0, 1, -0.2)), "SurfaceOfExtrusion"),
}


def planes(half: float = 1.0) -> tuple[Part, ...]:
    return tuple(Part(Quadric.plane(n, half)) for n in np.vstack([np.eye(3), -np.eye(3)]))


def placed(solid: Assembly) -> Assembly:
    return dataclasses.replace(solid.transformed(TURN), unit="mm")


def test_step_has_facets_where_opencascade_goes_wrong(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")
    bore = Part(Quadric.cylinder(0.5).complement(), name="bore")
    solid = placed(Assembly((*planes(), bore), operation="intersection"))
    at_once = brep_booleans._at_once

    def curved(shape: Any) -> bool:
        from OCP.BRepAdaptor import BRepAdaptor_Surface
        from OCP.TopAbs import TopAbs_ShapeEnum
        from OCP.TopExp import TopExp_Explorer
        from OCP.TopoDS import TopoDS

        faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
        kinds = set()
        while faces.More():
            kinds.add(BRepAdaptor_Surface(TopoDS.Face(faces.Current())).GetType().name)
            faces.Next()
        return "GeomAbs_Cylinder" in kinds

    def forgetful(operation: str, solids: Any, fuzzy: float) -> Any:
        """Loses the bore, as it happens where surfaces nearly touch."""
        flat = [solid for solid in solids if not curved(solid)]
        return at_once(operation, flat, fuzzy) if len(flat) > 1 else flat[0]

    monkeypatch.setattr(brep_booleans, "_at_once", forgetful)
    export(solid, tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume == pytest.approx(mesh_csg(solid).volume, rel=1e-2)
    assert set(kinds) == {"Plane"}
    changes = json.loads((tmp_path / "a.step.report.json").read_text())["approximated"]
    assert [change["to"] for change in changes] == ["flat facets"]
    assert "bore" in changes[0]["parts"]


def test_step_leaves_out_a_quadric_that_holds_all_of_space(tmp_path: Path) -> None:
    pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")
    everywhere = Quadric((1, 1, 0, -20, 0, 0, 101)).complement()
    export(placed(Assembly((*planes(), Part(everywhere)), operation="intersection")), tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume == pytest.approx(8.0, rel=1e-6)
    assert kinds == {"Plane": 6}


@pytest.mark.parametrize("hole", [False, True])
@pytest.mark.parametrize("name", CURVED)
def test_step_has_exact_faces(tmp_path: Path, name: str, hole: bool) -> None:
    pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")
    quadric, face = CURVED[name]
    solid = placed(
        Assembly((*planes(), Part(quadric.complement() if hole else quadric)), operation="intersection")
    )
    export(solid, tmp_path / "a.step")
    volume, kinds = read_back(tmp_path / "a.step")
    assert volume == pytest.approx(mesh_csg(solid, 2e-4).volume, rel=2e-3)
    assert kinds[face] >= 1
    assert set(kinds) == {face, "Plane"} - ({"Plane"} if name == "sphere" and not hole else set())
    assert not (tmp_path / "a.step.report.json").exists()


def test_closed_quadrics_are_the_same_solid_of_named_ones() -> None:
    cone, ball = Part(Quadric.cone(0.4), (0, 0, -0.2)), Part(Quadric.sphere(0.5, (1, 0, 0)))
    drill = Part(Quadric.cylinder(0.3, (0, 1, 0)).complement())
    solid = placed(Assembly((Assembly((*planes(), drill), "intersection"), cone, ball), "difference"))
    closed = with_closed_quadrics(solid)
    assert {type(part.field) for part in closed.parts} == {Box, Cylinder, Cone, Sphere}
    points = TURN(np.random.default_rng(0).uniform(-1.2, 1.2, (20_000, 3)))
    there, here = solid.distance(points), closed.distance(points)
    clear = np.abs(there) > 1e-5
    assert (np.sign(there) == np.sign(here))[clear].all()


def test_what_step_cannot_hold_and_what_does_not_end_is_said(tmp_path: Path) -> None:
    pytest.importorskip("OCP.STEPCAFControl", reason="OpenCASCADE is missing: pip install 'partwright[cad]'")
    saddle = Assembly((*planes(), Part(Quadric((1, -1, 0, 0, 0, 1, 0)))), "intersection")
    with pytest.raises(ParameterError, match="hyperbolic paraboloid"):
        export(saddle, tmp_path / "a.step")
    with pytest.raises(NoSurfaceError, match="does not end"):
        export(Assembly((Part(Quadric.cylinder(1.0)),)), tmp_path / "a.step")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("quadric", "hole"),
    [
        pytest.param(CURVED["paraboloid"][0], False, id="paraboloid"),
        pytest.param(CURVED["paraboloid"][0], True, marks=pytest.mark.heavy, id="hole of a paraboloid"),
        pytest.param(SADDLE, False, marks=pytest.mark.heavy, id="saddle"),
        pytest.param(SADDLE, True, id="hole of a saddle"),
    ],
)
def test_build123d_has_flat_facets_of_quadrics_that_no_solid_is_like(
    tmp_path: Path, quadric: Quadric, hole: bool
) -> None:
    own = Part(quadric.complement() if hole else quadric, name="dish")
    solid = placed(Assembly((*planes(), own), "intersection"))
    export(solid, tmp_path / "a.build123d.py")
    (entry,) = json.loads((tmp_path / "a.build123d.py.report.json").read_text())["approximated"]
    assert (entry["parts"], entry["to"]) == (["dish"], "flat facets")
    pytest.importorskip("build123d", reason="build123d is missing: pip install build123d")
    made = runpy.run_path(str(tmp_path / "a.build123d.py"))["assembly"]
    assert made.is_valid
    exact = mesh_csg(solid, 2e-4)
    assert abs(made.volume - exact.volume) <= min(entry["max_deviation"] * exact.area, 0.02 * exact.volume)


def test_openscad_has_named_solids_and_polyhedra(tmp_path: Path) -> None:
    body = Assembly((*planes(), Part(Quadric.cylinder(0.9), name="round")), "intersection")
    solid = body - Part(Quadric.ellipsoid((0.3, 0.5, np.inf)), name="slot")
    export(solid, tmp_path / "a.scad", facets=24)
    text = (tmp_path / "a.scad").read_text()
    assert "cylinder(r = round_radius" in text
    (entry,) = json.loads((tmp_path / "a.scad.report.json").read_text())["approximated"]
    assert (entry["parts"], entry["to"]) == (["slot"], "mesh")
    program = shutil.which("openscad")
    if program is None:
        pytest.skip("openscad is missing (Debian: openscad)")
    subprocess.run([program, "-o", tmp_path / "a.stl", tmp_path / "a.scad"], check=True, capture_output=True)
    mesh = trimesh.load_mesh(tmp_path / "a.stl")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(mesh_csg(solid).volume, rel=0.02)


def test_glb_has_a_node_a_convex(tmp_path: Path) -> None:
    convexes = [
        Assembly((*planes(), Part(CURVED["cylinder"][0])), "intersection", name=f"convex_{i}").translated(
            (3.0 * i, 0, 0)
        )
        for i in range(2)
    ]
    solid = Assembly(tuple(convexes)) - Part(Quadric.cylinder(0.1), name="bore")
    export(solid, tmp_path / "a.glb")
    scene = trimesh.load_scene(tmp_path / "a.glb")
    assert set(scene.geometry) == {"convex_0", "convex_1"}  # the bore is shown as what it takes away
    for name, bored in (("convex_0", 0.01), ("convex_1", 0.0)):
        mesh = scene.geometry[name]
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(2 * np.pi * (0.25 - bored), rel=2e-3)
    data = (tmp_path / "a.glb").read_bytes()
    length = int.from_bytes(data[12:16], "little")
    extras = {node["name"]: node.get("extras", {}) for node in json.loads(data[20 : 20 + length])["nodes"]}
    assert [len(extras[name]["parts"]) for name in ("convex_0", "convex_1")] == [8, 7]
    assert extras["bore"]["role"] == "subtracted"


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "3mf"])
def test_mesh_formats_write_the_exact_mesh(tmp_path: Path, suffix: str) -> None:
    solid = Assembly(planes(), "intersection")
    path = tmp_path / f"a.{suffix}"
    export(solid, path)
    mesh = trimesh.load(path, force="mesh")
    assert len(mesh.faces) == 12
    assert mesh.volume == pytest.approx(8)


def drilled(*holes: Part) -> Assembly:
    body = Assembly(planes(), "intersection", "body")
    return placed(Assembly((body, *holes), "difference"))


ALIKE = {
    "across the axis": (Quadric.cylinder(0.1), ((0.5, 0, 0), (0.2, 0.6, 0), (-0.6, -0.3, 0)), True),
    "along the axis, too": (Quadric.cylinder(0.1), ((0.5, 0, 0.5), (-0.6, -0.3, -0.8)), False),
    "spheres": (Quadric.sphere(0.2, (0, 0, 1)), ((0.5, 0, 0), (-0.5, 0.5, -0.5)), True),
    "cones": (Quadric.cone(0.1, (0, 0, 1), (0, 0, 1.3)), ((0.5, 0, 0), (-0.5, 0.5, 0)), False),
}


@pytest.mark.parametrize("name", ALIKE)
def test_repeated_holes_stay_repeated_in_a_source_where_that_is_the_same(name: str, tmp_path: Path) -> None:
    field, places, looped = ALIKE[name]
    copies = tuple(Similarity(translation=place) for place in places)
    solid = drilled(Part(field, name="drill", instances=copies))
    export(solid, tmp_path / "a.scad", facets=32)
    source = (tmp_path / "a.scad").read_text()
    assert (f"{len(places) + 1} times" in source) is looped
    assert rendered(tmp_path / "a.scad").volume == pytest.approx(mesh_csg(solid).volume, rel=2e-3)


def test_copies_that_are_turned_are_parts_of_their_own(tmp_path: Path) -> None:
    quarter = Similarity(rotation=(np.sqrt(0.5), np.sqrt(0.5), 0, 0))
    solid = drilled(Part(Quadric.cylinder(0.2), name="drill", instances=(quarter,)))
    export(solid, tmp_path / "a.scad", facets=32)
    assert "times" not in (tmp_path / "a.scad").read_text()
    assert rendered(tmp_path / "a.scad").volume == pytest.approx(mesh_csg(solid).volume, rel=2e-3)


@pytest.mark.parametrize("suffix", [".glb", ".usda"])
def test_a_scene_of_what_does_not_end_is_refused_not_left_empty(tmp_path: Path, suffix: str) -> None:
    if suffix == ".usda":
        pytest.importorskip("pxr")
    rod = Assembly((Part(Box((1, 1, 1))), Part(Quadric.cylinder(0.2))), unit="mm", up="z")
    with pytest.raises(NoSurfaceError, match="does not end along z"):
        export(rod, tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())
