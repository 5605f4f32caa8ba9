"""OpenFOAM's case, what is read back of it, and how it fails; the programs themselves are stood in for."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, load_assembly
from partwright.cli.main import main
from partwright.errors import (
    MissingDependencyError,
    SettingError,
    SimulationError,
    SimulationLimitError,
    UnreadableFileError,
)
from partwright.fields import Box
from partwright.goals.flow import Air, simulate
from partwright.goals.flow.case import write_case
from partwright.goals.flow.dataset import read, read_all, simulate_all
from partwright.goals.flow.programs import PROGRAMS
from partwright.goals.flow.simulation import PRESSURE
from partwright.goals.optimising import FILES
from partwright.goals.surface import surface_of

CUBE = surface_of(Assembly((Part(Box((1.0, 1.0, 1.0))),)), 8)
SOLVED = """
mkdir -p postProcessing/forces/0
for i in 1 2 3 4 5 6 7 8; do echo "$i ((450 0 0) (45 0 0))" >> postProcessing/forces/0/force.dat; done
echo "DILUPBiCG:  Solving for Ux, Initial residual = 0.5, Final residual = 1e-7, No Iterations 3"
echo "DILUPBiCG:  Solving for Ux, Initial residual = 0.001, Final residual = 1e-7, No Iterations 3"
"""
SAMPLED = """
mkdir -p postProcessing/sample/8
cat > postProcessing/sample/8/body.vtk <<END
# vtk DataFile Version 2.0
time='8'
ASCII
DATASET POLYDATA
FIELD FieldData 1
TimeValue 1 1 float
8

POINTS 4 float
0 0 0 1 0 0
0 1 0 0 0 1
POLYGONS 2 8
3 0 1 2
3 0 1 3
CELL_DATA 2
FIELD FieldData 2
U 3 2 float
1 2 3 4 5 6
p 1 2 float
450 -225
END
"""


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of programs that do nothing, and alone are found."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for command in PROGRAMS:
        write(folder / command[0], "")
    write(folder / "simpleFoam", SOLVED)
    write(folder / "postProcess", SAMPLED)
    monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")
    return folder


def write(path: Path, lines: str) -> None:
    path.write_text(f"#!/bin/sh\n{lines}")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def test_force_and_pressure_are_read_back_as_coefficients(stand_in: Path, tmp_path: Path) -> None:
    found = simulate(CUBE, tmp_path / "case", Air(speed=30.0))
    assert found.drag_area == pytest.approx(450 / (0.5 * 900))
    assert found.swing == 0
    assert found.iterations == 8
    assert found.residuals == {"Ux": 0.001}
    assert found.blockage == pytest.approx(1 / 49)
    assert found.skin.fields[PRESSURE].tolist() == [1.0, -0.5]
    assert found.skin.faces.tolist() == [[0, 1, 2], [0, 1, 3]]
    near = found.skin.vertices[found.skin.faces].mean(axis=1)
    assert found.skin.at(PRESSURE, near) == pytest.approx([1.0, -0.5], abs=1e-6)
    assert "skin" not in found.to_dict()


def test_the_case_has_the_body_and_its_air(tmp_path: Path) -> None:
    write_case(CUBE, tmp_path, Air("-x", cells=32), metres=0.001)
    block = (tmp_path / "system" / "blockMeshDict").read_text()
    assert "(-0.0065 -0.0035 -0.0035)" in block  # 6 lengths behind, as the air moves to -x
    assert "(40 28 28)" in block
    assert "inlet { type patch; faces ((1 2 6 5)); }" in block
    assert "ground" not in block
    assert "level (3 3)" in (tmp_path / "system" / "snappyHexMeshDict").read_text()
    assert "uniform (-30 0 0)" in (tmp_path / "0" / "U").read_text()
    assert (tmp_path / "constant" / "triSurface" / "body.stl").stat().st_size == 84 + 50 * len(CUBE.faces)
    assert not [p for p in tmp_path.rglob("*") if p.is_file() and p.suffix != ".stl" and "$" in p.read_text()]


@pytest.mark.parametrize(
    ("up", "side", "level"), [("z", "(0 3 2 1)", "-0.495"), ("-z", "(4 5 6 7)", "0.495")]
)
def test_what_stands_on_the_ground_stands_in_it(tmp_path: Path, up: str, side: str, level: str) -> None:
    blockage = write_case(CUBE, tmp_path, Air.of("y,ground,cells=8", up), 1.0)
    block = (tmp_path / "system" / "blockMeshDict").read_text()
    assert f"ground {{ type wall; faces ({side}); }}" in block
    assert f"-3.5 {level})" in block
    assert blockage == pytest.approx(1 / (7 * 3.995))


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("exit 1\n", "it ended with 1"),
        ("echo '--> FOAM FATAL ERROR:'; echo 'no cells'; exit 1\n", "it ended with 1.*no cells"),
        ("echo 'trapFpe: Floating point exception trapping enabled.'; exit 1\n", "it ended with 1"),
        ("echo '#0 Foam::sigFpe::sigHandler'; exit 136\n", "it diverged"),
        ("", "diverged"),
        (SOLVED.replace("450", "1e12"), "diverged"),
        ("sleep 30\n", "time limit"),
    ],
)
def test_a_solver_that_fails_is_told(stand_in: Path, tmp_path: Path, lines: str, said: str) -> None:
    write(stand_in / "simpleFoam", lines)
    with pytest.raises(SimulationError, match=said):
        simulate(CUBE, tmp_path / "case", Air(time_limit=1.5 if "sleep" in lines else 60.0))


@pytest.mark.parametrize("skin", ["", SAMPLED.replace("450", "nan"), SAMPLED.replace("p 1 2", "q 1 2")])
def test_a_skin_that_cannot_be_used_is_told(stand_in: Path, tmp_path: Path, skin: str) -> None:
    write(stand_in / "postProcess", skin)
    with pytest.raises(SimulationError, match=r"nothing was read|not finite|missing"):
        simulate(CUBE, tmp_path / "case")


def test_without_openfoam_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingDependencyError, match="apt-get install openfoam"):
        simulate(CUBE, tmp_path / "case")


@pytest.mark.parametrize(
    "text", ["w", "x,cells", "x,cells=many", "x,cells=2", "x,speed=0", "x,wind=3", "x,ground=1", "z,ground"]
)
def test_an_air_that_makes_no_sense_is_named(text: str) -> None:
    with pytest.raises(SettingError):
        Air.of(text)


def test_a_queue_goes_on_where_it_stopped(stand_in: Path, tmp_path: Path) -> None:
    bodies = [("a", CUBE), ("b", CUBE.copy().apply_scale(2.0))]
    first = simulate_all(bodies[:1], tmp_path / "flows", Air())
    told = []
    again = simulate_all(bodies, tmp_path / "flows", Air(), told.append, 2)
    assert [one.made for one in again] == [False, True]
    assert told == again
    assert first[0].drag_area == again[0].drag_area == 1.0
    assert simulate_all(bodies[:1], tmp_path / "flows", Air("y"))[0].made  # other air, other file
    sample = read(first[0].path)
    assert (sample.name, sample.air, sample.skin.fields[PRESSURE].tolist()) == ("a", Air(), [1.0, -0.5])
    assert sample.faces.tolist() == CUBE.faces.tolist()
    np.testing.assert_allclose(sample.vertices, CUBE.vertices, atol=1e-6)
    with pytest.raises(UnreadableFileError, match="another air"):
        list(read_all(tmp_path / "flows"))


def test_what_failed_is_written_down_and_not_tried_again(stand_in: Path, tmp_path: Path) -> None:
    write(stand_in / "simpleFoam", "exit 3\n")
    first, again = (simulate_all([("a", CUBE)], tmp_path, Air())[0] for _ in range(2))
    assert first.made
    assert not again.made
    assert "it ended with 3" in first.reason
    assert again.reason == first.reason
    with pytest.raises(UnreadableFileError, match="there is none"):
        list(read_all(tmp_path))


def test_what_ran_out_of_time_or_disk_is_tried_again(
    stand_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(stand_in / "simpleFoam", "sleep 30\n")
    late = simulate_all([("a", CUBE)], tmp_path, Air(time_limit=0.5))[0]
    assert "time limit" in late.reason
    assert late.reason.endswith(".failed.log")
    write(stand_in / "simpleFoam", "echo 'no room'; exit 1\n")
    with monkeypatch.context() as full:
        full.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=4096))
        filled = simulate_all([("a", CUBE)], tmp_path, Air())[0]
    assert "is full" in filled.reason
    assert filled.path.with_suffix(".failed.log").read_text() == "no room\n"  # the case itself is gone
    write(stand_in / "simpleFoam", SOLVED)
    solved = simulate_all([("a", CUBE)], tmp_path, Air())[0]
    assert solved.drag_area == 1.0
    assert list(tmp_path.glob("*.failed.*")) == []


def test_a_case_that_cannot_be_written_is_told(stand_in: Path, tmp_path: Path) -> None:
    (tmp_path / "case").write_text("a file")
    with pytest.raises(SimulationLimitError, match="cannot be written: "):
        simulate(CUBE, tmp_path / "case")


def test_a_simulation_that_fails_leaves_what_was_optimised_and_its_log(
    stand_in: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write(stand_in / "simpleFoam", "echo 'all about it'; exit 3\n")
    assembly = Assembly((Part(Box((1.0, 1.0, 1.0)), name="box"),))
    assembly.save(tmp_path / "box.json")
    out = tmp_path / "out"
    command = ["optimise", str(tmp_path / "box.json"), "-o", str(out), "--objective", "volume"]
    command += ["--steps", "1", "--resolution", "8"]
    assert main([*command, "--simulate", "x"]) == 2
    said = capsys.readouterr()
    assert "volume" in said.out
    assert f"see {out / 'simulation.log'}; {out} holds what was optimised" in said.err
    assert (out / "simulation.log").read_text() == "all about it\n"
    assert load_assembly(out / "assembly.json") != assembly
    assert main(command) == 0
    assert not (out / "simulation.log").exists()  # it is none of this result


def test_ctrl_c_in_a_simulation_leaves_what_was_optimised(
    stand_in: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The signal is sent by the solver, while it is waited for."""
    write(stand_in / "simpleFoam", f"kill -INT {os.getpid()}; sleep 30\n")
    Assembly((Part(Box((1.0, 1.0, 1.0)), name="box"),)).save(tmp_path / "box.json")
    out = tmp_path / "out"
    code = main(
        ["optimise", str(tmp_path / "box.json"), "-o", str(out), "--objective", "volume", "--steps", "1",
         "--resolution", "8", "--simulate", "x"]
    )  # fmt: skip
    assert code == 130
    assert "holds what was optimised" in capsys.readouterr().err
    assert {path.name for path in out.iterdir()} == set(FILES)


def test_files_that_are_no_simulated_bodies_are_named(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(b"PK\3\4 no archive")
    with pytest.raises(UnreadableFileError, match="expected a simulated body"):
        read(path)
    np.savez(path, about=np.frombuffer(b"{}", np.uint8))
    with pytest.raises(UnreadableFileError, match="expected a simulated body"):
        read(path)
