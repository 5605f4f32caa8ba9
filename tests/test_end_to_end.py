"""From a file to an assembly and back from its files, through the public names and as a user's process."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.fitting import FILES, Result

CENTRE = np.array([100.0, -40.0, 7.0])


def table() -> trimesh.Trimesh:
    """A top and four legs, 200 mm long, away from the origin."""
    boxes = [trimesh.creation.box((200, 120, 15)).apply_translation((0, 0, 100))]
    for x, y in ((-85, -50), (-85, 50), (85, -50), (85, 50)):
        boxes.append(trimesh.creation.box((15, 15, 105)).apply_translation((x, y, 50)))
    return trimesh.boolean.union(boxes, engine="manifold").apply_translation(CENTRE)


@pytest.fixture(scope="module", autouse=True)
def small_previews() -> None:
    """As large as a user's."""


@pytest.fixture(scope="module")
def shape(tmp_path_factory: pytest.TempPathFactory) -> pw.Shape:
    path = tmp_path_factory.mktemp("input") / "table.stl"
    table().export(path)
    return pw.load_shape(path, unit="mm", up="z")


@pytest.fixture(scope="module")
def result(shape: pw.Shape) -> Result:
    return pw.fit(shape, quality="draft", threads=1)


@pytest.fixture(scope="module")
def folder(result: Result, tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("output") / "table-parts"
    result.save(made)
    return made


def test_the_result_is_good_and_says_so(result: Result, shape: pw.Shape) -> None:
    assert len(result.assembly) <= 7
    assert result.scores.iou > 0.97
    assert result.scores.bi_surface_iou > 0.9
    assert result.scores.max_deviation < 4.0
    assert result.outcome in {"converged", "budget_reached"}
    assert result.warnings == ()
    scores = pw.evaluate(result.assembly, shape, emd=False)
    assert scores.to_dict() == result.report["scores"]


def test_exactly_the_five_files_are_written(folder: Path) -> None:
    assert sorted(path.name for path in folder.iterdir()) == sorted(FILES)
    assert [path.name for path in folder.parent.iterdir()] == [folder.name]
    assert all(path.stat().st_size > 100 for path in folder.iterdir())


def test_the_saved_assembly_is_the_fitted_one(folder: Path, result: Result, shape: pw.Shape) -> None:
    loaded = pw.load_assembly(folder / "assembly.json")
    assert loaded == result.assembly
    assert (loaded.unit, loaded.up, loaded.name) == ("mm", "z", "table")
    assert all(part.name for part in loaded.parts)
    assert len({part.name for part in loaded.parts}) == len(loaded)
    points = np.random.default_rng(0).choice(shape.vertices, 500) + CENTRE / 50
    np.testing.assert_array_equal(loaded.distance(points), result.assembly.distance(points))
    loaded.save(folder.parent / "again.json")
    assert (folder.parent / "again.json").read_bytes() == (folder / "assembly.json").read_bytes()
    (folder.parent / "again.json").unlink()


def test_inside_and_outside_are_those_of_the_shape(result: Result, shape: pw.Shape) -> None:
    lower, upper = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    points = np.random.default_rng(1).uniform(lower, upper, (4000, 3))
    wanted = shape.signed_distance(points)
    clear = np.abs(wanted) > 2.0
    found = result.assembly.distance(points)
    assert np.mean((found < 0) == (wanted < 0), where=clear) > 0.999


def test_the_surface_is_watertight_and_in_place(folder: Path) -> None:
    surface = trimesh.load_mesh(folder / "surface.ply")
    original = table()
    assert surface.is_watertight
    assert surface.is_winding_consistent
    assert surface.volume == pytest.approx(original.volume, rel=0.03)
    np.testing.assert_allclose(surface.bounds, original.bounds, atol=3.0)
    assert surface.euler_number == 2  # one body without holes


def test_the_parts_are_named_coloured_nodes(folder: Path, result: Result) -> None:
    scene = trimesh.load_scene(folder / "parts.glb")
    names = {part.name for part in result.assembly.parts}
    assert names <= set(scene.graph.nodes_geometry)
    extras = {child: data["metadata"] for (_, child), data in scene.graph.transforms.edge_data.items()}
    colours = set()
    for part in result.assembly.parts:
        mesh = scene.geometry[scene.graph[part.name][1]]
        assert mesh.is_watertight
        colours.add(tuple(mesh.visual.material.main_color))
        assert extras[part.name]["field"]["size"] == pytest.approx(part.field.size)
    assert len(colours) == len(names)
    # glTF is in metres with Y up.
    lower, upper = scene.bounds
    np.testing.assert_allclose(upper - lower, [0.2, 0.11, 0.12], atol=0.006)


def test_the_report_has_every_key(folder: Path, result: Result) -> None:
    report = json.loads((folder / "report.json").read_text())
    assert report == result.report
    expected = "outcome version method seed settings input seconds parts instances scores warnings"
    assert set(expected.split()) <= set(report)
    assert (report["method"], report["seed"], report["version"]) == ("superfrusta", 0, pw.__version__)
    assert report["settings"]["quality"] == "draft"
    assert {"file", "unit", "repairs", "confidence"} <= set(report["input"])
    assert (report["input"]["file"], report["input"]["unit"]) == ("table.stl", "mm")
    assert report["parts"] == len(result.assembly)
    assert report["instances"] == sum(len(part.copies) for part in result.assembly.parts)
    stages = dict(report["seconds"])
    assert stages.pop("all") >= sum(stages.values()) - 0.01
    assert {"meshing", "scores"} < set(stages)
    scores = report["scores"]
    assert 0 <= scores["overlap"] <= 1
    assert 0 < scores["chamfer_floor"] <= 1.2 * scores["chamfer"]
    assert scores["deviation_95"] <= scores["max_deviation"]


def test_the_preview_is_a_picture(folder: Path) -> None:
    from PIL import Image

    with Image.open(folder / "preview.png") as picture:
        picture.load()
        assert min(picture.size) > 200
        assert len(np.unique(np.asarray(picture.convert("RGB")).reshape(-1, 3), axis=0)) > 50


def test_an_interrupted_fit_is_a_result(shape: pw.Shape, tmp_path: Path) -> None:
    cancel = pw.Cancellation()
    stopped = pw.fit(shape, quality="draft", threads=1, progress=lambda _: cancel.request(), cancel=cancel)
    assert stopped.outcome == stopped.report["outcome"] == "interrupted"
    stopped.save(tmp_path / "out")
    assert pw.load_assembly(tmp_path / "out" / "assembly.json") == stopped.assembly


def test_a_users_process_on_a_real_fit(tmp_path: Path) -> None:
    trimesh.creation.box((4, 2, 1)).export(tmp_path / "block.obj")
    command = [sys.executable, "-m", "partwright", "fit", "block.obj", "-o", "out", "--quality", "draft"]
    ended = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert "IoU" in ended.stdout
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == sorted(FILES)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["parts"] == 1
    assert report["scores"]["iou"] > 0.99
