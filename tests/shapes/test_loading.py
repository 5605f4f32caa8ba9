"""Files in: every format, scenes, units, and every way a file can be bad."""

from __future__ import annotations

import contextlib
import os
import struct
import zipfile

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from solids import box

from partwright.errors import (
    EmptyShapeError,
    NeedsSurfaceError,
    NotFiniteError,
    PartwrightError,
    SettingError,
    UnreadableFileError,
    UnsupportedFormatError,
)
from partwright.shapes import MESH_SUFFIXES, NodeLeftOutWarning, canonical_unit, load_shape


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_a_name_that_is_not_utf_8(tmp_path, suffix):
    plain = tmp_path / f"part{suffix}"
    box().export(plain)
    odd = tmp_path / os.fsdecode(b"p\xffrt" + suffix.encode())
    try:
        plain.rename(odd)
    except OSError:
        pytest.skip("this file system takes no such name")
    shape = load_shape(odd)
    assert (shape.name, shape.file) == ("p_rt", odd.name)
    assert shape.volume == pytest.approx(load_shape(box()).volume)
    assert all(node.name.isascii() for node in shape.nodes)


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
def test_every_format_gives_the_same_box(tmp_path, suffix):
    path = tmp_path / f"part{suffix}"
    mesh = box((1, 2, 3), (10, 20, 30))
    if suffix == ".gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(mesh)).items():
            (tmp_path / name.replace("model", "part")).write_bytes(data)
    else:
        mesh.export(path)
    shape = load_shape(path)
    assert shape.volume == pytest.approx(6, rel=1e-6)
    assert shape.area == pytest.approx(22, rel=1e-6)
    np.testing.assert_allclose(shape.frame.centre, (10, 20, 30), rtol=1e-6)
    assert shape.confidence == 1.0
    assert shape.name == "part"
    says = {".glb": ("m", "y"), ".gltf": ("m", "y"), ".dae": ("m", "y"), ".3mf": ("mm", None)}
    assert (shape.unit, shape.up) == says.get(suffix, (None, None))


def test_scene_transforms_instances_and_names(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(box(), geom_name="cube", node_name="left", transform=np.diag([2.0, 2, 2, 1]))
    mirror = np.diag([-1.0, 1, 1, 1])
    mirror[0, 3] = 5
    scene.graph.update("right", geometry="cube", matrix=mirror)
    path = tmp_path / "pair.glb"
    scene.export(path)
    shape = load_shape(path)
    assert shape.volume == pytest.approx(8 + 1, rel=1e-6)
    assert {node.name for node in shape.nodes} == {"left", "right"}
    assert [node.stop - node.start for node in shape.nodes] == [12, 12]
    volumes = {s.name: s.volume for s in shape.split_nodes()}
    assert volumes == {"left": pytest.approx(8, rel=1e-6), "right": pytest.approx(1, rel=1e-6)}
    assert all((s.unit, s.up) == ("m", "y") for s in shape.split_nodes())


def test_objects_of_an_obj_become_nodes_with_unique_names(tmp_path):
    cube = box().export(file_type="obj", include_normals=False, header=None)
    far = box(centre=(3, 0, 0)).export(file_type="obj", include_normals=False, header=None)
    shifted = far.replace("f ", "f +")
    lines = [
        "f " + " ".join(str(int(n) + 8) for n in line.split()[1:]) if line.startswith("f") else line
        for line in shifted.splitlines()
    ]
    path = tmp_path / "two.obj"
    path.write_text("o wheel\n" + cube + "\no hub\n" + "\n".join(lines))
    shape = load_shape(path)
    assert sorted(node.name for node in shape.nodes) == ["hub", "wheel"]
    assert shape.volume == pytest.approx(2)


def test_a_flat_node_is_left_out_of_the_split_with_a_warning(tmp_path):
    scene = trimesh.Scene()
    scene.add_geometry(box(), node_name="body", geom_name="body")
    sheet = trimesh.Trimesh([[0, 0, 2], [1, 0, 2], [0, 1, 2]], [[0, 1, 2]])
    scene.add_geometry(sheet, node_name="decal", geom_name="decal")
    path = tmp_path / "decal.glb"
    scene.export(path)
    with pytest.warns(NodeLeftOutWarning, match="decal"):
        assert [s.name for s in load_shape(path).split_nodes()] == ["body"]


def test_stated_unit_and_up_overrule_the_file():
    shape = load_shape(box(), unit="millimetres", up="Z")
    assert (shape.unit, shape.up) == ("mm", "z")
    with pytest.raises(SettingError, match="furlong"):
        load_shape(box(), unit="furlong")
    with pytest.raises(SettingError, match="up axis"):
        load_shape(box(), up="w")


@pytest.mark.parametrize(("name", "short"), [("Inches", "in"), ("feet", "ft"), ("microns", "um"), ("M", "m")])
def test_unit_aliases(name, short):
    assert canonical_unit(name) == short


def test_unknown_suffix_lists_what_is_read(tmp_path):
    with pytest.raises(UnsupportedFormatError, match=r"\.obj, \.ply"):
        load_shape(tmp_path / "part.dwg")


def test_missing_empty_and_folder(tmp_path):
    with pytest.raises(UnreadableFileError, match="no such file"):
        load_shape(tmp_path / "none.stl")
    (tmp_path / "zero.stl").touch()
    with pytest.raises(EmptyShapeError):
        load_shape(tmp_path / "zero.stl")
    (tmp_path / "folder.stl").mkdir()
    with pytest.raises(UnreadableFileError):
        load_shape(tmp_path / "folder.stl")


def test_a_few_points_show_no_surface(tmp_path):
    path = tmp_path / "cloud.ply"
    trimesh.PointCloud(np.random.default_rng(0).random((20, 3))).export(path)
    with pytest.raises(NeedsSurfaceError):
        load_shape(path)
    with pytest.raises(NeedsSurfaceError):
        load_shape((np.zeros((4, 3)), np.zeros((0, 3))))


def test_nan_is_refused_only_where_a_triangle_uses_it():
    mesh = box()
    unused = np.vstack([mesh.vertices, [np.nan] * 3])
    assert load_shape((unused, mesh.faces)).volume == pytest.approx(1)
    broken = mesh.vertices.copy()
    broken[3, 1] = np.inf
    with pytest.raises(NotFiniteError, match="1 of 8"):
        load_shape((broken, mesh.faces))


def test_nan_colours_do_not_matter(tmp_path):
    path = tmp_path / "colour.obj"
    lines = [f"v {x} {y} {z} nan nan nan" for x, y, z in box().vertices]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in box().faces]
    path.write_text("\n".join(lines))
    assert load_shape(path).volume == pytest.approx(1)


def test_indices_outside_the_vertices():
    with pytest.raises(UnreadableFileError, match="vertex 99"):
        load_shape((box().vertices, [[0, 1, 99]]))


@pytest.mark.parametrize("suffix", MESH_SUFFIXES)
@pytest.mark.parametrize("kept", [0.05, 0.5, 0.9])
def test_truncated_files_give_a_named_error_or_a_shape(tmp_path, suffix, kept):
    path = tmp_path / f"cut{suffix}"
    whole = box().export(file_type=suffix[1:]) if suffix != ".gltf" else b'{"asset": {"version": "2.0"}, "no'
    whole = whole.encode() if isinstance(whole, str) else whole
    path.write_bytes(whole[: int(len(whole) * kept)])
    with pytest.raises(PartwrightError):
        load_shape(path)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(min_size=1, max_size=300), suffix=st.sampled_from(MESH_SUFFIXES))
def test_garbage_gives_a_named_error(tmp_path, data, suffix):
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(data)
    with pytest.raises(PartwrightError):
        load_shape(path)


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    place=st.floats(0, 1),
    byte=st.integers(0, 255),
    suffix=st.sampled_from([".ply", ".stl", ".glb", ".3mf", ".off"]),
)
def test_one_broken_byte_never_escapes_as_a_library_error(tmp_path, place, byte, suffix):
    path = tmp_path / f"bit{suffix}"
    data = box().export(file_type=suffix[1:])
    data = bytearray(data.encode() if isinstance(data, str) else data)
    data[min(int(place * len(data)), len(data) - 1)] = byte
    path.write_bytes(data)
    with contextlib.suppress(PartwrightError):
        load_shape(path)


def test_claims_of_huge_counts_are_refused(tmp_path):
    stl = tmp_path / "huge.stl"
    stl.write_bytes(b"\0" * 80 + struct.pack("<I", 2**32 - 1) + b"\0" * 50)
    ply = tmp_path / "huge.ply"
    ply.write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 999999999999\nproperty float x\n"
        b"property float y\n"
        b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n1234"
    )
    for path in (stl, ply):
        with pytest.raises((UnreadableFileError, EmptyShapeError)):
            load_shape(path)


def test_zip_bomb_is_refused_before_it_unpacks(tmp_path, monkeypatch):
    monkeypatch.setattr("partwright.shapes.threemf._LARGEST_UNPACKED", 1000)
    path = tmp_path / "bomb.3mf"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("3D/3dmodel.model", b"0" * 100_000)
    with pytest.raises(UnreadableFileError, match="unpack"):
        load_shape(path)
