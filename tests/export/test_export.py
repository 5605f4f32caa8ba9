"""Every format read back by another reader: what was written is what was meant."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part, Similarity, load_assembly
from partwright.assembly.palette import palette
from partwright.errors import OutputError, SettingError, UnsupportedFormatError
from partwright.export import export
from partwright.export.formats import FORMATS
from partwright.export.glb import to_gltf
from partwright.fields import Box, Cylinder, Sphere, SuperFrustum

BALL_VOLUME = 4 / 3 * np.pi


def pair(**about: Any) -> Assembly:
    post = Part(Cylinder(0.5, 2.0), (0, 0, 1), (0.5, 0.5, 0.5, 0.5), name="post", metadata={"parent": "root"})
    inner = Assembly((Part(Sphere(1.0), (3, 0, 0), name="ball"),), name="group")
    return Assembly((post, inner), **about)


def header(path: Path) -> dict[str, Any]:
    """The JSON chunk of a GLB file, read by hand."""
    data = path.read_bytes()
    magic, version, size, length, kind = struct.unpack("<4sIII4s", data[:20])
    assert (magic, version, size, kind) == (b"glTF", 2, len(data), b"JSON")
    return json.loads(data[20 : 20 + length])


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".obj"])
def test_surfaces_are_watertight_in_their_own_place(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"ball{suffix}"
    export(Assembly((Part(Sphere(1.0), (10, 0, 0)),)), path, resolution=48)
    mesh = trimesh.load_mesh(path)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(BALL_VOLUME, rel=5e-3)
    assert np.allclose(mesh.bounds, [[9, -1, -1], [11, 1, 1]], atol=0.02)


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
@pytest.mark.parametrize(("scale", "place"), [(1e-6, 0.0), (1.0, 1e6)])
def test_small_and_far_surfaces_keep_their_digits(
    tmp_path: Path, suffix: str, scale: float, place: float
) -> None:
    path = tmp_path / f"ball{suffix}"
    export(Assembly((Part(Sphere(scale), (place, 0, 0)),)), path, resolution=32)
    vertices = trimesh.load_mesh(path, process=False).vertices - [place, 0, 0]
    assert np.allclose(np.linalg.norm(vertices, axis=1) / scale, 1.0, atol=0.01)


def test_glb_copies_share_one_mesh_below_the_part(tmp_path: Path) -> None:
    turn = Similarity(1.0, (1.0, 0.0, 0.0, 1.0), (0.5, 0.0, 0.0))
    leg = Part(Cylinder(0.1, 1.0), (1, 0, 0), (1, 1, 0, 0), name="leg", instances=(turn, turn @ turn))
    export(Assembly((leg, Part(Sphere(0.1), name="leg/2"))), tmp_path / "legs.glb")
    tree = header(tmp_path / "legs.glb")
    nodes = {node["name"]: node for node in tree["nodes"]}
    assert set(nodes) == {"assembly", "leg", "leg/2", "leg/2_02", "leg/3"}
    assert len({nodes[name]["mesh"] for name in ("leg", "leg/2_02", "leg/3")}) == 1
    assert [tree["nodes"][i]["name"] for i in nodes["leg"]["children"]] == ["leg/2_02", "leg/3"]
    assert len(nodes["leg"]["extras"]["instances"]) == 2
    scene = trimesh.load_scene(tmp_path / "legs.glb")
    for name, copy in zip(("leg", "leg/2_02", "leg/3"), leg.copies, strict=True):
        pose, _ = scene.graph.get(name)
        assert np.allclose(pose, Similarity(1.0, copy.rotation, copy.translation).matrix(), atol=1e-6)


def test_glb_has_a_named_coloured_node_with_parameters_for_each_part(tmp_path: Path) -> None:
    assembly, path = pair(), tmp_path / "pair.glb"
    export(assembly, path)
    tree = header(path)
    nodes = {node["name"]: node for node in tree["nodes"]}
    assert set(nodes) == {"assembly", "group", "post", "ball"}
    assert nodes["post"]["extras"] == {
        "field": {"kind": "cylinder", "radius": 0.5, "height": 2.0},
        "translation": [0.0, 0.0, 1.0],
        "rotation": [0.5, 0.5, 0.5, 0.5],
        "blend": 0.0,
        "metadata": {"parent": "root"},
    }
    colours = set()
    for name in ("post", "ball"):
        primitive = tree["meshes"][nodes[name]["mesh"]]["primitives"][0]
        pbr = tree["materials"][primitive["material"]]["pbrMetallicRoughness"]
        colours.add(tuple(pbr["baseColorFactor"]))
    linear = ((palette(2) / 255 + 0.055) / 1.055) ** 2.4
    assert np.allclose(sorted(colours), sorted([*row, 1.0] for row in linear), atol=1 / 255)


def test_glb_geometry_is_in_place_and_closed(tmp_path: Path) -> None:
    export(pair(), tmp_path / "pair.glb")
    scene = trimesh.load(tmp_path / "pair.glb")
    meshes = {}
    for name in ("post", "ball"):
        matrix, geometry = scene.graph[name]
        meshes[name] = scene.geometry[geometry].copy().apply_transform(matrix)
    assert all(mesh.is_watertight for mesh in meshes.values())
    assert np.allclose(meshes["ball"].bounds, [[2, -1, -1], [4, 1, 1]], atol=0.05)
    assert np.allclose(meshes["post"].bounds, [[-1, -0.5, 0.5], [1, 0.5, 1.5]], atol=0.05)


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("in", 0.0254), ("m", 1.0)])
def test_glb_is_in_metres(tmp_path: Path, unit: str, metres: float) -> None:
    export(pair(unit=unit, up="y"), tmp_path / "pair.glb")
    scene = trimesh.load(tmp_path / "pair.glb")
    assert np.allclose(scene.bounds, np.array([[-1, -1, -1], [4, 1, 1.5]]) * metres, atol=0.05 * metres)


@pytest.mark.parametrize("axis", ["x", "y", "z", "-x", "-y", "-z"])
def test_every_up_axis_becomes_y(axis: str) -> None:
    up = np.zeros(3)
    up["xyz".index(axis[-1])] = -1.0 if axis.startswith("-") else 1.0
    assert np.allclose(to_gltf(pair(up=axis))(up), [0, 1, 0])


def test_glb_says_where_the_unit_is_unknown(tmp_path: Path) -> None:
    export(pair(), tmp_path / "a.glb")
    export(pair(unit="mm"), tmp_path / "b.glb")
    assert "unknown" in header(tmp_path / "a.glb")["asset"]["extras"]["note"]
    assert "note" not in header(tmp_path / "b.glb")["asset"]["extras"]


def test_subtracted_parts_are_marked(tmp_path: Path) -> None:
    export(Part(Box((2, 2, 2)), name="block") - Part(Sphere(0.5), name="hole"), tmp_path / "a.glb")
    nodes = {node["name"]: node for node in header(tmp_path / "a.glb")["nodes"]}
    assert nodes["hole"]["extras"]["role"] == "subtracted"
    assert "role" not in nodes["block"]["extras"]


def test_what_is_subtracted_is_marked_within_wholes_too(tmp_path: Path) -> None:
    """A hole's own core is none of what is subtracted."""
    ring = Part(Sphere(0.5), name="hole") - Part(Sphere(0.2), name="core")
    export(Part(Box((2, 2, 2)), name="block") - ring, tmp_path / "a.glb")
    nodes = {node["name"]: node for node in header(tmp_path / "a.glb")["nodes"]}
    roles = {part["name"]: part.get("role") for part in nodes["block"]["extras"]["parts"]}
    assert roles == {"block": None, "hole": "subtracted", "core": None}
    assert "mesh" not in nodes["hole"]
    assert "role" not in nodes["core"]["extras"]


def test_a_part_without_volume_is_a_node_without_mesh(tmp_path: Path) -> None:
    sheet = Part(SuperFrustum((1, 1, 1), onion=1.0), name="sheet")
    export(Part(Sphere(1.0), name="ball") | sheet, tmp_path / "a.glb")
    nodes = {node["name"]: node for node in header(tmp_path / "a.glb")["nodes"]}
    assert "mesh" not in nodes["sheet"]
    assert nodes["sheet"]["extras"]["note"] == "no surface of its own at this resolution"
    assert "mesh" in nodes["ball"]


def test_json_is_the_assembly_file(tmp_path: Path) -> None:
    export(pair(unit="mm"), tmp_path / "a.json")
    assert load_assembly(tmp_path / "a.json") == pair(unit="mm")


@pytest.mark.parametrize("suffix", list(FORMATS.own))
def test_same_assembly_same_bytes_and_nothing_left_behind(tmp_path: Path, suffix: str) -> None:
    paths = [tmp_path / folder / f"a{suffix}" for folder in ("first", "second")]
    for path in paths:
        path.parent.mkdir()
        export(pair(), path)
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert all(list(path.parent.iterdir()) == [path] for path in paths)


@pytest.mark.parametrize("suffix", list(FORMATS.own))
def test_a_missing_folder_is_named(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(OutputError, match="nowhere"):
        export(pair(), tmp_path / "nowhere" / f"a{suffix}")


def test_unknown_suffixes_and_options(tmp_path: Path) -> None:
    with pytest.raises(UnsupportedFormatError, match=r"'.dwg' .*\.json, \.glb, \.ply, \.stl, \.obj"):
        export(pair(), tmp_path / "a.dwg")
    with pytest.raises(SettingError, match=r"Assembly file has no option 'resolution'; it has none"):
        export(pair(), tmp_path / "a.json", resolution=3)
    assert not list(tmp_path.iterdir())
