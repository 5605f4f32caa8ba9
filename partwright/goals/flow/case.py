"""An OpenFOAM case around a body, written from our own template (case.txt).

A box of air, meshed by snappyHexMesh without boundary layers; steady RANS with the Spalart-Allmaras model and
wall functions. Coarse on purpose: it ranks shapes in minutes.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np
import trimesh

from partwright.goals.flow.air import BACKGROUND, Air
from partwright.goals.objectives.axes import axis

_UPSTREAM, _DOWNSTREAM, _ASIDE = 3.0, 6.0, 3.0  # of the longest side, from the body's box
_SUNK = 0.005  # of the longest side: what stands on the ground stands in it
_VISCOSITY = 1.5e-5  # m2/s, of air
_TURBULENT = 5.0  # nuTilda over the viscosity in the air that comes in: fully turbulent
_HEADER = "FoamFile { version 2.0; format ascii; class %s; object %s; }\n"
# Of blockMesh's box: the corners of its face at the lower and at the upper end of each axis.
_SIDES = (("(0 4 7 3)", "(1 2 6 5)"), ("(0 1 5 4)", "(2 3 7 6)"), ("(0 3 2 1)", "(4 5 6 7)"))


def write_case(surface: trimesh.Trimesh, folder: Path, air: Air, metres: float) -> float:
    """Write the case's files into `folder`; the blockage, the share of the cross-section that the body takes.

    metres: length of the surface's unit.
    """
    flow = air.direction
    body = trimesh.Trimesh(metres * np.asarray(surface.vertices), surface.faces, process=False)
    lower, upper = body.bounds
    longest = float((upper - lower).max())
    before = np.where(flow > 0.5, _UPSTREAM, np.where(flow < -0.5, _DOWNSTREAM, _ASIDE)) * longest
    after = np.where(flow > 0.5, _DOWNSTREAM, np.where(flow < -0.5, _UPSTREAM, _ASIDE)) * longest
    low, high = lower - before, upper + after
    sides = {(i, end): _SIDES[i][end] for i in range(3) for end in (0, 1)}
    along, forward = int(np.abs(flow).argmax()), int(flow.sum() > 0)
    inlet, outlet = sides.pop((along, 1 - forward)), sides.pop((along, forward))
    inside = low + longest / BACKGROUND * np.array([0.31, 0.37, 0.41])  # on no face of a cell
    ground = ""
    if air.ground:
        up = axis(air.ground, "z", "ground")
        i, below = int(np.abs(up).argmax()), int(up.sum() < 0)
        level = (lower[i] + _SUNK * longest) if not below else (upper[i] - _SUNK * longest)
        low[i], high[i] = (low[i], level) if below else (level, high[i])
        ground = f"ground {{ type wall; faces ({sides.pop((i, below))}); }}"
        corner = high if not below else low
        inside[i] = corner[i] - up.sum() * longest / BACKGROUND * 0.41
    counts = np.ceil((high - low) / longest * BACKGROUND).astype(int)
    across = np.arange(3) != along
    values = {
        **{f"{name}0": f"{v:.9g}" for name, v in zip("xyz", low, strict=True)},
        **{f"{name}1": f"{v:.9g}" for name, v in zip("xyz", high, strict=True)},
        **{f"n{name}": n for name, n in zip("xyz", counts.tolist(), strict=True)},
        "inlet": inlet,
        "outlet": outlet,
        "sides": " ".join(sides.values()),
        "ground": ground,
        "iterations": air.iterations,
        "level": round(np.log2(air.cells / BACKGROUND)),
        "inside": _vector(inside),
        "velocity": _vector(air.speed * flow),
        "nu": f"{_VISCOSITY:g}",
        "nuTilda": f"{_TURBULENT * _VISCOSITY:g}",
    }
    template = files("partwright.goals.flow").joinpath("case.txt").read_text(encoding="utf-8")
    for entry in template.split("=== ")[1:]:
        name, _, text = entry.partition("\n")
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        kind = "volVectorField" if place.name == "U" else "volScalarField"
        header = _HEADER % (kind if name.startswith("0/") else "dictionary", place.name)
        place.write_text(header + Template(text).substitute(values), encoding="utf-8")
    (folder / "constant" / "triSurface").mkdir(parents=True, exist_ok=True)
    body.export(folder / "constant" / "triSurface" / "body.stl")
    return float(np.prod((upper - lower)[across]) / np.prod((high - low)[across]))


def _vector(values: np.ndarray) -> str:
    return " ".join(f"{v:.9g}" for v in values)
