"""A folder of named parts becomes a model by one command; bad folders are told in a line."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from PIL import Image

import partwright as pw
from partwright.cli.main import main
from partwright.datasets.prepared import PreparedFamily
from partwright.errors import FamilyError, SettingError
from partwright.partsdf.config import read_config
from partwright.partsdf.own_family import Plan, learn_family, settings_for
from partwright.partsdf.training import EpochReport, Trained


def scene(
    path: Path, wide: float = 1.0, names: tuple[str, ...] = ("foot", "head"), hole: bool = False
) -> None:
    """A box with a ball above it; with `hole`, the ball lacks a triangle."""
    foot = trimesh.creation.box((2 * wide, 1.2, 0.8))
    head = trimesh.creation.icosphere(2, 0.5)
    head.apply_translation((0, 0, 0.8))
    if hole:
        head.update_faces(np.arange(len(head.faces)) > 0)
    made = trimesh.Scene()
    for name, mesh in zip(names, (foot, head), strict=False):
        made.add_geometry(mesh, node_name=name, geom_name=name)
    made.export(path)


def test_one_command_from_a_folder_to_a_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, output = tmp_path / "things", tmp_path / "things-model"
    source.mkdir()
    for i in range(4):
        scene(source / f"thing_{i}.glb", 1 + 0.1 * i, hole=i == 2)
    (source / "thing_4.glb").write_bytes(b"glTF")
    command = ["parts", "family", str(source), "-o", str(output), "--steps", "3", "--samples", "1000"]
    assert main([*command, "--threads", "1", "--workers", "1"]) == 0
    said = capsys.readouterr()
    assert "4 shapes of head, foot; 3 findings" in said.out
    assert "3 steps will take about" in said.out
    assert "thing_4, left out: " in said.err
    table = (output / "check.md").read_text()
    assert "| thing_2 | look at it | not watertight: filled 1 hole " in table
    model = pw.partsdf.load_model(output)  # the folder is enough
    assert (model.name, model.parts, len(model.shapes)) == ("things-model", ("head", "foot"), 3)
    assert model.up == "y"  # as in all GLB files
    assert "learned from 3 shapes" in said.out
    assert "shapes that it has not seen are found, their parts being known, at an IoU" in said.out
    assert read_config(output / "training.toml").training.epochs == 3
    assert Image.open(output / "live.png").width == 2 * 240  # two are in the split that trains


def test_what_a_stopped_training_has_learned_is_kept_and_gone_on_from(tmp_path: Path) -> None:
    source, output = tmp_path / "things", tmp_path / "out"
    source.mkdir()
    for i in range(3):
        scene(source / f"thing_{i}.glb", 1 + 0.1 * i)
    plans: list[Plan] = []
    epochs: list[int] = []

    def told(report: EpochReport) -> None:
        epochs.append(report.epoch)
        if len(epochs) == 2:
            signal.raise_signal(signal.SIGINT)

    def learn() -> Trained:
        return learn_family(
            source, output, steps=3, samples=1000, threads=1, workers=1, progress=told, planned=plans.append
        )

    assert learn().outcome == "interrupted"
    assert (output / "live.png").exists()
    first = pw.partsdf.load_model(output)
    again = learn()
    assert (again.outcome, epochs) == ("converged", [1, 2, 3])
    assert again.model.hash != first.hash
    assert plans[0].seconds > 0
    assert [(plan.steps, plan.total) for plan in plans] == [(3, 3), (1, 3)]
    assert [finding.shape for finding in plans[0].findings] == [""]  # three shapes are few


def test_the_command_tells_what_is_left(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, output = tmp_path / "things", tmp_path / "out"
    source.mkdir()
    for i in range(3):
        scene(source / f"thing_{i}.glb", 1 + 0.1 * i)

    def stop(report: EpochReport) -> None:
        if report.epoch == 2:
            signal.raise_signal(signal.SIGINT)

    learn_family(source, output, steps=3, samples=1000, threads=1, workers=1, progress=stop)
    command = ["parts", "family", str(source), "-o", str(output), "--steps", "3", "--samples", "1000"]
    assert main([*command, "--threads", "1", "--workers", "1"]) == 0
    assert "1 of 3 steps will take about" in capsys.readouterr().out


def test_what_was_begun_with_other_settings_is_refused_and_its_settings_stay(tmp_path: Path) -> None:
    source, output = tmp_path / "things", tmp_path / "out"
    source.mkdir()
    for i in range(4):
        scene(source / f"thing_{i}.glb", 1 + 0.1 * i)
    learn_family(source, output, steps=2, samples=1000, threads=1, workers=1)
    written = (output / "training.toml").read_bytes()
    with pytest.raises(SettingError, match="training of 2 epochs, and 3 are asked for; one of"):
        learn_family(source, output, steps=3, samples=1000, threads=1, workers=1)
    assert (output / "training.toml").read_bytes() == written


def test_what_the_picture_takes_is_no_part_of_what_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, seconds, now = tmp_path / "things", list[float](), [0.0]
    source.mkdir()
    for i in range(4):
        scene(source / f"thing_{i}.glb", 1 + 0.1 * i)

    def later() -> float:
        now[0] += 0.001
        return now[0]

    def told(report: EpochReport) -> None:
        seconds.append(report.seconds)
        now[0] += 1000

    monkeypatch.setattr("partwright.partsdf.training.time", SimpleNamespace(monotonic=later))
    learn_family(source, tmp_path / "out", steps=3, samples=1000, threads=1, workers=1, progress=told)
    assert seconds == sorted(seconds)
    assert 0 < seconds[0] < seconds[2] < 1


def test_bad_folders_are_told_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def said(make: dict[str, tuple[str, ...]]) -> str:
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        folder.mkdir()
        for name, parts in make.items():
            scene(folder / f"{name}.glb", names=parts)
        output = folder.parent / f"{folder.name}-model"
        command = ["parts", "family", str(folder), "-o", str(output), "--samples", "1000", "--workers", "1"]
        assert main(command) == 2
        assert not (output / "model.safetensors").exists()
        lines = [line for line in capsys.readouterr().err.splitlines() if "error:" in line]
        assert len(lines) == 1
        return lines[0]

    pair = ("foot", "head")
    assert "1 usable shape; a family needs at least two" in said({"a": pair})
    assert "2 usable shapes, of which one is kept to test with; learning takes 3" in said(
        {"a": pair, "b": pair}
    )
    assert "no part name is in two shapes: a has a2, a1; b has b2, b1" in said(
        {"a": ("a1", "a2"), "b": ("b1", "b2")}
    )
    twice = said({"a": pair, "b": ("Foot", "head"), "c": ("foot", "HEAD")})
    assert "differ in spelling alone; name them alike: " in twice  # and all of them at once
    assert "'head' (as in a) and 'HEAD' (as in c)" in twice
    assert "'foot' (as in a) and 'Foot' (as in b)" in twice
    assert "every shape is one part, 'mesh'; name the nodes" in said({"a": ("mesh",), "b": ("mesh",)})
    assert "holds no shapes" in said({})
    with pytest.raises(FamilyError, match="no such folder"):
        learn_family(tmp_path / "nowhere", tmp_path / "out")
    with pytest.raises(SettingError, match="holds the shapes"):
        learn_family(tmp_path, tmp_path / "." / "")
    with pytest.raises(SettingError, match="steps is 0"):
        learn_family(tmp_path, tmp_path / "out", steps=0)
    with pytest.raises(SettingError, match="unknown up axis 'w'"):
        learn_family(tmp_path, tmp_path / "out", up="w")
    assert not (tmp_path / "out").exists()


def test_too_few_usable_shapes_are_told_with_why_the_others_were_refused(tmp_path: Path) -> None:
    source, output = tmp_path / "things", tmp_path / "out"
    source.mkdir()
    for i in range(2):
        scene(source / f"thing_{i}.glb", 1 + 0.1 * i)
    (source / "thing_2.glb").write_bytes(b"glTF")
    with pytest.raises(FamilyError, match=r"twenty are a start; thing_2 was refused: .*thing_2\.glb: cannot"):
        learn_family(source, output, steps=1, samples=1000, threads=1, workers=1)
    assert "| thing_2 | left out | " in (output / "check.md").read_text()


def test_names_that_one_shape_tells_apart_do_not_conflict(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    for i in range(2):
        scene(folder / f"thing_{i}.glb", names=("leg_11", "leg_1_1"))
    family = pw.datasets.prepare(folder, tmp_path / "out", samples=1000, workers=1).family
    assert set(family.parts) == {"leg_11", "leg_1_1"}


def test_settings_are_written_as_they_are_read(lamps: PreparedFamily, tmp_path: Path) -> None:
    from partwright.partsdf.config import write_config

    config = settings_for(lamps, "lamps", 1000, seed=3)
    elsewhere = replace(config, family='C:\\möbel "neu"/\U0001fa91')
    write_config(tmp_path / "c.toml", elsewhere)
    assert read_config(tmp_path / "c.toml") == elsewhere
    write_config(tmp_path / "c.toml", config)
    assert read_config(tmp_path / "c.toml") == config
    assert json.dumps(str(lamps.folder)) in (tmp_path / "c.toml").read_text()
    assert config.training.epochs == round(1000 / 7)  # of 25 shapes, four a step
