"""OpenFOAM's case, what is read back of it, and how it fails; the programs themselves are stood in for."""

from __future__ import annotations

import stat
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.errors import MissingDependencyError, SettingError, SimulationError
from partwright.fields import Box
from partwright.goals.openfoam import PROGRAMS, Air, simulate, write_case
from partwright.goals.surface import surface_of

FLOW = np.array([1.0, 0.0, 0.0])
CUBE = surface_of(Assembly((Part(Box((1.0, 1.0, 1.0))),)), 8)
SOLVED = """
mkdir -p postProcessing/forces/0
for i in 1 2 3 4 5 6 7 8; do echo "$i ((450 0 0) (45 0 0))" >> postProcessing/forces/0/force.dat; done
echo "DILUPBiCG:  Solving for Ux, Initial residual = 0.5, Final residual = 1e-7, No Iterations 3"
echo "DILUPBiCG:  Solving for Ux, Initial residual = 0.001, Final residual = 1e-7, No Iterations 3"
"""


@pytest.fixture
def stand_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of programs that do nothing, and alone are found."""
    folder = tmp_path / "bin"
    folder.mkdir()
    for name in PROGRAMS:
        write(folder / name, "")
    monkeypatch.setenv("PATH", f"{folder}:/usr/bin:/bin")
    return folder


def write(path: Path, lines: str) -> None:
    path.write_text(f"#!/bin/sh\n{lines}")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)


def test_the_force_is_read_back_as_a_drag_area(stand_in: Path, tmp_path: Path) -> None:
    write(stand_in / "simpleFoam", SOLVED)
    found = simulate(CUBE, FLOW, tmp_path / "case", Air(speed=30.0))
    assert found.drag_area == pytest.approx(450 / (0.5 * 900))
    assert found.swing == 0
    assert found.iterations == 8
    assert found.residuals == {"Ux": 0.001}
    assert found.blockage == pytest.approx(1 / 49)


def test_the_case_has_the_body_and_its_air(tmp_path: Path) -> None:
    write_case(CUBE, -FLOW, tmp_path, Air(cells=32), metres=0.001)
    block = (tmp_path / "system" / "blockMeshDict").read_text()
    assert "(-0.0065 -0.0035 -0.0035)" in block  # 6 lengths behind, as the air moves to -x
    assert "(40 28 28)" in block
    assert "level (3 3)" in (tmp_path / "system" / "snappyHexMeshDict").read_text()
    assert "uniform (-30 -0 -0)" in (tmp_path / "0" / "U").read_text()
    assert (tmp_path / "constant" / "triSurface" / "body.stl").stat().st_size == 84 + 50 * len(CUBE.faces)
    assert not [p for p in tmp_path.rglob("*") if p.is_file() and p.suffix != ".stl" and "$" in p.read_text()]


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        ("exit 1\n", "it ended with 1"),
        ("echo '#0 Foam::sigFpe::sigHandler'; exit 136\n", "it diverged"),
        ("", "diverged"),
        (SOLVED.replace("450", "1e12"), "diverged"),
        ("sleep 30\n", "time limit"),
    ],
)
def test_a_solver_that_fails_is_told(stand_in: Path, tmp_path: Path, lines: str, said: str) -> None:
    write(stand_in / "simpleFoam", lines)
    with pytest.raises(SimulationError, match=said):
        simulate(CUBE, FLOW, tmp_path / "case", Air(time_limit=1.5 if "sleep" in lines else 60.0))


def test_without_openfoam_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MissingDependencyError, match="apt-get install openfoam"):
        simulate(CUBE, FLOW, tmp_path / "case")
    with pytest.raises(SettingError, match="expected a positive speed"):
        write_case(CUBE, FLOW, tmp_path, Air(speed=0.0), 1.0)
