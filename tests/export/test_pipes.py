"""Pipes in every format as what they are: faces, sweeps, functions, or what became of them in the report."""

from __future__ import annotations

import dataclasses
import json
import math
import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.approximation.pipe_chain import has_narrow_bore, pipe_chain, straight_rod
from partwright.assembly import Assembly, Part, Similarity
from partwright.atomic_io import report_path
from partwright.errors import UnsupportedFormatError
from partwright.export import export
from partwright.export.glsl import to_glsl
from partwright.fields import Box, Capsule, Cylinder, Field, Pipe
from partwright.meshing import mesh_assembly
from partwright.meshing.pipes import rings
from tests.export.opengl import run_sdf
from tests.export.step_faces import read_back
from tests.export.test_openscad import rendered

PATH = ((0, 0, 0), (20, 0, 0, 5), (20, 15, 0, 4), (20, 15, 20))
HALF_TURN = ((0, 0, 0), (0, 0, 20, 5), (10, 0, 20, 5), (10, 0, 0))
ELBOW = ((0, 0, 0), (10, 0, 0, 10), (10, 10, 0))  # a bend and nothing else
STRAIGHT = ((0, 0, 0), (4, 0, 0, 9), (10, 0, 0))
# pipe -> planes, cylinders, tori
PIPES = {
    "a rod": (Pipe(PATH, 1.5), (2, 3, 2)),
    "a tube": (Pipe(PATH, 1.5, 0.5), (2, 6, 4)),
    "half a turn": (Pipe(HALF_TURN, 2, 0.3), (2, 4, 2)),
    "an elbow": (Pipe(ELBOW, 2), (2, 0, 1)),
    "straight on": (Pipe(STRAIGHT, 1, 0.2), (2, 2, 0)),
}


def lone(pipe: Pipe) -> Assembly:
    return Assembly((Part(pipe, (1, 2, 3), (1, 0.2, 0.3, 0), name="pipe"),), unit="mm", up="z")


def volume(pipe: Pipe) -> float:
    """By Pappus."""
    return math.pi * (pipe.radius**2 - pipe.bore**2) * pipe.length


def changes(path: Path) -> list[Any]:
    report = report_path(path)
    return json.loads(report.read_text())["approximated"] if report.exists() else []


@pytest.mark.parametrize(("pipe", "faces"), PIPES.values(), ids=PIPES)
def test_step_has_a_face_for_each_piece(tmp_path: Path, pipe: Pipe, faces: tuple[int, int, int]) -> None:
    pytest.importorskip("OCP")
    path = tmp_path / "a.step"
    export(lone(pipe), path)
    assert not changes(path)
    found, kinds = read_back(path)
    assert found == pytest.approx(volume(pipe), rel=1e-6)
    assert {kind: n for kind, n in zip(("Plane", "Cylinder", "Torus"), faces, strict=True) if n} == kinds


def joined() -> Assembly:
    """A tube on a plate, its end within the plate's top."""
    pipe = Pipe(((0, 0, 0), (0, 0, 20, 6), (20, 0, 20, 6), (20, 10, 20)), 2, 0.5)
    return Assembly((Part(Box((20, 20, 2)), (0, 0, -1), name="plate"), Part(pipe, name="pipe")), unit="mm")


def drilled(place: tuple[float, float, float], turn: tuple[float, float, float, float]) -> Assembly:
    hole = Part(Cylinder(0.8, 10), place, turn, name="hole")
    return Assembly((joined()["pipe"], hole), "difference", unit="mm")


def saddle() -> Assembly:
    branch = Pipe(((0, 0, 0), (0, 0, 10, 4), (0, 9, 10)), 1.5)
    return Assembly((Part(Pipe(((-10, 0, 0), (10, 0, 0)), 2), name="main"), Part(branch, name="branch")))


def channel() -> Assembly:
    bore = Pipe(((-12, 0, 0), (0, 0, 0, 2), (0, 6, 0, 2), (12, 6, 3)), 1)
    return Assembly((Part(Box((20, 20, 10)), name="block"), Part(bore, name="bore")), "difference", unit="mm")


BOOLEANS = {
    "a bent channel": (channel(), {"Plane": 6, "Cylinder": 3, "Torus": 2}),
    "a plate": (joined(), {"Plane": 8, "Cylinder": 6, "Torus": 4}),
    "a hole in a run": (drilled((0, 0, 8), (1, 1, 0, 0)), {"Plane": 2, "Cylinder": 8, "Torus": 4}),
    "a hole in a bend": (drilled((2, 0, 18), (1, 0, 0, 0)), None),
    "a branch": (saddle(), {"Plane": 3, "Cylinder": 3, "Torus": 1}),
}


@pytest.mark.parametrize(("assembly", "faces"), BOOLEANS.values(), ids=BOOLEANS)
def test_step_stays_exact_in_booleans(
    tmp_path: Path, assembly: Assembly, faces: dict[str, int] | None
) -> None:
    pytest.importorskip("OCP")
    path = tmp_path / "a.step"
    export(assembly, path)
    assert not changes(path)
    found, kinds = read_back(path)
    assert found == pytest.approx(mesh_assembly(assembly, 256).volume, rel=2e-3)
    assert kinds == faces if faces else set(kinds) == {"Plane", "Cylinder", "Torus"}


def test_a_tube_on_a_plate_has_exactly_their_volumes(tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    export(joined(), tmp_path / "a.step")
    expected = 20 * 20 * 2 + volume(joined()["pipe"].field)
    assert read_back(tmp_path / "a.step")[0] == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("pipe", "faces"), PIPES.values(), ids=PIPES)
def test_build123d_sweeps(tmp_path: Path, pipe: Pipe, faces: tuple[int, int, int]) -> None:
    pytest.importorskip("build123d")
    path = tmp_path / "a.build123d.py"
    export(lone(pipe), path)
    assert not changes(path)
    solid = runpy.run_path(str(path))["assembly"]
    assert solid.is_valid
    assert solid.volume == pytest.approx(volume(pipe), rel=1e-6)
    kinds = [str(face.geom_type).rpartition(".")[2] for face in solid.faces()]
    assert tuple(map(kinds.count, ("PLANE", "CYLINDER", "TORUS"))) == faces
    corners = np.array([tuple(vertex) for vertex in solid.vertices()], dtype=np.float32)
    assert np.abs(lone(pipe).distance(corners)).max() < 1e-4


def test_sources_have_the_numbers_at_their_head(tmp_path: Path) -> None:
    """One number for bends of one radius, a list for others, none where the path is straight."""
    copies = (Similarity(translation=(0, 40, 0)),)
    parts = [
        Part(pipe, (0, 0, 50 * i), name=name.split()[-1], instances=copies * (i == 0))
        for i, (name, (pipe, _)) in enumerate(PIPES.items())
    ]
    export(Assembly(tuple(parts), unit="mm"), tmp_path / "a.build123d.py")
    text = (tmp_path / "a.build123d.py").read_text()
    assert "ROD_BENDS = (5, 4)  # mm: radii in which the path takes the corners between its ends" in text
    assert "ROD_RADIUS = 1.5  # mm: radius" in text
    assert "TURN_BEND = 5  # mm: radius in which the path takes its corners" in text
    assert "ON_PATH = ((0, 0, 0), (10, 0, 0))  # mm: corners x, y and z of the path" in text
    assert "TUBE_THICKNESS = 0.5  # mm: thickness of the wall" in text
    export(Assembly(tuple(parts), unit="mm"), tmp_path / "a.scad")
    text = (tmp_path / "a.scad").read_text()
    assert "pipe_along(rod_path, rod_bends, rod_radius);" in text
    assert "pipe_along(tube_path, tube_bends, tube_radius, tube_thickness);" in text
    assert "// rod, 2 times: pipe" in text
    assert "turn_bend = 5;" in text
    assert text.count("module pipe_along") == 1


@pytest.mark.parametrize(("pipe", "_"), PIPES.values(), ids=PIPES)
def test_openscad_renders_the_pipe(tmp_path: Path, pipe: Pipe, _: Any) -> None:
    path = tmp_path / "a.scad"
    export(lone(pipe), path)
    assert not changes(path)
    mesh = rendered(path)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume(pipe), rel=2e-3)
    assert np.abs(lone(pipe).distance(mesh.vertices)).max() < 1e-4


def test_openscad_drills_a_pipe(tmp_path: Path) -> None:
    path = tmp_path / "a.scad"
    export(drilled((0, 0, 8), (1, 1, 0, 0)), path, facets=32)
    whole = mesh_assembly(drilled((0, 0, 8), (1, 1, 0, 0)), 256)
    assert rendered(path).volume == pytest.approx(whole.volume, rel=2e-2)


RIGID: list[tuple[str, dict[str, Any]]] = [
    (".mjcf.xml", {}),
    (".urdf", {}),
    (".sdf", {}),
    (".usda", {"physics": "usd"}),
    (".glb", {"physics": "khr"}),
    (".glb", {"physics": "godot"}),
    (".glb", {"physics": "unreal"}),
]


def colliding(tmp_path: Path, pipe: Pipe, suffix: str, options: dict[str, Any]) -> list[Any]:
    """What the report says of it."""
    if suffix == ".usda":
        pytest.importorskip("pxr")
    path = tmp_path / f"a{suffix}"
    export(dataclasses.replace(lone(pipe), unit="cm"), path, **options)
    return changes(path)


@pytest.mark.parametrize(("suffix", "options"), RIGID)
def test_a_rod_collides_as_a_chain_of_solids(tmp_path: Path, suffix: str, options: dict[str, Any]) -> None:
    (change,) = colliding(tmp_path, PIPES["a rod"][0], suffix, options)
    assert change["to"] == "chain of 9 solids"
    assert change["volume_error_ratio"] < 0.06
    assert change["max_deviation"] < 0.5 * 1.5  # of the radius: the edges of ends that are balls in Unreal


@pytest.mark.parametrize(("suffix", "options"), RIGID[:-1])
def test_a_straight_rod_collides_as_the_cylinder_that_it_is(
    tmp_path: Path, suffix: str, options: dict[str, Any]
) -> None:
    assert not colliding(tmp_path, Pipe(((0, 0, 0), (3, 4, 0)), 1), suffix, options)


def test_a_straight_rod_is_in_its_place() -> None:
    part = Part(Pipe(((0, 0, 1), (3, 4, 1)), 1), (1, 2, 3), (1, 2, 3, 4))
    rod = straight_rod(part)
    points = np.random.default_rng(0).uniform(-8, 8, (1000, 3)).astype(np.float32)
    assert rod is not None
    np.testing.assert_allclose(
        Assembly((rod,)).distance(points), Assembly((part,)).distance(points), atol=1e-5
    )


def test_a_narrow_bore_is_filled_where_only_convex_pieces_collide(tmp_path: Path) -> None:
    narrow, wide = PIPES["a tube"][0], Pipe(((0, 0, 0), (20, 0, 0, 10), (20, 20, 0)), 6, 0.8)
    (change,) = colliding(tmp_path, narrow, ".mjcf.xml", {})
    assert (change["to"], change["note"]) == ("chain of 9 solids", "its bore is filled")
    (change,) = colliding(tmp_path, narrow, ".urdf", {})
    assert change["to"] == "mesh"
    assert not has_narrow_bore(Part(wide), 1.3)


@pytest.mark.heavy
def test_a_wide_bore_stays_open(tmp_path: Path) -> None:
    wide = Pipe(((0, 0, 0), (20, 0, 0, 10), (20, 20, 0)), 6, 0.8)
    (change,) = colliding(tmp_path, wide, ".mjcf.xml", {})
    assert change["to"].endswith("convex pieces")


@pytest.mark.parametrize("kinds", [(Capsule,), (Capsule, Cylinder)])
@pytest.mark.parametrize("pipe", [pipe for pipe, _ in PIPES.values()], ids=PIPES)
def test_a_chain_has_no_gaps_and_stays_near(pipe: Pipe, kinds: tuple[type[Field], ...]) -> None:
    """All that lies this deep within the pipe is within the chain, and nothing is this far outside."""
    chain = Assembly(tuple(pipe_chain(Part(pipe), kinds, 0.2)))
    whole = Assembly((Part(dataclasses.replace(pipe, thickness=0.0)),))
    off = 0.2 + 0.1 * pipe.radius
    middles, across = rings(pipe, 1e-4)
    around = np.linspace(0, 2 * np.pi, 24)
    circle = np.stack([np.cos(around), np.sin(around)], axis=1) @ across
    # A chord's end is not quite square to the path, and the last capsule ends in a ball.
    at_end = (0.25 if Cylinder in kinds else 1.5) * pipe.radius
    inner = np.array(
        [
            ring
            for middle, ring in zip(middles, middles[:, None] + (pipe.radius - off) * circle, strict=True)
            if min(np.linalg.norm(middle - place) for place, _ in pipe.ends) > at_end
        ]
    ).reshape(-1, 3)
    assert chain.distance(inner.astype(np.float32)).max(initial=-1.0) < 1e-5
    lower, upper = whole.bounds()
    points = np.random.default_rng(0).uniform(lower - 1, upper + 1, (20_000, 3)).astype(np.float32)
    assert chain.distance(points[whole.distance(points) > off]).min() > 0


def test_the_shader_finds_the_distances() -> None:
    """Of pipes turned and moved, one of them twice, and one that is taken away."""
    parts = [
        Part(pipe, (0, 0, 30 * i), (1, 0.2 * i, 0.3, 0), name=name, blend=0.5 * (i == 1))
        for i, (name, (pipe, _)) in enumerate(PIPES.items())
    ]
    parts[0] = dataclasses.replace(parts[0], instances=(Similarity(translation=(0, 40, 0)),))
    whole = Assembly((Assembly(tuple(parts[:4])), parts[4]), "difference")
    lower, upper = whole.bounds()
    points = np.random.default_rng(0).uniform(lower - 3, upper + 3, (20_000, 3)).astype(np.float32)
    np.testing.assert_allclose(run_sdf(to_glsl(whole), points), whole.distance(points), atol=1e-4)
    for part in parts:
        alone = Assembly((part,))
        lower, upper = alone.bounds()
        points = np.random.default_rng(1).uniform(lower - 1, upper + 1, (5_000, 3)).astype(np.float32)
        np.testing.assert_allclose(run_sdf(to_glsl(alone), points), alone.distance(points), atol=1e-4)


def test_meshes_are_exact_and_blender_has_the_numbers(tmp_path: Path) -> None:
    for name, (pipe, _) in PIPES.items():
        export(lone(pipe), tmp_path / "a.blender.py", resolution=256)
        text = (tmp_path / "a.blender.py").read_text("ascii")
        data: dict[str, Any] = {}
        exec(text[: text.index("import bpy")], data)
        (entry,) = data["PARTS"]
        assert (entry["radius"], entry["thickness"]) == (pipe.radius, pipe.thickness), name
        export(lone(pipe), tmp_path / "a.stl", resolution=256)
        mesh = trimesh.load_mesh(tmp_path / "a.stl")
        assert mesh.is_watertight
        assert mesh.volume == pytest.approx(volume(pipe), rel=2e-2)
        assert np.abs(lone(pipe).distance(mesh.vertices)).max() < 1e-3


@pytest.mark.parametrize("suffix", [".svg", ".dxf"])
def test_drawings_of_profiles_refuse_what_has_none(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(UnsupportedFormatError, match="holds profiles"):
        export(lone(PIPES["a rod"][0]), tmp_path / f"a{suffix}")
    assert not list(tmp_path.iterdir())
