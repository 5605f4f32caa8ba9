"""The commands, from a configuration to edited shapes and films, on a tiny family."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from PIL import Image

import partwright as pw
from partwright.cli.commands.parts_generate import _kept
from partwright.cli.main import main, parser
from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.assemblies import to_assembly
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.resampling import Sample
from partwright.partsdf.soundness import Soundness
from tests.partsdf.lamps import small_config


@pytest.fixture
def file(model: Model, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The model as a file, in an empty working folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "lamps.safetensors"
    path.write_bytes(model.to_bytes())
    return path


def toml(family: PreparedFamily, **training: object) -> str:
    """A configuration file of the small settings."""
    data = asdict(small_config(family, epochs=1, **training))
    lines = [f"{k} = {json.dumps(v)}" for k, v in data.items() if not isinstance(v, dict)]
    for section, values in data.items():
        if isinstance(values, dict):
            lines += [f"[{section}]", *(f"{k} = {json.dumps(v)}" for k, v in values.items())]
    return "\n".join(lines)


def test_train(lamps: PreparedFamily, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "lamps.toml").write_text(toml(lamps))
    arguments = ["parts", "train", str(tmp_path / "lamps.toml"), "-o", str(tmp_path / "out"), "--half"]
    assert main(arguments) == 0
    assert "lamps: 24 shapes" in capsys.readouterr().out
    sizes = [(tmp_path / "out" / f).stat().st_size for f in ("model.safetensors", "model-half.safetensors")]
    assert sizes[1] < sizes[0]
    assert main(arguments) == 0  # all epochs are done: the same model again
    assert [(tmp_path / "out" / "model.safetensors").stat().st_size] == sizes[:1]


@pytest.mark.parametrize("option", ["--poses", "--keep plate --of", "--like"])
def test_what_samples_are_made_after_may_be_a_mesh_or_picture(
    option: str, model: Model, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    commands = "partwright.cli.commands.parts_generate."
    lamps = [NeuralShape.trained(model, name) for name in ("lamp0", "lamp1")]
    monkeypatch.setattr(commands + "found_in", lambda _, path, seed: (lamps[seed], (f"{path} is odd",)))
    seen = SimpleNamespace(shape=lamps[0], warnings=("seen from below",))
    monkeypatch.setattr(commands + "reconstruct_photo", lambda *_: seen)
    for file, said in (("lamp.stl", "lamp.stl is odd"), ("lamp.jpg", "seen from below")):
        line = ["parts", "generate", "--model", "lamps", *option.split(), file]
        assert _kept(parser().parse_args(line), model) is lamps[0]
        assert said in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--poses", "--keep plate --of", "--like"])
def test_the_folder_of_a_reconstruction_stands_for_its_assembly(
    option: str, file: Path, model: Model, capsys: pytest.CaptureFixture[str]
) -> None:
    shape = NeuralShape.trained(model, "lamp1")
    Path("found").mkdir()
    to_assembly(shape).save("found/assembly.json")
    line = ["parts", "generate", "--model", str(file), *option.split(), "found"]
    kept = _kept(parser().parse_args(line), model)
    assert kept is not None
    np.testing.assert_allclose(kept.poses.translation[shape.present], shape.poses.translation[shape.present])
    assert main(["parts", "edit", "found", "--model", str(file), "-o", "found/assembly.json"]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_encoder_and_generator(
    file: Path, lamps: PreparedFamily, tmp_path: Path,
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Both lie beside the model that they are for, and are used from there."""
    monkeypatch.setattr("partwright.partsdf.soundness._FINE", 64)  # as its pictures, see conftest.py
    monkeypatch.setattr("partwright.partsdf.soundness._JUDGES", 2)
    assert main(["parts", "generate", "--model", str(file)]) == 2
    # Wrong names of parts are told before a generator, or the shape that has them, is looked for.
    assert main(["parts", "generate", "--model", str(file), "--keep", "seats", "--of", "nowhere.json"]) == 2
    assert "lamps has no part 'seats'; its parts are " in capsys.readouterr().err
    assert main(["parts", "generate", "--model", str(file)]) == 2
    assert "lamps has no generator; make one with `parts train-generator`" in capsys.readouterr().err
    assert main(["parts", "train-encoder", str(file), str(lamps.folder), "--steps", "2"]) == 0
    assert main(["parts", "train-generator", str(file), "--steps", "20"]) == 0
    assert sorted(p.name for p in tmp_path.glob("*.safetensors")) == [
        "lamps.encoder.safetensors",
        "lamps.generator.safetensors",
        "lamps.safetensors",
    ]
    make = ["parts", "generate", "--model", str(file), "-o", "made", "--tries", "1"]
    assert (
        main([*make, "--tries", "2", "-n", "2", "--seed", "3", "--keep", "plate", "--of", f"{file}:lamp0"])
        == 0
    )
    assert "2 shapes of lamps's family: made; the least new differs by" in capsys.readouterr().out
    about = json.loads(Path("made/samples.json").read_text())
    assert [s["file"] for s in about["samples"]] == ["sample_00.json", "sample_01.json"]
    assert all(0 <= s["difference"] <= 0.1 and s["nearest"].startswith("lamp") for s in about["samples"])
    assert all(s["tries"] == 2 or not s["faults"] for s in about["samples"])
    assert Image.open("made/samples.png").width == 480
    first = pw.load_assembly("made/sample_00.json")
    plate = NeuralShape.trained(pw.partsdf.load_model(file), "lamp0").poses.translation[0]
    np.testing.assert_allclose(first["plate"].translation, plate, atol=1e-6)
    Path("made/sample_00.json").rename("kept.json")
    assert main([*make, "-n", "1", "--poses", "kept.json"]) == 0
    assert not Path("made/sample_01.json").exists()
    assert main([*make, "-n", "1", "--like", f"{file}:lamp0", "--change", "0.1"]) == 0
    about = json.loads(Path("made/samples.json").read_text())
    assert about["like"] == {"shape": f"{file}:lamp0", "change": 0.1}
    assert about["samples"][0]["parts"] == ["plate", "ball", "knob"]
    assert about["samples"][0]["tries"] == 1
    assert Image.open("made/samples.png").width == 480  # itself first
    assert main([*make, "--like", f"{file}:lamp0", "--change", "0"]) == 2
    assert main([*make, "--change", "0.2"]) == 2
    assert main([*make, "--keep", "plate"]) == 2
    assert main([*make, "--poses", f"{file}:0", "--keep", "plate", "--of", f"{file}:0"]) == 2
    assert main([*make, "-n", "0"]) == 2
    assert main([*make, "--tries", "0"]) == 2
    said = capsys.readouterr().err
    assert "--keep PARTS and --of SHAPE go together" in said
    assert "give one of them" in said
    assert "--change is 0.0; expected above 0" in said
    assert "--count: expected a whole number of at least 1, got 0" in said
    assert "tries: expected a whole number of at least 1, got 0" in said
    assert main(["parts", "train-encoder", str(file), str(lamps.folder), "-o", "encoder.bin"]) == 2


def test_a_mesh_of_something_else_is_told_first(file: Path) -> None:
    """Before what is off, and what to try against that."""
    trimesh.creation.torus(1.0, 0.2).export("ring.ply")
    quick = ["--quality", "draft", "--iterations", "5", "--resolution", "32", "--as-it-stands"]
    assert main(["parts", "reconstruct", str(file), "ring.ply", "-o", "out", *quick]) == 0
    warnings = json.loads(Path("out/report.json").read_text())["warnings"]
    assert warnings[0].startswith("this may be no shape of the family that lamps knows")
    assert any("poor in places" in line for line in warnings[1:])


def test_points_are_told_of_and_shown_as_points(
    file: Path, lamps: PreparedFamily, capsys: pytest.CaptureFixture[str]
) -> None:
    """A lamp with noise: what counts is how far its points are off, not a surface laid through them."""
    known = lamps.load(lamps.split("test")[0])
    mesh = trimesh.Trimesh(known.vertices, known.faces, process=False)
    points = mesh.sample(3000, seed=1)
    points += 0.01 * np.random.default_rng(0).standard_normal(points.shape)
    trimesh.PointCloud(points).export("scan.ply")
    quick = ["--quality", "draft", "--iterations", "40", "--resolution", "32", "--as-it-stands"]
    assert main(["parts", "reconstruct", str(file), "scan.ply", "-o", "out", *quick]) == 0
    said = capsys.readouterr()
    assert "points off, mean" in said.out
    assert "IoU" not in said.out
    assert "poor in places" not in said.err
    report = json.loads(Path("out/report.json").read_text())
    assert report["settings"]["starts"] == 2  # of a draft
    told = report["points"]
    surface = trimesh.load("out/surface.ply")
    off = np.abs(trimesh.proximity.closest_point(surface, points)[1])
    assert told["count"] == len(points)
    assert told["mean"] == pytest.approx(off.mean(), rel=1e-3)
    assert told["max_deviation_share"] == pytest.approx(off.max() / np.ptp(points, axis=0).max(), rel=0.15)
    assert told["mean_share"] < 0.03


def test_reconstruct(
    file: Path, lamps: PreparedFamily, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    known = lamps.load(lamps.split("test")[0])
    mesh = trimesh.Trimesh(known.frame.from_unit(known.vertices), known.faces, process=False)
    mesh.export(tmp_path / "lamp.ply")
    quick = ["--iterations", "60", "--points", "400", "--resolution", "48"]
    assert main(["parts", "reconstruct", str(file), "lamp.ply", "-o", "out", *quick]) == 0
    assert "written to out" in capsys.readouterr().out
    report = json.loads(Path("out/report.json").read_text())
    assert (report["method"], report["outcome"]) == ("parts", "converged")
    assert report["parts"] + len(report["learned"][0]["absent"]) == 3
    assert {part.name for part in pw.load_assembly("out/assembly.json").parts} >= {"plate", "ball"}
    assert report["scores"]["iou"] > 0.75
    assert report["learned"][0]["evaluations"]["meshing"] < report["learned"][0]["evaluations"]["dense grid"]
    assert report["learned"][0]["starts"] == ["training shape"] * 8
    surface = trimesh.load("out/surface.ply")
    assert surface.is_watertight
    np.testing.assert_allclose(surface.center_mass, mesh.center_mass, atol=0.15)  # of a size of 3.6
    assembly = pw.load_assembly("out/assembly.json")
    assert np.abs(assembly.distance(surface.vertices[::50])).max() < 0.1
    assert {p.name for p in Path("out").iterdir()} == {
        "assembly.json", "parts.glb", "surface.ply", "report.json", "preview.png",
    }  # fmt: skip


def test_edit(file: Path, model: Model, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["parts", "edit", f"{file}:lamp1", "-o", "a.json"]
    edits = ["--move", "ball=0.1,0,0", "--swap", f"plate={file}:lamp3", "--turn", "plate=0,0,1,30"]
    assert main([*arguments, *edits, "--drop", "knob"]) == 0
    told = capsys.readouterr()
    assert "plate, ball: written to a.json" in told.out
    assert "partwright: drawing\n" in told.err
    assembly = pw.load_assembly("a.json")
    start = NeuralShape.trained(model, "lamp1")
    moved = assembly["ball"].translation[0] - float(start.poses.translation[1, 0])
    assert moved == pytest.approx(0.1, abs=1e-6)
    assert assembly["plate"].rotation[3] == pytest.approx(np.sin(np.radians(15)), abs=1e-6)
    assert Image.open("a.png").size == (480, 480)
    assert main(["parts", "edit", "a.json", "-o", "b.json", "--scale", "ball=1,1,0.5"]) == 0
    before, after = (pw.load_assembly(f)["ball"].field.half_lengths for f in ("a.json", "b.json"))
    assert after == pytest.approx((before[0], before[1], before[2] / 2))


@pytest.mark.parametrize("edit", [["--move", "ball=1e9,0,0"], ["--scale", "ball=1,1e9,1"]])
def test_a_part_that_is_far_out_is_told_before_anything_is_written(
    file: Path, edit: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    before = set(Path().iterdir())
    assert main(["parts", "edit", f"{file}:lamp1", "-o", "a.json", *edit]) == 2
    assert re.search(r"error: parts of this shape reach [\d.]+e\+0[89] unit lengths", capsys.readouterr().err)
    assert set(Path().iterdir()) == before


def test_a_part_is_swapped_for_that_of_an_assembly_or_of_its_folder(file: Path, model: Model) -> None:
    other = NeuralShape.trained(model, "lamp3")
    Path("found").mkdir()
    to_assembly(other).save("found/assembly.json")
    want = pytest.approx(other.latents[model.index("plate")].tolist(), abs=1e-6)
    for source in ("found", "found/assembly.json"):
        assert main(["parts", "edit", f"{file}:lamp1", "-o", "a.json", "--swap", f"plate={source}"]) == 0
        assert pw.load_assembly("a.json")["plate"].field.latent == want


def test_an_assembly_that_a_part_is_taken_from_is_not_written_over(
    file: Path, model: Model, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("found").mkdir()
    to_assembly(NeuralShape.trained(model, "lamp3")).save("found/assembly.json")
    arguments = ["parts", "edit", f"{file}:lamp1", "--swap", "plate=found", "-o", "found/assembly.json"]
    assert main(arguments) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_interpolate(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["parts", "interpolate", f"{file}:lamp1", f"{file}:2", "-o", "film.gif"]
    assert main([*arguments, "--steps", "3", "--size", "64", "--resolution", "32"]) == 0
    assert "partwright: drawing\n" in capsys.readouterr().err
    film = Image.open("film.gif")
    assert film.n_frames == 4  # there, and back
    assert film.size == (64, 64)
    assert Image.open("film.png").size[0] == 3 * 64


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["edit", "lamp.obj", "-o", "a.json"], "no assembly file"),
        (["edit", "{}:lamp1", "-o", "a.glb"], "written as .json"),
        (["edit", "{}:lamp1", "-o", "a.json", "--move", "ball=1,2"], "3 numbers"),
        (["edit", "{}:lamp1", "-o", "a.json", "--move", "ball=nan,0,0"], "3 numbers"),
        (
            ["edit", "{}:lamp1", "-o", "a.json", "--resample", "ball=nan"],
            "a seed, a whole number of at least 0",
        ),
        (
            ["edit", "{}:lamp1", "-o", "a.json", "--resample", "ball=-1"],
            "a seed, a whole number of at least 0",
        ),
        (["edit", "{}:lamp1", "-o", "a.json", "--drop", "arm"], "no part 'arm'"),
        (["edit", "{}:lamp1", "-o", "a.json", "--swap", "plate"], "expected PART=SHAPE"),
        (["edit", "{}", "-o", "a.json"], "`parts reconstruct MODEL FILE` makes one of a mesh"),
        (["edit", "{}:lamp99", "-o", "a.json"], "was not trained on 'lamp99'"),
        (["edit", "sofas:1", "-o", "a.json"], "no model is named 'sofas'"),
        (
            ["generate", "--model", "{}", "-o", "out", "--seed", "-1"],
            "--seed: expected a whole number of at least 0",
        ),
        (["prepare", "chairs", "-o", "out", "--seed", "-1"], "--seed: expected a whole number of at least 0"),
        (
            ["reconstruct", "{}", "a.ply", "--seed", f"{2**63}"],
            "--seed: expected a whole number of at most 9223372",
        ),
        (
            ["train-encoder", "{}", "."],
            "make a family of a folder of shapes with named parts: parts prepare . -o",
        ),
        (["generate", "--model", ".", "-o", "out"], ".: a folder without model.safetensors; here are: cars,"),
        (["generate", "--model", "/dev/null", "-o", "out"], "/dev/null: no model's file; here are: cars,"),
        (["interpolate", "{}:1", "{}:2", "-o", "a.avi"], "written as .gif"),
        (["reconstruct", "{}", "none.ply"], "none.ply"),
        (
            ["reconstruct", "{}", "none.ply", "--iterations", "-1"],
            "iterations: expected a whole number of at least 0",
        ),
        (["train", "none.toml", "-o", "out"], "none.toml: no such file"),
        (["train", "/dev/zero", "-o", "out"], "/dev/zero: is a pipe, socket or device"),
        (["edit", "/dev/zero", "-o", "a.json"], "no assembly file"),
    ],
)
def test_what_goes_wrong_is_one_line(
    file: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    before = set(Path().iterdir())
    assert main(["parts", *(a.format(file) for a in arguments)]) == 2
    *before_it, error = capsys.readouterr().err.splitlines()
    assert message in error
    assert before_it in ([], ["partwright: reading"])
    assert set(Path().iterdir()) == before


@pytest.mark.parametrize("what", ["config", "model", "family"])
def test_a_pipe_is_refused_at_once(
    what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nobody writes to it: to open it would wait for ever."""
    monkeypatch.chdir(tmp_path)
    Path("family").mkdir()
    Path("sound.toml").write_text('name = "lamp"\nfamily = "family"\n')
    pipe = {"config": "pipe.toml", "model": "pipe.safetensors", "family": "family/family.json"}[what]
    os.mkfifo(pipe)
    command = {
        "config": ["train", pipe, "-o", "out"],
        "model": ["edit", f"{pipe}:0", "--drop", "arm", "-o", "a.json"],
        "family": ["train", "sound.toml", "-o", "out"],
    }[what]
    assert main(["parts", *command]) == 2
    assert "is a pipe, socket or device" in capsys.readouterr().err


def test_ctrl_c_keeps_the_samples_that_are_done(
    file: Path, model: Model, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Of three, the first, as whole files; what lay there before is gone."""
    commands = "partwright.cli.commands.parts_generate."
    asked: list[Callable[[], None]] = []

    @contextmanager
    def stopping(stop: Callable[[], None]) -> Iterator[None]:
        asked.append(stop)
        yield

    def one_by_one(*_: object, **__: object) -> Iterator[Sample]:
        sound = Soundness((), 0.0, (), 0.02, 0.0, ())
        for name in model.shapes[:3]:
            asked[0]()
            yield Sample(NeuralShape.trained(model, name), sound, 1)

    monkeypatch.setattr(commands + "load_generator", lambda model: None)
    monkeypatch.setattr(commands + "stopping", stopping)
    monkeypatch.setattr(commands + "sound_samples", one_by_one)
    Path("made").mkdir()
    Path("made/sample_02.json").write_text("{}")
    line = ["parts", "generate", "--model", str(file), "-o", "made", "-n", "3", "--overwrite"]
    assert main(line) == 130
    assert "interrupted: 1 sample of 3 written" in capsys.readouterr().err
    names = {"sample_00.json", "samples.json", "samples.png"}
    assert {path.name for path in Path("made").iterdir()} == names
    assert len(json.loads(Path("made/samples.json").read_text())["samples"]) == 1
