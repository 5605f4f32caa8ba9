"""The commands, in this process with a small method, and as a user's process for what only shows there."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import partwright
from partwright.assembly import Assembly, Part, load_assembly
from partwright.cli.main import main
from partwright.errors import CancelledError, PartwrightError
from partwright.fields import Box
from partwright.fitting import FILES, fit, fit_nodes
from partwright.shapes import load_shape
from tests.cli.conftest import BoxMethod
from tests.shapes.solids import blinds


def command(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "partwright", *arguments], capture_output=True, text=True)


def test_help_and_version_import_nothing_heavy() -> None:
    code = (
        "import sys\nfrom partwright.cli.main import main\n"
        "try: main(['fit', '--help'])\nexcept SystemExit: pass\n"
        "heavy = {'numpy', 'scipy', 'trimesh', 'torch', 'rich', 'PIL'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
    assert command("--version").stdout == f"partwright {partwright.__version__}\n"


def test_every_option_is_passed_on(method: BoxMethod, block: Path, tmp_path: Path, monkeypatch: Any) -> None:
    seen: dict[str, Any] = {}

    def spy(shape: Any, method: str, **options: Any) -> Any:
        seen.update(options, method=method, unit=shape.unit, up=shape.up)
        return fit(shape, method, **options)

    monkeypatch.setattr("partwright.cli.commands.fit.fit", spy)
    options = "--quality draft --max-parts 5 --min-iou 0.9 --unit mm --up x --device cpu --seed 7 --threads 2"
    assert main(["fit", str(block), "-o", str(tmp_path / "out"), *options.split()]) == 0
    expected = {"quality": "draft", "max_parts": 5, "min_iou": 0.9, "unit": "mm", "up": "x", "device": "cpu"}
    assert expected.items() <= seen.items()
    assert (seen["seed"], seen["threads"]) == (7, 2)
    assert not {"curve", "symmetry", "subtract", "model"} & seen.keys()  # left to the method


def test_fit_writes_five_files(method: BoxMethod, block: Path, tmp_path: Path, capsys: Any) -> None:
    folder = tmp_path / "deep" / "out"
    assert main(["fit", str(block), "-o", str(folder), "--unit", "mm"]) == 0
    assert sorted(p.name for p in folder.iterdir()) == sorted(FILES)
    assert [p.name for p in folder.parent.iterdir()] == ["out"]
    assembly = load_assembly(folder / "assembly.json")
    assert assembly.unit == "mm"
    assert assembly.parts[0].translation == pytest.approx((10, 20, 30))
    assert trimesh.load_mesh(folder / "surface.ply").volume == pytest.approx(8.0, rel=1e-3)
    report = json.loads((folder / "report.json").read_text())
    assert report["scores"]["iou"] > 0.98
    assert report["scores"]["max_deviation"] < 0.05
    assert (report["outcome"], report["parts"], report["instances"]) == ("converged", 1, 1)
    assert report["input"]["file"] == "block.stl"
    assert report["seconds"]["seeding"] == 0.25
    seconds = report["seconds"]
    assert min(seconds["reading"], seconds["writing"]) > 0
    assert seconds.pop("all") >= sum(seconds.values()) - seconds["seeding"] - 0.01
    assert list(report["seconds"])[-1] == "writing"
    captured = capsys.readouterr()
    assert "bi-surface IoU" in captured.out
    assert f"written to {folder}" in captured.out
    assert "optimising: round 1/2  1 part  IoU 0.500  50%" in captured.err
    assert "warning" not in captured.err


def test_density_gives_the_mass_in_kilograms(method: BoxMethod, block: Path, tmp_path: Path) -> None:
    options = ["-o", str(tmp_path / "out"), "--unit", "cm", "--density", "2700"]
    assert main(["fit", str(block), *options]) == 0
    masses = json.loads((tmp_path / "out" / "report.json").read_text())["mass_properties"]
    assert masses["unit"] == masses["input"]["unit"] == "m"
    assert masses["input"]["mass"] == pytest.approx(2700 * 8e-6)
    assert masses["mass"] == pytest.approx(2700 * 8e-6, rel=1e-3)
    assert np.allclose(masses["input"]["centre"], (0.1, 0.2, 0.3))
    assert np.allclose(masses["inertia"], masses["input"]["inertia"], rtol=5e-3, atol=1e-10)
    assert masses["input"]["inertia"][0][0] == pytest.approx(
        2700 * 8e-6 * (0.02**2 + 0.01**2) / 12
    )  # 4 x 2 x 1 cm


def test_an_existing_folder_keeps_its_other_files(method: BoxMethod, block: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    (folder / "report.json").write_text("old")
    assert main(["fit", str(block), "-o", str(folder)]) == 0
    assert (folder / "notes.txt").read_text() == "mine"
    assert json.loads((folder / "report.json").read_text())["method"] == "superfrusta"


def test_what_would_be_in_the_way_is_found_before_the_fit(
    method: BoxMethod, block: Path, tmp_path: Path, monkeypatch: Any, capsys: Any
) -> None:
    def work(*_: Any, **__: Any) -> None:
        raise AssertionError("fitted before it looked")

    monkeypatch.setattr(method, "fit", work, raising=False)
    (tmp_path / "out" / "surface.ply").mkdir(parents=True)
    assert main(["fit", str(block), "-o", str(tmp_path / "out")]) == 2
    assert "surface.ply: a folder of that name is in the way" in capsys.readouterr().err


def test_a_later_fit_removes_an_earlier_ones_curve(method: BoxMethod, block: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    for name in ("curve_04.json", "curve.png", "curve_of_mine.json"):
        (folder / name).write_text("old")
    assert main(["fit", str(block), "-o", str(folder)]) == 0
    assert sorted(p.name for p in folder.iterdir()) == sorted((*FILES, "curve_of_mine.json"))


def test_the_default_folder_is_named_after_the_shape(
    method: BoxMethod, block: Path, monkeypatch: Any
) -> None:
    monkeypatch.chdir(block.parent)
    assert main(["fit", "block.stl"]) == 0
    assert (block.parent / "block-parts" / "preview.png").exists()


def test_per_node(method: BoxMethod, scene: Path, tmp_path: Path) -> None:
    assert main(["fit", str(scene), "-o", str(tmp_path / "out"), "--per-node"]) == 0
    assembly = load_assembly(tmp_path / "out" / "assembly.json")
    places = {child.name: child.parts[0].translation[0] for child in assembly.children}
    assert places == {"left": pytest.approx(-2.0), "right": pytest.approx(2.0)}
    assert (assembly.unit, assembly.up, len(assembly)) == ("m", "y", 2)


def test_a_poor_fit_is_told(method: BoxMethod, block: Path, tmp_path: Path, capsys: Any) -> None:
    method.shrink = 0.5
    assert main(["fit", str(block), "-o", str(tmp_path / "out")]) == 0
    error = capsys.readouterr().err
    assert "warning: the fit is poor in places: IoU 0.1" in error
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["scores"]["worst_place"] in error


def test_a_large_repair_is_told(method: BoxMethod, block: Path, tmp_path: Path, capsys: Any) -> None:
    whole = trimesh.load_mesh(block)
    right = whole.triangles_center[:, 0] > 11.9
    trimesh.Trimesh(whole.vertices, whole.faces[~right]).export(tmp_path / "open.stl")
    assert main(["fit", str(tmp_path / "open.stl"), "-o", str(tmp_path / "out"), "--up", "z"]) == 0
    error = capsys.readouterr().err
    assert "warning: about 7% of the surface was missing, at the right, and is made up" in error
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["input"]["openings"]["share"] == pytest.approx(2 / 28)
    assert report["input"]["openings"]["largest"] == pytest.approx([12, 20, 30])


def test_a_solid_that_is_seen_in_an_open_surface_is_told(
    method: BoxMethod, tmp_path: Path, capsys: Any
) -> None:
    blinds(0.022, pitch=0.08).export(tmp_path / "blinds.stl")
    assert main(["fit", str(tmp_path / "blinds.stl"), "-o", str(tmp_path / "out")]) == 0
    error = capsys.readouterr().err
    assert "warning: the surface is open in many places, and the solid that is seen in it" in error
    assert "--thickness 1% makes walls" in error
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["input"]["sealed"]
    assert main(["fit", str(tmp_path / "blinds.stl"), "-o", str(tmp_path / "out"), "--thickness", "1%"]) == 0
    assert "open in many places" not in capsys.readouterr().err
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert not report["input"]["sealed"]


def test_an_interrupted_fit_writes_what_it_has(
    method: BoxMethod, block: Path, tmp_path: Path, capsys: Any
) -> None:
    method.outcome = "interrupted"
    assert main(["fit", str(block), "-o", str(tmp_path / "out")]) == 130
    assert "holds the best assembly so far" in capsys.readouterr().err
    assert json.loads((tmp_path / "out" / "report.json").read_text())["outcome"] == "interrupted"


def test_an_interruption_ends_a_scene_early(method: BoxMethod, scene: Path) -> None:
    method.outcome = "interrupted"
    result = fit_nodes(load_shape(scene))
    assert (result.outcome, len(result.assembly)) == ("interrupted", 1)


def test_an_interruption_before_there_is_anything(
    method: BoxMethod, block: Path, tmp_path: Path, monkeypatch: Any, capsys: Any
) -> None:
    def interrupt(*_: Any, **__: Any) -> None:
        raise CancelledError("cancelled before there was anything to keep")

    monkeypatch.setattr(method, "fit", interrupt, raising=False)
    assert main(["fit", str(block), "-o", str(tmp_path / "out")]) == 130
    assert "nothing was written" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_evaluate(method: BoxMethod, block: Path, tmp_path: Path, capsys: Any) -> None:
    fit(load_shape(block)).assembly.save(tmp_path / "a.json")
    assert main(["evaluate", str(tmp_path / "a.json"), str(block), "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    assert scores["iou"] > 0.98
    assert scores["emd"] is not None
    assert main(["evaluate", str(tmp_path / "a.json"), str(block)]) == 0
    assert "EMD" in capsys.readouterr().out


def test_export(method: BoxMethod, block: Path, tmp_path: Path) -> None:
    fit(load_shape(block)).assembly.save(tmp_path / "a.json")
    assert main(["export", str(tmp_path / "a.json"), "-o", str(tmp_path / "a.stl")]) == 0
    assert trimesh.load_mesh(tmp_path / "a.stl").is_watertight


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fit", "missing.stl"], "missing.stl"),
        (["fit", "{block}", "-o", "{block}"], "is a file"),
        (["fit", "{block}", "--unit", "parsec"], "parsec"),
        (["fit", "{block}", "--max-parts", "0"], "max_parts: expected a number of at least 1, got 0"),
        (["fit", "{block}", "--density", "2700"], "state it by --unit"),
        (["fit", "{block}", "--unit", "mm", "--density", "-1"], "density: expected a positive number"),
        (["evaluate", "{block}", "{block}"], "no assembly file (.json), which `partwright fit` makes"),
        (
            ["optimise", "{block}", "-o", "out", "--objective", "volume"],
            "no assembly file (.json), which `partwright fit` makes of a shape",
        ),
        (["export", "missing.json", "-o", "a.glb"], "missing.json"),
        (["export", "{assembly}", "-o", "a.dwg"], "use one of .json, .glb"),
        (["export", "{assembly}", "-o", "{assembly}/a.glb"], "cannot write"),
    ],
)
def test_errors_are_one_line_and_code_2(
    method: BoxMethod,
    block: Path,
    tmp_path: Path,
    capsys: Any,
    monkeypatch: Any,
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assembly = tmp_path / "assembly.json"
    fit(load_shape(block)).assembly.save(assembly)
    before = sorted(tmp_path.iterdir())
    assert main([a.format(block=block, assembly=assembly) for a in arguments]) == 2
    captured = capsys.readouterr()
    last = captured.err.strip().splitlines()[-1]
    assert last.startswith("partwright: error: ")
    assert message in last
    assert sorted(tmp_path.iterdir()) == before


def test_a_users_process_ends_with_the_code_and_without_a_traceback(tmp_path: Path) -> None:
    ended = command("fit", str(tmp_path / "missing.stl"))
    assert (ended.returncode, ended.stdout) == (2, "")
    assert "Traceback" not in ended.stderr
    assert command("fit").returncode == 2
    assert command("fit", "x.stl", "--quality", "best").returncode == 2


def test_unknown_methods_and_devices(block: Path) -> None:
    shape = load_shape(block)
    for options in ({"method": "magic"}, {"device": "abacus"}):
        with pytest.raises(PartwrightError, match=r"expected one of|use one of"):
            fit(shape, **options)


def test_clean_after_a_fit(
    block: Path, method: BoxMethod, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    method.shrink = 0.998765
    assert main(["fit", str(block), "-o", str(tmp_path / "out"), "--clean", "--clean-tolerance", "0.02"]) == 0
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["clean"]["tolerance"] == 0.02
    assert report["seconds"]["clean"] > 0
    part = load_assembly(tmp_path / "out" / "assembly.json").parts[0]
    assert part.field == Box((4, 2, 1))
    assert part.translation == (10, 20, 30)
    assert "aligned" in {relation["kind"] for relation in report["clean"]["relations"]}
    assert "along the input's axes" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (["--clean-tolerance", "0.1"], "add --clean"),
        (["--clean", "--start", "a.json", "--lock", "a"], "clean or lock"),
    ],
)
def test_options_that_do_not_go_with_cleaning(
    options: list[str],
    says: str,
    block: Path,
    method: BoxMethod,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Assembly((Part(Box((1, 1, 1)), name="a"),)).save("a.json")
    assert main(["fit", str(block), "-o", str(tmp_path / "out"), *options]) == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
