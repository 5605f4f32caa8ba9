"""Drag by OpenFOAM: steady RANS (simpleFoam, k-omega SST) around a closed surface in free air.

The case is our own (openfoam_case.txt): a box of air with the body in it, meshed by snappyHexMesh without
boundary layers, wall functions, one far-field patch. Coarse on purpose: it ranks shapes in minutes, and says
how far its force still swings. There is no ground, and nothing turns.
"""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import time
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

import numpy as np
import trimesh

from partwright.errors import MissingDependencyError, SettingError, SimulationError

PROGRAMS = ("blockMesh", "snappyHexMesh", "simpleFoam")
_HOME = "/usr/share/openfoam"  # of Debian's package, which sets no environment
_UPSTREAM, _DOWNSTREAM, _ASIDE = 3.0, 6.0, 3.0  # of the longest side, from the body's box
_BACKGROUND = 4  # cells along the longest side, far away
_AIR = 1.5e-5  # kinematic viscosity, m2/s
_INTENSITY = 0.01  # of the turbulence that comes in
_LAST = 0.25  # of the iterations, over which the force is averaged
_HUGE = 1e4  # drag area over the square of the longest side: diverged
_HEADER = "FoamFile { version 2.0; format ascii; class %s; object %s; }\n"
_FORCE = re.compile(r"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?")
_RESIDUAL = re.compile(r"Solving for (\w+), Initial residual = ([^,]+),")


@dataclass(frozen=True)
class Air:
    """How a body is simulated. speed: m/s. cells: along its longest side, near it (4, 8, 16, 32 ...).
    iterations: of the steady solver. time_limit: seconds, of all programs together."""

    speed: float = 30.0
    cells: int = 32
    iterations: int = 300
    time_limit: float = 1800.0


@dataclass(frozen=True)
class Simulated:
    """drag_area: force along the flow over the dynamic pressure, m2: C_d times the area. swing: its standard
    deviation over the last quarter of the iterations. residuals: the last of each field. blockage: share of
    the air's cross-section that the body's bounding box takes."""

    drag_area: float
    swing: float
    iterations: int
    residuals: dict[str, float]
    blockage: float
    seconds: float

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


def check_installed() -> None:
    """Raises MissingDependencyError unless OpenFOAM's programs are found."""
    missing = [program for program in PROGRAMS if shutil.which(program) is None]
    if missing:
        raise MissingDependencyError(
            f"OpenFOAM is needed to simulate a flow, and {', '.join(missing)} cannot be found: "
            "apt-get install openfoam (Debian, Ubuntu), or source the bashrc of your installation first"
        )


def simulate(
    surface: trimesh.Trimesh, flow: np.ndarray, folder: Path, air: Air | None = None, metres: float = 1.0
) -> Simulated:
    """The drag of a closed surface; the case is left in `folder`, which is made.

    flow: (3,) unit vector along an axis, in which the air moves. metres: length of the surface's unit.

    Raises:
        MissingDependencyError: OpenFOAM is not installed.
        SimulationError: it failed, diverged, or took too long; the message names the log.
    """
    check_installed()
    air, begun = air or Air(), time.monotonic()
    blockage = write_case(surface, flow, folder, air, metres)
    for program in PROGRAMS:
        left = air.time_limit - (time.monotonic() - begun)
        _run([program, *(["-overwrite"] if program == "snappyHexMesh" else [])], folder, left)
    area = drag_areas(folder, flow, air.speed)
    longest = metres * float(np.ptp(surface.vertices, axis=0).max())
    log = (folder / "log.simpleFoam").read_text(errors="replace")
    if not len(area) or not np.isfinite(area).all() or abs(area[-1]) > _HUGE * longest**2:
        raise SimulationError(f"the simulation diverged: see {folder / 'log.simpleFoam'}")
    last = area[-max(1, round(_LAST * len(area))) :]
    residuals = {name: float(value) for name, value in _RESIDUAL.findall(log)}
    seconds = time.monotonic() - begun
    return Simulated(float(last.mean()), float(last.std()), len(area), residuals, blockage, seconds)


def write_case(surface: trimesh.Trimesh, flow: np.ndarray, folder: Path, air: Air, metres: float) -> float:
    """Write the case's files into `folder`; the blockage.

    Raises:
        SettingError: a number of the air cannot be used.
    """
    if not (air.speed > 0 and air.cells >= _BACKGROUND and air.iterations >= 1 and air.time_limit > 0):
        raise SettingError(
            f"expected a positive speed, time and iterations, and {_BACKGROUND} cells, got {air}"
        )
    body = trimesh.Trimesh(metres * np.asarray(surface.vertices), surface.faces, process=False)
    lower, upper = body.bounds
    longest = float((upper - lower).max())
    before = np.where(flow > 0.5, _UPSTREAM, np.where(flow < -0.5, _DOWNSTREAM, _ASIDE)) * longest
    after = np.where(flow > 0.5, _DOWNSTREAM, np.where(flow < -0.5, _UPSTREAM, _ASIDE)) * longest
    low, high = lower - before, upper + after
    counts = np.ceil((high - low) / longest * _BACKGROUND).astype(int)
    k = 1.5 * (_INTENSITY * air.speed) ** 2
    across = np.abs(flow) < 0.5
    blockage = float(np.prod((upper - lower)[across]) / np.prod((high - low)[across]))
    values = {
        **{f"{axis}0": f"{v:.9g}" for axis, v in zip("xyz", low, strict=True)},
        **{f"{axis}1": f"{v:.9g}" for axis, v in zip("xyz", high, strict=True)},
        **{f"n{axis}": n for axis, n in zip("xyz", counts.tolist(), strict=True)},
        "iterations": air.iterations,
        "level": round(np.log2(air.cells / _BACKGROUND)),
        # No face of a cell there: a third of a cell from the corner of the box.
        "inside": _vector(low + longest / _BACKGROUND * np.array([0.31, 0.37, 0.41])),
        "velocity": _vector(air.speed * flow),
        "nu": f"{_AIR:g}",
        "k": f"{k:g}",
        "omega": f"{np.sqrt(k) / (0.09**0.25 * 0.1 * longest):g}",
    }
    template = files("partwright.goals").joinpath("openfoam_case.txt").read_text(encoding="utf-8")
    for entry in template.split("=== ")[1:]:
        name, _, text = entry.partition("\n")
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        kind = {"U": "volVectorField"}.get(place.name, "volScalarField")
        header = _HEADER % (kind if name.startswith("0/") else "dictionary", place.name)
        place.write_text(header + Template(text).substitute(values), encoding="utf-8")
    (folder / "constant" / "triSurface").mkdir(parents=True, exist_ok=True)
    body.export(folder / "constant" / "triSurface" / "body.stl")
    return blockage


def drag_areas(folder: Path, flow: np.ndarray, speed: float) -> np.ndarray:
    """(I,) drag area at each iteration, of the file that the solver's forces are written to."""
    found = sorted(folder.glob("postProcessing/forces/*/force*.dat"))
    rows = []
    for line in found[-1].read_text().splitlines() if found else []:
        numbers = [float(text) for text in _FORCE.findall(line)] if not line.startswith("#") else []
        if len(numbers) >= 4:
            rows.append(numbers)
        elif "nan" in line.lower():
            rows.append([np.nan] * 4)
    return np.array([np.dot(row[1:4], flow) for row in rows]) / (0.5 * speed**2)


def _run(command: list[str], folder: Path, seconds: float) -> None:
    log = folder / f"log.{command[0]}"
    environment = {"WM_PROJECT_DIR": _HOME, **os.environ} if Path(_HOME).is_dir() else dict(os.environ)
    with log.open("wb") as out:
        process = subprocess.Popen(
            command, cwd=folder, stdout=out, stderr=subprocess.STDOUT, env=environment, start_new_session=True
        )
        try:
            code = process.wait(max(seconds, 0.1))
        except BaseException as error:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            if isinstance(error, subprocess.TimeoutExpired):
                raise SimulationError(f"{command[0]} did not end within the time limit: see {log}") from error
            raise
    if code:
        text = log.read_text(errors="replace")
        why = (
            "it diverged"
            if "Floating point exception" in text or "sigFpe" in text
            else f"it ended with {code}"
        )
        raise SimulationError(f"{command[0]} failed ({why}): see {log}")


def _vector(values: np.ndarray) -> str:
    return " ".join(f"{v:.9g}" for v in values)
