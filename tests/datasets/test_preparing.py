"""Prepared families hold what their shapes are: distances, nearest parts and poses against known solids."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.cli.main import main
from partwright.datasets import PreparedFamily, prepare
from partwright.datasets.preparing import Preparation, splits
from partwright.errors import FamilyError, OutputError, SettingError
from partwright.fields import Box, Sphere

SAMPLES = 3000
UNREAD = "of a format that is not read; export as GLB or STEP"
FOOT, HEAD = (1.0, 0.6, 0.4), 0.5


def parts_of(wide: float) -> dict[str, trimesh.Trimesh]:
    """A box from z = -0.4 to 0.4 and a ball above it; the box grows with `wide`. They do not touch."""
    foot = trimesh.creation.box((2 * FOOT[0] * wide, 2 * FOOT[1], 2 * FOOT[2]))
    head = trimesh.creation.icosphere(3, HEAD)
    head.apply_translation((0, 0, 1.2))
    return {"foot": foot, "head": head}


def folders_of_parts(root: Path, count: int = 3) -> Path:
    for number in range(count):
        folder = root / f"thing_{number}"
        folder.mkdir(parents=True)
        for name, mesh in parts_of(1 + 0.1 * number).items():
            mesh.export(folder / f"{name}.ply")
    return root


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Preparation:
    root = tmp_path_factory.mktemp("things")
    return prepare(folders_of_parts(root / "in"), root / "out", samples=SAMPLES, workers=1)


def test_distance_and_nearest_part_are_those_of_the_solids(made: Preparation) -> None:
    family = made.family
    assert made.refused == ()
    assert family.up == "z"  # PLY files do not say
    assert family.parts == ("foot", "head")
    for index in range(len(family)):
        shape = family.load(index)
        wide = 1 + 0.1 * index
        points = shape.frame.from_unit(shape.points).astype(np.float32)
        foot = Box(size=(2 * FOOT[0] * wide, 2 * FOOT[1], 2 * FOOT[2]))(points)
        head = Sphere(radius=HEAD)(points - np.array([0, 0, 1.2], np.float32))
        each = np.stack([foot, head]) * shape.frame.scale
        np.testing.assert_allclose(shape.sdf, each.min(axis=0), atol=6e-3)  # the ball has facets
        clear = np.abs(np.abs(each[0]) - np.abs(each[1])) > 1.2e-2
        np.testing.assert_array_equal(shape.part[clear], np.abs(each).argmin(axis=0)[clear])


def test_samples_lie_where_the_paper_has_them(made: Preparation) -> None:
    shape = made.family.load(0)
    assert len(shape.points) == SAMPLES
    away = np.abs(shape.sdf)
    assert 0.25 < np.mean(away < 0.0224) < 0.6  # most of the finer half, some of the coarser
    assert np.mean(np.abs(shape.points).max(axis=1) > 1.5) == 0
    first = shape.points[: SAMPLES // 4]  # any run is a fair subset
    np.testing.assert_allclose(first.mean(axis=0), shape.points.mean(axis=0), atol=0.06)


def test_the_surface_is_whole_labelled_and_in_the_unit_frame(made: Preparation) -> None:
    shape = made.family.load(0)
    mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
    assert mesh.is_watertight
    np.testing.assert_allclose(mesh.extents.max(), 1.8, rtol=1e-6)
    np.testing.assert_array_equal(shape.label, (mesh.triangles_center[:, 2] > 0).astype(np.int8))


def test_poses_are_the_solids_own_and_agree(made: Preparation) -> None:
    family = made.family
    for index in range(len(family)):
        shape = family.load(index)
        half = np.array([FOOT[0] * (1 + 0.1 * index), FOOT[1], FOOT[2]]) * shape.frame.scale
        np.testing.assert_allclose(shape.scale[0], half, rtol=0.06)  # the same axis first, in all of them
        assert abs(shape.rotation[0, 0]) > np.cos(np.radians(3))
        centre = shape.frame.to_unit([[0, 0, 0], [0, 0, 1.2]])
        np.testing.assert_allclose(shape.translation, centre, atol=0.02)


def test_two_processes_write_the_same_bytes_as_one(made: Preparation, tmp_path: Path) -> None:
    source = folders_of_parts(tmp_path / "in")
    again = prepare(source, tmp_path / "out", samples=SAMPLES, workers=2).family
    assert [entry.hash for entry in again.shapes] == [entry.hash for entry in made.family.shapes]


def test_a_stopped_run_goes_on_and_ends_in_the_same_bytes(made: Preparation, tmp_path: Path) -> None:
    source, output = folders_of_parts(tmp_path / "in"), tmp_path / "out"

    def stop(step: object) -> None:
        if getattr(step, "done") == 2:  # noqa: B009
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        prepare(source, output, samples=SAMPLES, workers=1, progress=stop)
    assert not (output / "family.json").exists()
    files = sorted((output / "shapes").iterdir())
    assert [file.name for file in files] == ["thing_0.safetensors", "thing_1.safetensors"]
    files[1].write_bytes(files[1].read_bytes()[:1000])  # as if cut short
    family = prepare(source, output, samples=SAMPLES, workers=1).family
    assert [entry.hash for entry in family.shapes] == [entry.hash for entry in made.family.shapes]


def test_what_is_done_is_not_done_again(tmp_path: Path) -> None:
    source, output = folders_of_parts(tmp_path / "in", 2), tmp_path / "out"
    prepare(source, output, samples=SAMPLES, workers=1)
    before = PreparedFamily(output).load(0)
    parts_of(1.5)["foot"].export(source / "thing_1" / "foot.ply")
    prepare(source, output, samples=SAMPLES, workers=1)
    after = PreparedFamily(output).load(0)
    np.testing.assert_array_equal(before.points, after.points)
    more = prepare(source, output, samples=2 * SAMPLES, workers=1).family.load(0)
    assert len(more.points) == 2 * SAMPLES


def test_the_axis_that_points_up_is_what_the_files_say_unless_it_is_stated(tmp_path: Path) -> None:
    source = tmp_path / "in"
    source.mkdir()
    for number in range(2):
        scene = trimesh.Scene()
        for name, mesh in parts_of(1 + 0.1 * number).items():
            scene.add_geometry(mesh, node_name=name, geom_name=name)
        scene.export(source / f"thing_{number}.glb")
    output = tmp_path / "out"
    assert prepare(source, output, samples=1000, workers=1).family.up == "y"
    assert prepare(source, output, samples=1000, workers=1).family.up == "y"  # of what was done before
    assert prepare(source, output, samples=1000, workers=1, up="Z").family.up == "z"


def test_scenes_and_labelled_meshes_are_read_too(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    for number in range(2):
        parts = parts_of(1 + 0.2 * number)
        scene = trimesh.Scene()
        for name, mesh in parts.items():
            scene.add_geometry(mesh, node_name=name, geom_name=name)
        scene.export(folder / f"scene_{number}.glb")
        whole = trimesh.util.concatenate(list(parts.values()))
        whole.export(folder / f"labelled_{number}.ply")
        labels = np.repeat([0, 1], [len(mesh.faces) for mesh in parts.values()])
        about = {"labels": labels.tolist(), "names": ["foot", "head"]}
        (folder / f"labelled_{number}.ply.labels.json").write_text(json.dumps(about))
    family = prepare(folder, tmp_path / "out", samples=SAMPLES, workers=1).family
    assert [entry.name for entry in family.shapes] == ["labelled_0", "labelled_1", "scene_0", "scene_1"]
    assert family.parts == ("foot", "head")
    by_label, by_scene = family.load(1), family.load(3)
    np.testing.assert_allclose(by_label.scale, by_scene.scale, rtol=0.05)
    for shape in (by_label, by_scene):
        assert shape.present.tolist() == [1, 1]


def test_one_piece_without_a_name_among_shapes_of_parts_is_left_out(tmp_path: Path) -> None:
    """A reader names it after its file, which would be a part of its own to the whole family."""
    source = folders_of_parts(tmp_path / "in", 2)
    parts_of(1)["foot"].export(source / "forgotten.ply")
    made = prepare(source, tmp_path / "out", samples=SAMPLES, workers=1)
    assert [(one.name, one.reason[:30]) for one in made.refused] == [
        ("forgotten", "is one piece without a name; n")
    ]
    assert made.family.parts == ("foot", "head")


@pytest.mark.parametrize("kind", ["file", "folder"])
def test_a_shape_of_one_part_may_be_called_after_it(tmp_path: Path, kind: str) -> None:
    source = folders_of_parts(tmp_path / "in", 2)
    foot = parts_of(1)["foot"]
    if kind == "file":
        scene = trimesh.Scene()
        scene.add_geometry(foot, node_name="foot", geom_name="foot")
        scene.export(source / "foot.glb")
    else:
        (source / "foot").mkdir()
        foot.export(source / "foot" / "foot.ply")
    made = prepare(source, tmp_path / "out", samples=SAMPLES, workers=1)
    assert made.refused == ()
    assert [entry.name for entry in made.family.shapes] == ["foot", "thing_0", "thing_1"]
    assert made.family.load(0).present.tolist() == [1, 0]


def test_products_of_a_step_file_are_its_parts(tmp_path: Path) -> None:
    """Beside the same shape as meshes: their poses agree."""
    pytest.importorskip("OCP")
    source = folders_of_parts(tmp_path / "in", 1)
    foot = pw.Part(Box(size=(2 * FOOT[0], 2 * FOOT[1], 2 * FOOT[2])), name="foot")
    head = pw.Part(Sphere(radius=HEAD), translation=(0, 0, 1.2), name="head")
    pw.export(pw.Assembly((head, foot), unit="mm"), source / "exact.STP", separate=True)
    made = prepare(source, tmp_path / "out", samples=SAMPLES, workers=1)
    assert made.refused == ()
    assert [entry.name for entry in made.family.shapes] == ["exact", "thing_0"]
    assert set(made.family.parts) == {"foot", "head"}
    exact, meshes = made.family.load(0), made.family.load(1)
    assert exact.present.tolist() == [1, 1]
    np.testing.assert_allclose(exact.scale, meshes.scale, rtol=0.05)
    np.testing.assert_allclose(exact.translation, meshes.translation, atol=0.02)


def test_parts_in_a_shapes_folder_may_be_step_files(tmp_path: Path) -> None:
    """But not beside meshes: those were made of them, of each or of all in one."""
    pytest.importorskip("OCP")
    source = folders_of_parts(tmp_path / "in", 2)
    foot = pw.Part(Box(size=(2 * FOOT[0], 2 * FOOT[1], 2 * FOOT[2])), name="foot")
    for mesh in (source / "thing_0").glob("*.ply"):
        mesh.unlink()
    for name in ("thing_0/foot.step", "thing_1/foot.step", "thing_1/thing.step"):
        pw.export(pw.Assembly((foot,), unit="mm"), source / name)
    made = prepare(source, tmp_path / "out", samples=SAMPLES, workers=1)
    assert made.refused == ()
    assert made.family.parts == ("foot", "head")
    exact = made.family.load(0)
    assert exact.present.tolist() == [1, 0]
    np.testing.assert_allclose(
        np.sort(exact.scale[0]) / exact.scale[0].max(), np.sort(FOOT) / max(FOOT), atol=0.05
    )


def test_files_that_are_not_read_are_named_in_one_line(tmp_path: Path) -> None:
    """But for those that a shape has been exported from."""
    source = folders_of_parts(tmp_path / "in", 2)
    for name in ("thing_0.blend", "b.blend", "a.FBX", "notes.txt", *(f"c{i}.igs" for i in range(4))):
        (source / name).write_bytes(b"")
    made = prepare(source, tmp_path / "out", samples=SAMPLES, workers=1)
    assert [(one.name, one.reason) for one in made.refused] == [
        ("a.FBX, b.blend, c0.igs, c1.igs, c2.igs and 1 more", UNREAD)
    ]
    (source / "thing_0" / "arm.blend").write_bytes(b"")
    part = next(file.stem for file in (source / "thing_0").glob("*.*") if file.stem not in ("_whole", "arm"))
    (source / "thing_0" / f"{part}.blend").write_bytes(b"")  # of which the mesh beside it was made
    (told,) = prepare(source, tmp_path / "again", samples=SAMPLES, workers=1).refused
    assert told.name == "a.FBX, b.blend, c0.igs, c1.igs, c2.igs and 2 more"
    for file in [*source.glob("*.FBX"), *source.glob("*.blend"), *source.glob("*.igs")]:
        file.unlink()
    (told,) = prepare(source, tmp_path / "third", samples=SAMPLES, workers=1).refused
    assert (told.name, told.reason) == ("thing_0/arm.blend", UNREAD)
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / "chair.blend").write_bytes(b"")
    with pytest.raises(FamilyError, match=f"holds no shapes; .*; chair.blend {UNREAD}"):
        prepare(tmp_path / "none", tmp_path / "out")


def test_open_parts_of_a_closed_whole_are_told_apart(tmp_path: Path) -> None:
    """A closed box cut in two open halves: distances are those of the box, parts those of the halves."""
    for number in range(2):
        whole = trimesh.creation.box((2 + 0.2 * number, 1, 1)).subdivide().subdivide()
        right = whole.triangles_center[:, 0] > 0
        folder = tmp_path / "in" / f"box_{number}"
        folder.mkdir(parents=True)
        for name, faces in (("left", whole.faces[~right]), ("right", whole.faces[right])):
            trimesh.Trimesh(whole.vertices, faces, process=False).export(folder / f"{name}.ply")
    shape = prepare(tmp_path / "in", tmp_path / "out", samples=SAMPLES, workers=1).family.load(0)
    points = shape.frame.from_unit(shape.points).astype(np.float32)
    expected = Box(size=(2, 1, 1))(points) * shape.frame.scale
    np.testing.assert_allclose(shape.sdf, expected, atol=1e-5)
    clear = np.abs(points[:, 0]) > 0.05
    np.testing.assert_array_equal(shape.part[clear], (points[clear, 0] > 0).astype(np.int8))


def test_overlapping_parts_label_only_what_is_seen(tmp_path: Path) -> None:
    """A rod that reaches far into a block: points in the block near the hidden end belong to the block."""
    for number in range(2):
        folder = tmp_path / "in" / f"lolly_{number}"
        folder.mkdir(parents=True)
        trimesh.creation.box((1, 1, 1 + 0.1 * number)).export(folder / "block.ply")
        rod = trimesh.creation.box((0.2, 0.2, 1.4))
        rod.apply_translation((0, 0, 0.8))  # from 0.1 to 1.5
        rod.export(folder / "rod.ply")
    shape = prepare(tmp_path / "in", tmp_path / "out", samples=SAMPLES, workers=1).family.load(0)
    points = shape.frame.from_unit(shape.points)
    hidden = (np.abs(points[:, :2]) < 0.15).all(axis=1) & (points[:, 2] < 0.2) & (points[:, 2] > -0.4)
    assert hidden.any()
    assert (shape.part[hidden] == 0).all()
    beside = (np.abs(points[:, :2]) < 0.3).all(axis=1) & (points[:, 2] > 1.0)
    assert (shape.part[beside] == 1).all()


def test_a_missing_part_has_the_average_pose(tmp_path: Path) -> None:
    source = folders_of_parts(tmp_path / "in", 3)
    (source / "thing_2" / "head.ply").unlink()
    family = prepare(source, tmp_path / "out", samples=SAMPLES, workers=1).family
    shape = family.load(2)
    assert shape.present.tolist() == [1, 0]
    np.testing.assert_allclose(shape.translation[1], family.average_pose.translation[1])
    np.testing.assert_allclose(shape.scale[1], family.average_pose.scale[1])
    assert (shape.part == 0).all()


def test_unusable_shapes_are_left_out_by_name(tmp_path: Path) -> None:
    source = folders_of_parts(tmp_path / "in", 8)
    nan = parts_of(1)["head"]
    nan.vertices[0] = np.nan
    nan.export(source / "thing_1" / "head.ply")
    trimesh.PointCloud(np.random.default_rng(0).normal(size=(500, 3))).export(source / "thing_2" / "head.ply")
    (source / "thing_3" / "head.ply").write_bytes(b"ply\n")
    hidden = trimesh.creation.box((0.1, 0.1, 0.1))
    hidden.export(source / "thing_4" / "head.ply")
    parts_of(1)["head"].export(source / "thing_5" / "hat.ply")
    whole = trimesh.creation.box((9, 9, 9))
    whole.export(source / "thing_6" / "_whole.ply")
    parts_of(1.2)["foot"].export(source / "labelled.ply")
    (source / "labelled.ply.labels.json").write_text(json.dumps(["foot"] * 11))
    sheet = [[-1, 0, 2], [1, 0, 2], [1, 0, 3], [-1, 0, 3]]
    trimesh.Trimesh(sheet, [[0, 1, 2], [0, 2, 3]]).export(source / "thing_7" / "head.ply")
    folders_of_parts(tmp_path / "in" / "more", 1)
    (source / "more" / "thing_0").rename(source / "thing_8")
    made = prepare(source, tmp_path / "out", samples=SAMPLES, parts=("foot", "head"), workers=1)
    reasons = {shape.name: shape.reason for shape in made.refused}
    assert [entry.name for entry in made.family.shapes] == ["thing_0", "thing_8"]
    assert "part 'head' has NaN" in reasons["thing_1"]
    assert "no faces" in reasons["thing_2"] or "surface" in reasons["thing_2"]
    assert "head.ply: cannot be read" in reasons["thing_3"]
    assert "head lies wholly inside the other parts" in reasons["thing_4"]
    assert "has hat, which the family has not" in reasons["thing_5"]
    assert "off all parts" in reasons["thing_6"]
    assert "head is an open surface that bounds nothing" in reasons["thing_7"]
    assert "11 labels for the 12 faces" in reasons["labelled"]


@pytest.mark.parametrize(
    ("count", "options", "message"),
    [
        (1, {}, "1 usable shape; a family needs at least two"),
        (2, {"parts": ("foot", "tail")}, "no shape has tail; the shapes' parts are foot, head"),
        (2, {"held_out": ("thing_9",)}, "no usable shape is called thing_9"),
    ],
)
def test_families_that_cannot_be(tmp_path: Path, count: int, options: dict[str, tuple], message: str) -> None:
    source = folders_of_parts(tmp_path / "in", count)
    with pytest.raises(FamilyError, match=message):
        prepare(source, tmp_path / "out", samples=SAMPLES, workers=1, **options)
    assert not (tmp_path / "out").exists()


def test_impossible_places_and_numbers(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "file").write_text("")
    with pytest.raises(FamilyError, match="holds no shapes"):
        prepare(tmp_path / "empty", tmp_path / "out")
    with pytest.raises(FamilyError, match="neither a folder nor one of mixers, chairs, cars, vehicles"):
        prepare(tmp_path / "nowhere", tmp_path / "out")
    with pytest.raises(SettingError, match="10 samples"):
        prepare("chairs", tmp_path / "out", samples=10)
    with pytest.raises(OutputError, match="is a file"):
        prepare("chairs", tmp_path / "file", count=2)


def test_splits_have_the_papers_shares_and_do_not_mind_the_order() -> None:
    names = [f"shape_{number}" for number in range(50)]
    split = splits(names, (), seed=3)
    assert sorted(split.values()).count("train") == 30
    assert sorted(split.values()).count("test") == 10
    assert split == splits(names[::-1], (), seed=3)
    assert split != splits(names, (), seed=4)
    assert set(splits(["a", "b"], (), 0).values()) >= {"train", "test"}
    assert splits(names[:3], ["shape_1"], 0) == {"shape_0": "train", "shape_1": "test", "shape_2": "train"}


def test_the_command_prepares_and_says_what_it_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = folders_of_parts(tmp_path / "in", 3)
    (source / "thing_1" / "head.ply").write_bytes(b"nothing")
    arguments = ["parts", "prepare", str(source), "-o", str(tmp_path / "out"), "--samples", str(SAMPLES)]
    assert main([*arguments, "--workers", "1", "--test", "thing_2"]) == 0
    output = capsys.readouterr()
    assert "2 shapes of 2 parts (1 train, 0 validation, 1 test)" in output.out
    assert "warning: thing_1, left out: " in output.err
    assert main([*arguments, "--parts", "foot,tail"]) == 2
    assert "no shape has tail" in capsys.readouterr().err


def test_a_made_family_is_prepared_by_name(tmp_path: Path) -> None:
    family = prepare("mixers", tmp_path, count=2, samples=SAMPLES, workers=1).family
    assert family.parts == ("tube", "helix", "attach_left", "attach_right")
    shape = family.load(0)
    assert np.bincount(shape.part, minlength=4).min() > 20
    assert np.linalg.norm(shape.rotation, axis=1) == pytest.approx(1)
