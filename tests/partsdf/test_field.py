"""Neural parts in an assembly: one pass, the same file back, edits that the other parts hear of, exports."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh

import partwright as pw
from partwright.assembly import Similarity
from partwright.errors import AssemblyFileError, ModelError, NoSurfaceError
from partwright.meshing import lean_part, mesh_assembly, mesh_part
from partwright.partsdf import model as models
from partwright.partsdf.assemblies import from_assembly, remember_meshes, to_assembly
from partwright.partsdf.field import NeuralField
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.shapes import UnitFrame
from tests.counting import points_asked
from tests.partsdf.lamps import exact_distances

FRAME = UnitFrame((10.0, 20.0, 30.0), 0.5)
POINTS = np.random.default_rng(1).uniform(-0.9, 0.9, (300, 3)).astype(np.float32)


@pytest.fixture(scope="module")
def lamp(model: Model) -> NeuralShape:
    return NeuralShape.trained(model, "lamp1")


@pytest.fixture(scope="module")
def assembly(lamp: NeuralShape) -> pw.Assembly:
    return to_assembly(lamp, FRAME, unit="mm", source="lamp1")


def test_distances_are_the_shapes_in_own_units(lamp: NeuralShape, assembly: pw.Assembly) -> None:
    own = FRAME.from_unit(POINTS)
    expected = 2.0 * lamp.part_distances(POINTS)
    np.testing.assert_allclose(assembly.part_distances(own), expected, atol=2e-5)
    np.testing.assert_allclose(assembly.distance(own), expected.min(axis=0), atol=2e-5)
    tensor = torch.tensor(own, requires_grad=True)
    np.testing.assert_allclose(assembly.distance(tensor).detach(), expected.min(axis=0), atol=2e-5)


def test_all_parts_are_meshed_in_one_pass_each_in_its_own_frame(
    lamp: NeuralShape, monkeypatch: pytest.MonkeyPatch
) -> None:
    fresh = to_assembly(lamp, FRAME, unit="mm", source="lamp1")
    asked = points_asked(monkeypatch, NeuralShape, "part_distances")
    meshes, counts = [], []
    for part in fresh.parts:
        asked.clear()
        meshes.append(mesh_part(part, 24))
        counts.append(sum(asked))
    assert counts[0] > 1000
    assert counts[1:] == [0] * (len(meshes) - 1)
    for part, mesh in zip(fresh.parts, meshes, strict=True):
        assert mesh.is_watertight
        cell, vertices = 2 * part.field.unit / 96, np.asarray(mesh.vertices)
        within = (np.abs(FRAME.to_unit(vertices)) < 1).all(axis=1)  # the lattice's end cuts what goes on
        assert within.mean() > 0.3
        assert np.abs(part.distance(vertices[within])).max() < cell
    first = fresh.parts[0]
    blended = fresh.replace_part(first.name, dataclasses.replace(first, blend=0.1))
    asked.clear()
    mesh_part(blended.parts[0], 24)
    assert not asked  # the same shape
    beside = dataclasses.replace(first, translation=(*first.translation[:2], first.translation[2] + 0.05))
    moved = fresh.replace_part(first.name, beside)
    mesh_part(moved.parts[0], 24)
    assert sum(asked) > 1000  # another shape: nothing of the first is taken for it


def test_files_take_the_meshes_that_came_with_the_whole(
    lamp: NeuralShape, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assembly, surfaces = to_assembly(lamp, FRAME, unit="mm"), mesh_shape(lamp)
    plain = full_counts(assembly)
    again = to_assembly(lamp, FRAME, unit="mm")
    remember_meshes(again, surfaces)
    renamed = dataclasses.replace(again, name="renamed", metadata={"source": "lamp"})
    monkeypatch.setattr("partwright.partsdf.field.mesh_shape", None)
    remembered = export_counts(renamed, tmp_path / "remembered.glb")
    assert remembered == {part.name: len(lean_part(part, 32).faces) for part in renamed.parts}
    assert full_counts(renamed) == {name: len(mesh.faces) for name, mesh in surfaces.parts.items()}
    assert full_counts(renamed) == pytest.approx(plain, rel=0.01)  # as fine as without


def full_counts(assembly: pw.Assembly) -> dict[str, int]:
    """Triangles of each part, those that files do without among them, at as many cells as in a GLB."""
    return {part.name: len(mesh_part(part, 32).faces) for part in assembly.parts}


def export_counts(assembly: pw.Assembly, file: Path) -> dict[str, int]:
    """Triangles of each part in a GLB."""
    pw.export(assembly, file)
    scene = trimesh.load_scene(file)
    return {name: len(scene.geometry[scene.graph[name][1]].faces) for name in scene.graph.nodes_geometry}


def test_all_parts_are_decoded_in_one_pass(assembly: pw.Assembly, monkeypatch: pytest.MonkeyPatch) -> None:
    assembly.distance(np.zeros((1, 3)))  # its bounds are known then
    asked = points_asked(monkeypatch, NeuralShape, "part_distances")
    assembly.distance(FRAME.from_unit(POINTS))
    assert asked == [len(POINTS)]


def test_turning_scaling_and_moving_moves_the_surface_along(assembly: pw.Assembly) -> None:
    turn = Similarity(3.0, (math.cos(0.4), 0.0, math.sin(0.4), 0.0), (1.0, -2.0, 5.0))
    own = FRAME.from_unit(POINTS)
    np.testing.assert_allclose(
        assembly.transformed(turn).distance(turn(own)), 3 * assembly.distance(own), atol=2e-4
    )


def test_a_file_comes_back_to_the_byte(assembly: pw.Assembly, tmp_path: Path) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    assembly.save(tmp_path / "a.json")
    again = pw.load_assembly(tmp_path / "a.json")
    assert again == assembly
    again.save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    own = FRAME.from_unit(POINTS)
    np.testing.assert_array_equal(again.distance(own), assembly.distance(own))
    schema = json.loads((Path(__file__).parents[2] / "docs" / "assembly.schema.json").read_text())
    jsonschema.validate(json.loads((tmp_path / "a.json").read_text()), schema)


def test_opening_needs_the_model(
    assembly: pw.Assembly, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assembly.save(tmp_path / "a.json")
    monkeypatch.setattr(models, "_loaded", {})
    with pytest.raises(ModelError, match=r"need the model 'lamps' with hash [0-9a-f]{12}, which is not here"):
        pw.load_assembly(tmp_path / "a.json")


def test_a_model_is_found_in_a_folder_of_its_name_where_the_command_is_run(
    assembly: pw.Assembly, model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assembly.save(tmp_path / "a.json")
    folder = tmp_path / "models" / "lamps"
    folder.mkdir(parents=True)
    (folder / "model.safetensors").write_bytes(model.to_bytes())
    for known in ("_loaded", "_files"):  # whoever comes later is not to look in this folder
        monkeypatch.setattr(models, known, {})
    monkeypatch.chdir(tmp_path)
    assert pw.load_assembly("a.json").parts[0].field.hash == model.hash  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("part", "handle", "lamps has no part 'handle'"),
        ("latent", [0.0], "latent: expected 8 numbers, got 1"),
        ("latent", [0.0] * 7 + ["x"], "latent holds 'x'"),
        ("half_lengths", [1, 1, 0], "half_lengths"),
        ("unit", -1, "unit is -1"),
        ("members", [], "unknown parameters"),
    ],
)
def test_broken_files_are_refused_by_place(
    assembly: pw.Assembly, tmp_path: Path, key: str, value: object, message: str
) -> None:
    assembly.save(tmp_path / "a.json")
    data = json.loads((tmp_path / "a.json").read_text())
    data["children"][1]["field"][key] = value
    (tmp_path / "a.json").write_text(json.dumps(data))
    with pytest.raises(AssemblyFileError, match=message):
        pw.load_assembly(tmp_path / "a.json")


def test_the_others_hear_of_an_edit_of_the_assembly(lamp: NeuralShape, assembly: pw.Assembly) -> None:
    from partwright.partsdf.editing import moved

    ball = assembly["ball"]
    shifted = assembly.replace_part("ball", ball.translated((0.4, 0.0, 0.0)))
    expected = 2.0 * moved(lamp, "ball", (0.2, 0, 0)).part_distances(POINTS)
    own = FRAME.from_unit(POINTS)
    np.testing.assert_allclose(shifted.part_distances(own), expected, atol=2e-5)
    plate = assembly.part_distances(own)[0]
    assert np.abs(shifted.part_distances(own)[0] - plate).max() > 1e-3


def test_dropping_a_part_is_as_if_it_were_absent(lamp: NeuralShape, assembly: pw.Assembly) -> None:
    from partwright.partsdf.editing import without

    own = FRAME.from_unit(POINTS)
    expected = 2.0 * without(lamp, "knob").part_distances(POINTS)
    np.testing.assert_allclose(assembly.without("knob").part_distances(own), expected, atol=2e-5)


def test_two_shapes_in_one_assembly_stay_apart(model: Model, assembly: pw.Assembly) -> None:
    other = to_assembly(NeuralShape.trained(model, "lamp2"), FRAME).translated((4.0, 0.0, 0.0))
    both = pw.Assembly((*assembly.children, *other.children))
    assert len(both) == 5
    own = FRAME.from_unit(POINTS)
    expected = np.concatenate([assembly.part_distances(own), other.part_distances(own)])
    np.testing.assert_allclose(both.part_distances(own), expected, atol=1e-4)


def test_there_and_back_again(lamp: NeuralShape, assembly: pw.Assembly) -> None:
    again, frame, _ = from_assembly(assembly)
    np.testing.assert_allclose(frame.centre, FRAME.centre, atol=1e-9)
    assert frame.scale == pytest.approx(FRAME.scale)
    np.testing.assert_allclose(again.part_distances(POINTS), lamp.part_distances(POINTS), atol=1e-5)
    dropped, frame, _ = from_assembly(assembly.without("plate"))
    assert dropped.names() == ["ball", "knob"]
    np.testing.assert_allclose(frame.centre, FRAME.centre, atol=1e-9)


def test_meshes_are_closed_and_lie_where_the_parts_are(assembly: pw.Assembly) -> None:
    whole = mesh_assembly(assembly, 48)
    cell = np.ptp(assembly.bounds(), axis=0).max() / 48
    assert whole.is_watertight
    assert np.abs(assembly.distance(whole.vertices)).max() < cell
    ball = mesh_part(assembly["ball"], 24)
    assert ball.is_watertight
    # All of the ball is in the bounds, and those are not far from it.
    lower, upper = assembly["ball"].bounds()
    assert (ball.vertices.min(axis=0) > lower).all()
    assert (ball.vertices.max(axis=0) < upper).all()
    assert (upper - lower).max() < 1.6 * np.ptp(ball.vertices, axis=0).max()


def test_a_tree_in_words_names_the_model_and_leaves_the_latent_out(
    lamp: NeuralShape, assembly: pw.Assembly
) -> None:
    lines = assembly.describe().splitlines()
    assert len(lines) == 1 + 3
    start = (
        f"ball: neural model lamps, hash {lamp.model.hash[:12]}..., part ball, latent of 8 numbers, half_len"
    )
    assert start in lines[2]
    assert "at (" in lines[2]


def test_exports(assembly: pw.Assembly, tmp_path: Path) -> None:
    pw.export(assembly, tmp_path / "lamp.glb")
    scene = trimesh.load(tmp_path / "lamp.glb")
    assert {"plate", "ball", "knob"} <= set(scene.geometry)
    pw.export(assembly, tmp_path / "lamp.stl", resolution=32)
    assert trimesh.load(tmp_path / "lamp.stl").is_volume


def test_a_field_alone_is_as_its_model_knows_it(model: Model, assembly: pw.Assembly) -> None:
    field = assembly["ball"].field
    assert isinstance(field, NeuralField)
    alone = dataclasses.replace(field, members=())
    assert alone.shape.names() == ["ball"]
    twice = alone.scaled(2.0)
    local = np.random.default_rng(0).uniform(-1, 1, (50, 3)).astype(np.float32)
    np.testing.assert_allclose(twice(2 * local), 2 * alone(local), atol=1e-5)


def test_walls_are_as_thin_as_the_parts_are(lamp: NeuralShape, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of exact distances: the sampled depth that one in twenty places inside exceeds is known."""
    monkeypatch.setattr(NeuralShape, "part_distances", exact_distances)
    half, ball, knob = lamp.poses.scale.numpy()
    plate, *balls = dataclasses.replace(lamp).walls
    assert plate == pytest.approx(2 * half.min(), rel=0.1)
    assert balls == pytest.approx([2 * (1 - 0.05 ** (1 / 3)) * r for r in (ball[0], knob[0])], rel=0.06)
    fields = [part.field for part in to_assembly(lamp, FRAME).parts]
    assert [field.wall for field in fields] == pytest.approx([2 * plate, *(2 * b for b in balls)], rel=0.02)


def test_a_wall_with_a_flange_is_as_thin_as_the_wall(
    lamp: NeuralShape, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four thick corners are a quarter of the inside: by the deepest places the wall between them would be
    meshed with holes."""
    half = lamp.poses.scale.numpy()[0]
    middle = lamp.poses.translation.numpy()[0]
    thin = half[2] / 6

    def flanged(shape: NeuralShape, points: np.ndarray) -> np.ndarray:
        away = np.abs(points - middle)
        wall = away[:, 2] - thin
        corner = np.maximum(0.8 * half[0] - away[:, 0], 0.8 * half[1] - away[:, 1])
        flange = np.maximum(away[:, 2] - half[2], corner)
        return np.tile(np.minimum(wall, flange), (3, 1))

    monkeypatch.setattr(NeuralShape, "part_distances", flanged)
    assert dataclasses.replace(lamp).walls[0] == pytest.approx(2 * thin, rel=0.35)


def test_a_part_that_is_nowhere_has_no_wall_and_no_surface(
    lamp: NeuralShape, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = to_assembly(lamp, FRAME).parts[0]
    monkeypatch.setattr(NeuralShape, "part_distances", lambda shape, points: np.ones((3, len(points))))
    assert np.isinf(dataclasses.replace(lamp).walls).all()
    with pytest.raises(NoSurfaceError, match=r"part plate of .* has no surface"):
        mesh_part(part)


def test_the_whole_is_meshed_by_its_model_at_few_points(
    lamp: NeuralShape, assembly: pw.Assembly, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same surface as of any assembly, turned and with a part dropped, too; blends go the usual way."""
    from partwright.meshing import assemblies

    turn = Similarity(2.0, (math.cos(0.4), 0.0, math.sin(0.4), 0.0), (1.0, -2.0, 5.0))
    asked = points_asked(monkeypatch, NeuralShape, "part_distances")
    for one in (assembly, assembly.without("knob").transformed(turn)):
        one.bounds()
        asked.clear()
        own = mesh_assembly(one, 48)
        quick = sum(asked)
        asked.clear()
        with monkeypatch.context() as usual:
            usual.setattr(assemblies, "_learned", lambda *_: None)
            marched = mesh_assembly(one, 48)
        assert own.is_watertight
        assert own.volume == pytest.approx(marched.volume, rel=0.04)
        np.testing.assert_allclose(own.bounds, marched.bounds, atol=0.03 * np.ptp(marched.bounds))
        assert quick < 0.6 * sum(asked)
    ball = dataclasses.replace(assembly["ball"], blend=0.5)
    assert mesh_assembly(assembly.replace_part("ball", ball), 48).volume > mesh_assembly(assembly, 48).volume
