"""Drag of a body by OpenFOAM, and the pressure on it."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from partwright.errors import SimulationError, SimulationLimitError
from partwright.goals.flow.air import Air
from partwright.goals.flow.case import write_case
from partwright.goals.flow.programs import PROGRAMS, SAMPLER, SOLVER, check_installed, run
from partwright.goals.flow.skin import Skin, read_vtk
from partwright.goals.flow.wheels import turn_wall

PRESSURE = "pressure"
_LAST = 0.25  # of the iterations, over which the force is averaged
_HUGE = 1e4  # drag area over the square of the longest side: diverged
_NUMBER = re.compile(r"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?")
_RESIDUAL = re.compile(r"Solving for (\w+), Initial residual = ([^,]+),")


@dataclass(frozen=True)
class Simulated:
    """drag_area: force along the flow over the dynamic pressure, m2: C_d times the area. swing: its standard
    deviation over the last quarter of the iterations. residuals: the last of each field. blockage: share of
    the air's cross-section that the body's bounding box takes. skin: the body as the simulation meshed it, in
    metres, with the pressure coefficient of each face."""

    drag_area: float
    swing: float
    iterations: int
    residuals: dict[str, float]
    blockage: float
    seconds: float
    skin: Skin

    def to_dict(self) -> dict[str, Any]:
        return {one.name: getattr(self, one.name) for one in fields(self) if one.name != "skin"}


def simulate(
    surface: trimesh.Trimesh,
    folder: Path,
    air: Air | None = None,
    metres: float = 1.0,
    speeds: np.ndarray | None = None,
) -> Simulated:
    """The drag of a closed surface, and the pressure on it; the case is left in `folder`, which is made.

    metres: length of the surface's unit. speeds: (F, 3) m/s of its faces, where parts of it turn (see
    `wheels`).

    Raises:
        MissingDependencyError: OpenFOAM is not installed.
        SimulationError: it failed, diverged, or ran out of time or disk; the message names the log.
    """
    check_installed()
    air, begun, log = air or Air(), time.monotonic(), ""
    try:
        blockage = write_case(surface, folder, air, metres)
        for command in PROGRAMS:
            if command is SOLVER and speeds is not None:
                turn_wall(folder, surface, speeds, metres)
            text = run(command, folder, air.time_limit - (time.monotonic() - begun))
            log = text if command is SOLVER else log
    except OSError as error:
        raise SimulationLimitError(f"{folder}: the case cannot be written: {error.strerror}") from error
    area = drag_areas(folder, air)
    longest = metres * float(np.ptp(surface.vertices, axis=0).max())
    if not len(area) or not np.isfinite(area).all() or abs(area[-1]) > _HUGE * longest**2:
        raise SimulationError(
            "the simulation diverged: no body has such a force", folder / f"log.{SOLVER[0]}"
        )
    last = area[-max(1, round(_LAST * len(area))) :]
    residuals = {name: float(value) for name, value in _RESIDUAL.findall(log)}
    skin = _skin(folder, air)
    seconds = time.monotonic() - begun
    return Simulated(float(last.mean()), float(last.std()), len(area), residuals, blockage, seconds, skin)


def _skin(folder: Path, air: Air) -> Skin:
    found = sorted(folder.glob("postProcessing/sample/*/body.vtk"))
    if not found:
        raise SimulationError("nothing was read off the body", folder / f"log.{SAMPLER[0]}")
    skin = read_vtk(found[-1])
    if "p" not in skin.fields:
        raise SimulationError(f"{found[-1]}: the pressure is missing")
    return Skin(skin.vertices, skin.faces, {PRESSURE: skin.fields["p"] / (0.5 * air.speed**2)})


def drag_areas(folder: Path, air: Air) -> np.ndarray:
    """(I,) drag area at each iteration, of the file that the solver's forces are written to."""
    found = sorted(folder.glob("postProcessing/forces/*/force*.dat"))
    rows = []
    for line in found[-1].read_text().splitlines() if found else []:
        numbers = [float(text) for text in _NUMBER.findall(line)] if not line.startswith("#") else []
        if len(numbers) >= 4:
            rows.append(numbers)
        elif "nan" in line.lower():
            rows.append([np.nan] * 4)
    return np.array([np.dot(row[1:4], air.direction) for row in rows]) / (0.5 * air.speed**2)
