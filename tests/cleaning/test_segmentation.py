"""Every face has the label of the part that it was made from, and coarse labels are never crossed."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part, Similarity
from partwright.cleaning import segment
from partwright.cleaning.coarse_labels import colour_labels, property_labels
from partwright.cleaning.segmentation import node_labels
from partwright.cli.main import main
from partwright.errors import LabelError, NoColoursError, SettingError, UnreadableFileError
from partwright.fields import Box, Cylinder, Sphere
from partwright.shapes import Shape, load_shape
from partwright.shapes.labels import labels_path, read_labels


def dumbbell() -> tuple[Shape, Assembly, np.ndarray]:
    """Two balls and a bar that do not touch, and which face belongs to which."""
    meshes = [trimesh.creation.icosphere(2, 1.0), trimesh.creation.icosphere(2, 0.6)]
    meshes.append(trimesh.creation.box((1.5, 0.05, 0.05)))
    for mesh, x in zip(meshes, (-2.0, 2.0, 0.2), strict=True):
        mesh.apply_translation((x, 0, 0))
    parts = (
        Part(Sphere(1.0), (-2, 0, 0), name="left"),
        Part(Sphere(0.6), (2, 0, 0), name="right", blend=0.5),
        Part(Box((1.5, 0.05, 0.05)), (0.2, 0, 0), name="bar"),
    )
    truth = np.repeat([0, 1, 2], [len(m.faces) for m in meshes])
    return load_shape(trimesh.util.concatenate(meshes)), Assembly(parts), truth


def drilled() -> tuple[Shape, Assembly]:
    plate, tool = trimesh.creation.box((2, 2, 0.5)), trimesh.creation.cylinder(0.4, 2.0, sections=64)
    assembly = Assembly(
        (Part(Box((2, 2, 0.5)), name="plate"), Part(Cylinder(0.4, 2.0), name="hole")), "difference"
    )
    return load_shape(trimesh.boolean.difference([plate, tool])), assembly


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    shape, assembly, _ = dumbbell()
    trimesh.Trimesh(shape.input_vertices, shape.input_faces, process=False).export(tmp_path / "shape.ply")
    assembly.save(tmp_path / "assembly.json")
    return tmp_path / "shape.ply", tmp_path / "assembly.json"


def test_each_face_has_the_label_of_its_own_part() -> None:
    shape, assembly, truth = dumbbell()
    labels, names = segment(shape, assembly)
    assert names == ("left", "right", "bar")
    assert labels.tolist() == truth.tolist()


@pytest.mark.parametrize(("scale", "place"), [(1e-4, 0.0), (1e3, 1e5)])
def test_size_and_place_change_nothing(scale: float, place: float) -> None:
    shape, assembly, truth = dumbbell()
    vertices = shape.input_vertices * scale + place
    moved = assembly.scaled(scale).translated((place,) * 3)
    assert segment(load_shape((vertices, shape.input_faces)), moved)[0].tolist() == truth.tolist()


def test_the_wall_of_a_hole_belongs_to_the_part_that_cuts_it() -> None:
    shape, assembly = drilled()
    labels, _ = segment(shape, assembly)
    corners = shape.input_vertices[shape.input_faces]
    on_wall = (np.abs(np.linalg.norm(corners[..., :2], axis=2) - 0.4) < 1e-3).all(axis=1)
    upright = np.ptp(corners[..., 2], axis=1) > 0.1
    assert on_wall.any()
    assert (labels == (on_wall & upright)).all()


def test_long_thin_faces_are_decided_by_their_area_and_not_by_their_centre() -> None:
    """A face 10 long: the small ball touches its centre, the slab has the rest."""
    vertices = np.array([[-5, 0, 0], [5, 0, 0], [0, 0.2, 0], [0, 0, -1.0]])
    shape = load_shape((vertices, [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]]))
    slab = Part(Box((12, 2, 1)), (0, 0, -0.55), name="slab")
    ball = Part(Sphere(0.1), (0, 0.0667, -0.1), name="ball")
    centre = np.array([[0, 0.0667, 0]])
    away = np.abs(Assembly((slab, ball)).part_distances(centre))
    assert away[1] < away[0]
    assert segment(shape, Assembly((slab, ball)))[0][0] == 0


def test_equally_near_parts_give_the_earlier_one() -> None:
    shape, assembly, _ = dumbbell()
    twice = Assembly((*assembly.parts, *assembly.parts))
    assert set(segment(shape, twice)[0].tolist()) == {0, 1, 2}


def test_parts_never_cross_given_labels() -> None:
    shape, assembly, truth = dumbbell()
    coarse = np.where(shape.input_vertices[shape.input_faces].mean(axis=1)[:, 1] > 0, "upper", "lower")
    labels, names = segment(shape, assembly, coarse)
    wanted = [f"{c}/{assembly.parts[t].name}" for c, t in zip(coarse, truth, strict=True)]
    assert [names[label] for label in labels] == wanted
    assert len(names) == len(set(wanted)) == 6


def test_faces_of_a_node_are_of_its_own_parts() -> None:
    """However near another node's part lies; faces of labels that no node has go to any."""
    shape, assembly, truth = dumbbell()
    left, right, bar = assembly.parts
    # Neither the whole nor a part is a node, whatever its name.
    groups = (Assembly((left, bar), name="near"), Assembly((replace(right, name="other"),), name="far"))
    nodes = Assembly(groups, name="near")
    labels, names = segment(shape, nodes, np.where(truth == 0, "other", "near"))
    named = np.array(names)[labels]
    assert (named[truth == 0] == "other/left").all()
    assert (named[truth > 0] == "near/bar").all()  # the right ball's faces, too


def test_nodes_of_a_scene_are_labels(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for z, name in enumerate(("cup", "lid")):
        place = trimesh.transformations.translation_matrix((0, 0, z))
        scene.add_geometry(trimesh.creation.box((1, 1, 1)), name, name, transform=place)
    scene.export(tmp_path / "scene.glb")
    shape = load_shape(tmp_path / "scene.glb")
    labels, names = segment(
        shape, Assembly((Part(Box((1, 1, 2)), (0, 0, 0.5), name="jar"),)), node_labels(shape)
    )
    assert names == ("cup/jar", "lid/jar")
    assert np.bincount(labels).tolist() == [12, 12]


@pytest.mark.parametrize(
    ("within", "message"),
    [
        (np.zeros(3, int), "3 labels; the shape has"),
        (np.zeros(700), "one string or integer a face"),
        ([[1, 2]], "one string or integer a face"),
    ],
)
def test_labels_that_do_not_fit_the_faces_are_refused(within: object, message: str) -> None:
    shape, assembly, _ = dumbbell()
    with pytest.raises(SettingError, match=message):
        segment(shape, assembly, within)  # type: ignore[arg-type]


def test_the_command_writes_coloured_faces_and_labels(files: tuple[Path, Path], tmp_path: Path) -> None:
    out, truth = tmp_path / "segments.ply", dumbbell()[2]
    assert main(["segment", *map(str, files), "-o", str(out)]) == 0
    about = json.loads(labels_path(out).read_text())
    assert about["names"] == ["left", "right", "bar"]
    assert about["labels"] == truth.tolist()
    mesh = trimesh.load_mesh(out, process=False)
    assert len(np.unique(mesh.visual.face_colors, axis=0)) == 3
    assert (mesh.visual.face_colors[truth == 0] == mesh.visual.face_colors[0]).all()


def test_the_command_reads_its_own_labels_again(files: tuple[Path, Path], tmp_path: Path) -> None:
    first, second = tmp_path / "a.ply", tmp_path / "b.glb"
    assert main(["segment", *map(str, files), "-o", str(first)]) == 0
    within = ["--within", str(labels_path(first))]
    assert main(["segment", *map(str, files), "-o", str(second), *within]) == 0
    assert set(trimesh.load_scene(second).geometry) == {"left/left", "right/right", "bar/bar"}


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("l.json", b"[1, 2"),
        ("l.json", b'{"names": []}'),
        ("l.json", b'{"labels": [5], "names": ["a"]}'),
        ("l.json", b'{"labels": [-1], "names": ["a"]}'),
        ("l.json", b"[[1, 2], [3]]"),
        ("l.json", b"[0.5]"),
        ("l.npy", b"\x93NUMPY\x01\x00garbage"),
        ("l.txt", b"\xff\xfe\x00"),
    ],
)
def test_broken_label_files_are_named(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UnreadableFileError, match=name):
        read_labels(tmp_path / name)


def test_label_files_of_every_kind(tmp_path: Path) -> None:
    np.save(tmp_path / "l.npy", np.array([3, 1]))
    (tmp_path / "l.txt").write_text("wheel\nbody\n")
    (tmp_path / "l.json").write_text('["wheel", "body"]')
    assert read_labels(tmp_path / "l.npy").tolist() == [3, 1]
    assert read_labels(tmp_path / "l.txt").tolist() == ["wheel", "body"]
    assert read_labels(tmp_path / "l.json").tolist() == ["wheel", "body"]


@pytest.mark.parametrize(("suffix", "words"), [(".obj", "use one of .ply, .glb"), ("", "use one of")])
def test_other_suffixes_are_refused_before_the_work(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str], suffix: str, words: str
) -> None:
    assert main(["segment", *map(str, files), "-o", str(tmp_path / f"out{suffix}")]) == 2
    assert words in capsys.readouterr().err


def test_a_missing_label_file_is_one_line(
    files: tuple[Path, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [*map(str, files), "-o", str(tmp_path / "o.ply"), "--within", str(tmp_path / "none.txt")]
    assert main(["segment", *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1


RED, BLUE = (200, 30, 30, 255), (20, 20, 180, 255)


def painted(path: Path) -> tuple[Path, np.ndarray]:
    """The dumbbell with a red bar and blue balls, in a file; and which faces are red."""
    shape, assembly, truth = dumbbell()
    red = truth == 2
    mesh = trimesh.Trimesh(shape.input_vertices, shape.input_faces, process=False)
    mesh.visual.face_colors = np.where(red[:, None], RED, BLUE)
    if path.suffix == ".glb":
        scene = trimesh.Scene()
        for colour, own in ((RED, red), (BLUE, ~red)):
            piece = mesh.submesh([np.flatnonzero(own)], append=True)
            material = trimesh.visual.material.PBRMaterial(baseColorFactor=colour)
            piece.visual = trimesh.visual.TextureVisuals(material=material)
            scene.add_geometry(piece)
        scene.export(path)
    else:
        mesh.export(path)
    assembly.save(path.with_name("assembly.json"))
    return path, red


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_one_colour_a_label(tmp_path: Path, suffix: str) -> None:
    path, red = painted(tmp_path / f"shape{suffix}")
    shape = load_shape(path)
    labels = colour_labels(path, shape)
    assert len(set(labels)) == 2
    middles = shape.input_vertices[shape.input_faces].mean(axis=1)
    on_bar = (np.abs(middles[:, 1:]) <= 0.0251).all(axis=1) & (np.abs(middles[:, 0] - 0.2) <= 0.751)
    assert on_bar.sum() == red.sum()
    assert len(set(labels[on_bar])) == len(set(labels[~on_bar])) == 1


def test_coarse_labels_by_colour_or_property_divide_into_nested_nodes(tmp_path: Path) -> None:
    path, _ = painted(tmp_path / "shape.ply")
    out = tmp_path / "out.glb"
    words = ["segment", str(path), str(tmp_path / "assembly.json"), "-o"]
    assert main([*words, str(out), "--within", "colours"]) == 0
    scene = trimesh.load_scene(out)
    above = {name: scene.graph.transforms.parents[name] for name in scene.graph.nodes_geometry}
    blue, red = "#1414b4", "#c81e1e"
    assert above == {f"{blue}/left": blue, f"{blue}/right": blue, f"{red}/bar": red}
    labelled, again = tmp_path / "labelled.ply", tmp_path / "again.ply"
    assert main([*words, str(labelled)]) == 0
    words[1] = str(labelled)
    assert main([*words, str(again), "--within", "face:label"]) == 0
    assert json.loads(labels_path(again).read_text())["names"] == ["0/left", "1/right", "2/bar"]


def test_labels_in_usd_are_nested_and_valid(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdValidation

    path, _ = painted(tmp_path / "shape.ply")
    out = tmp_path / "out.usda"
    words = ["segment", str(path), str(tmp_path / "assembly.json"), "-o", str(out), "--within", "colours"]
    assert main(words) == 0
    stage = Usd.Stage.Open(str(out))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert not UsdValidation.ValidationContext(validators).Validate(stage)
    tree = {
        coarse.GetDisplayName() or coarse.GetName(): [part.GetName() for part in coarse.GetChildren()]
        for coarse in stage.GetDefaultPrim().GetChildren()
    }
    assert tree == {"#1414b4": ["left", "right"], "#c81e1e": ["bar"]}
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    faces = sum(len(mesh.GetFaceVertexCountsAttr().Get()) for mesh in meshes)
    assert faces == len(load_shape(path).input_faces)


def test_copies_have_labels_of_their_own_where_that_is_asked_for(tmp_path: Path) -> None:
    leg = Part(Box((1, 1, 1)), (-2, 0, 0), name="leg", instances=(Similarity(translation=(4, 0, 0)),))
    Assembly((leg,)).save(tmp_path / "a.json")
    pair = [trimesh.creation.box((1, 1, 1)).apply_translation((x, 0, 0)) for x in (-2, 2)]
    trimesh.util.concatenate(pair).export(tmp_path / "pair.stl")
    words = ["segment", str(tmp_path / "pair.stl"), str(tmp_path / "a.json"), "-o", str(tmp_path / "out.ply")]
    for more, names in (([], {0}), (["--copies"], {0, 1})):
        assert main([*words, *more]) == 0
        assert set(json.loads(labels_path(tmp_path / "out.ply").read_text())["labels"]) == names


def test_files_without_such_labels_are_told(tmp_path: Path) -> None:
    path, _ = painted(tmp_path / "shape.ply")
    shape = load_shape(path)
    with pytest.raises(LabelError, match="no property 'label'; they have vertex_indices, red"):
        property_labels(path, "label", len(shape.input_faces))
    with pytest.raises(LabelError, match="faces have the property 'red', and 5 triangles"):
        property_labels(path, "red", 5)
    with pytest.raises(LabelError, match="only PLY"):
        property_labels(tmp_path / "a.stl", "label", 5)
    trimesh.creation.icosphere(2).export(tmp_path / "plain.stl")
    with pytest.raises(NoColoursError):
        colour_labels(tmp_path / "plain.stl", load_shape(tmp_path / "plain.stl"))
    many = trimesh.creation.icosphere(3)
    many.visual.face_colors = np.random.default_rng(0).integers(0, 255, (len(many.faces), 4))
    many.export(tmp_path / "many.ply")
    with pytest.raises(LabelError, match=r"1,\d+ colours; expected one colour a label, at most 256"):
        colour_labels(tmp_path / "many.ply", load_shape(tmp_path / "many.ply"))
