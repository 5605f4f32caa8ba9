"""Files that are cut, claim too much, or are no files: one named error that says what is wrong."""

from __future__ import annotations

import json
import os
import socket
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from solids import box

import partwright as pw
from partwright.errors import EmptyShapeError, NotFiniteError, PartwrightError, UnreadableFileError
from partwright.shapes import load_shape, step_process

QUADS = (
    "o block\n"
    + "".join(f"v {x} {y} {z}\n" for x, y, z in box().vertices)
    + "vn 0 0 1\nvt 0 0\ng side\nusemtl red\nf 1/1/1 2/1/1 4/1/1 3/1/1\nf 5//1 7//1 8//1 6//1\nf 1 3 7 5\n"
)


@pytest.mark.parametrize("text", [QUADS, box().export(file_type="obj")], ids=["quads", "triangles"])
def test_an_obj_cut_anywhere(text: str, tmp_path: Path) -> None:
    path = tmp_path / "cut.obj"
    refused = 0
    for end in range(1, len(text), max(1, len(text) // 15)):
        path.write_text(text[:end])
        try:
            load_shape(path)
        except PartwrightError:
            refused += 1
    assert refused > 10  # of 15


def test_a_cut_stl_says_how_much_is_there(tmp_path: Path) -> None:
    path = tmp_path / "cut.stl"
    path.write_bytes(box().export(file_type="stl")[: 84 + 3 * 50 + 7])
    with pytest.raises(UnreadableFileError, match="has 12 triangles and holds 3: the file is cut"):
        load_shape(path)


def test_an_stl_whose_own_header_begins_with_solid(tmp_path: Path) -> None:
    path = tmp_path / "solid.stl"
    path.write_bytes(b"solid by another program".ljust(80) + box().export(file_type="stl")[80:])
    assert load_shape(path).volume == pytest.approx(1)


@pytest.mark.parametrize("kind", ["pipe", "socket", "device", "loop", "folder", "long", "nul"])
@pytest.mark.parametrize("read", [load_shape, pw.load_assembly], ids=["shape", "assembly"])
def test_what_is_no_file_is_refused_at_once(kind: str, read: Any, tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.chdir(tmp_path)
    path = Path("thing.stl")
    match kind:
        case "pipe":
            os.mkfifo(path)
        case "socket":
            with socket.socket(socket.AF_UNIX) as made:
                made.bind(str(path))
        case "device":
            path.symlink_to("/dev/zero")
        case "loop":
            path.symlink_to(path)
        case "folder":
            path.mkdir()
        case "long":
            path = Path("x" * 300 + ".stl")
        case "nul":
            path = Path("a\0b.stl")
    with pytest.raises(UnreadableFileError, match=r"pipe, socket or device|is a folder|cannot be read"):
        read(path)


def test_a_3mf_that_unpacks_to_very_much_is_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "bomb.3mf"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("3D/3dmodel.model", "w") as file,
    ):
        for _ in range(90):
            file.write(b'<vertex x="0" y="0" z="0"/>' * (1 << 20 >> 5))
    with pytest.raises(UnreadableFileError, match="would unpack to"):
        load_shape(path)


def scene(nodes: list[dict[str, Any]], **more: Any) -> dict[str, Any]:
    return {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, **more}


CHAIN = [{"children": [i + 1]} for i in range(5000)] + [{"mesh": 0}]
EMPTY = {"componentType": 5126, "type": "VEC3", "count": 1 << 30}


@pytest.mark.parametrize(
    ("tree", "says"),
    [
        (scene(CHAIN), "deep below one another"),
        (scene([{}, {"children": [2]}, {"children": [1]}]), "their own ancestors"),
        (scene([{"children": [1, 2]}, {"children": [3]}, {"children": [3]}, {}]), "two parents"),
        (scene([{"mesh": 0}], accessors=[EMPTY]), "have no data"),
        (scene([{"mesh": 0}], buffers=[{"uri": "pipe", "byteLength": 100}]), "is a pipe"),
        (scene([{}], extensionsRequired=["EXT_meshopt_compression"]), "compressed"),
        (scene([{}], extensionsRequired=["KHR_draco_mesh_compression"]), "pip install DracoPy"),
        (
            scene(
                [{"mesh": 0}] * 1000,
                accessors=[{**EMPTY, "bufferView": 0}],
                meshes=[{"primitives": [{"attributes": {"POSITION": 0}}]}],
            ),
            "corners of triangles",
        ),
    ],
)
@pytest.mark.parametrize("binary", [False, True])
def test_a_gltf_that_would_take_for_ever(
    tree: dict[str, Any], says: str, binary: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("partwright.shapes.gltf_tree.find_spec", lambda _: None)  # without DracoPy
    os.mkfifo(tmp_path / "pipe")
    text = json.dumps(tree).encode()
    path = tmp_path / f"scene.{'glb' if binary else 'gltf'}"
    head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A)
    path.write_bytes(head + text if binary else text)
    with pytest.raises(UnreadableFileError, match=says):
        load_shape(path)


@pytest.mark.parametrize("version", ["1.0", 1])
def test_the_first_gltf_is_told_from_a_damaged_file(version: str | int, tmp_path: Path) -> None:
    path = tmp_path / "a.gltf"
    path.write_text(json.dumps({"asset": {"version": version}, "meshes": {}}))
    with pytest.raises(UnreadableFileError, match=r"a\.gltf: is glTF 1\.0, .*convert it"):
        load_shape(path)
    path = tmp_path / "a.glb"
    path.write_bytes(struct.pack("<4sIIII", b"glTF", 1, 24, 4, 0) + b"{}  ")
    with pytest.raises(UnreadableFileError, match=r"a\.glb: is glTF 1\.0"):
        load_shape(path)


def test_nan_in_a_transform(tmp_path: Path) -> None:
    import trimesh

    path = tmp_path / "nan.glb"
    made = trimesh.Scene()
    made.add_geometry(box(), node_name="body", transform=np.diag((1.5, 1, 1, 1)))
    path.write_bytes(made.export(file_type="glb").replace(b"[1.5,", b"[NaN,"))
    with pytest.raises((NotFiniteError, UnreadableFileError)):
        load_shape(path)


def test_messages_do_not_quote_a_megabyte() -> None:
    said = str(UnreadableFileError("begin " + "x" * 1_500_000 + " end"))
    assert len(said) < 1100
    assert said.startswith("begin")
    assert said.endswith("end")


@pytest.fixture(scope="module")
def solid(tmp_path_factory: pytest.TempPathFactory) -> str:
    pytest.importorskip("OCP")
    path = tmp_path_factory.mktemp("step") / "block.step"
    pw.export(pw.Assembly((pw.Part(pw.fields.Box((2, 1, 1))),), unit="mm"), path)
    return path.read_text()


def test_a_step_file_that_breaks_opencascade(solid: str, tmp_path: Path, monkeypatch: Any) -> None:
    path = tmp_path / "block.step"
    path.write_text(solid)
    monkeypatch.setattr(step_process, "_CHILD", "import os; os.abort()")
    with pytest.raises(UnreadableFileError, match="OpenCASCADE broke down over it"):
        load_shape(path)
    monkeypatch.setattr(step_process, "_CHILD", "import time; time.sleep(60)")
    monkeypatch.setattr(step_process, "_SECONDS", 0.5)
    with pytest.raises(UnreadableFileError, match="came to no end"):
        load_shape(path)


def test_errors_of_the_child_are_the_parents(tmp_path: Path, solid: str) -> None:
    path = tmp_path / "none.step"
    path.write_text("no step file")
    with pytest.raises(UnreadableFileError, match="cannot be read as STEP"):
        load_shape(path)
    path.write_text(solid[: solid.index("DATA;")] + "DATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    with pytest.raises((EmptyShapeError, UnreadableFileError)):
        load_shape(path)
