"""Slopes of drag by OpenFOAM's adjoint solver, beside differences of simulated shapes.

    python benchmarks/adjoint.py --rows rows.jsonl [--cases laminar turbulent frozen cells]

A spheroid, five long and two thick, in four kinds of cases: laminar at a Reynolds number of 500 by its
length; turbulent (Spalart-Allmaras, wall functions) at a million, with the turbulence's own adjoint or a
frozen viscosity, all three on a mesh that follows the body and moves with it; and turbulent on the mesh that
`partwright optimise --simulate` makes, 32 cells along it, where the adjoint solver holds only with its
transpose convection left out at the wall. It needs adjointOptimisationFoam. What --rows holds is not measured
again. The table goes to benchmarks/results/adjoint.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from string import Template

import numpy as np
import trimesh

from partwright.goals.flow import Air, simulate
from partwright.goals.flow.case import write_case
from partwright.goals.flow.programs import run
from partwright.goals.flow.wheels import body_faces

TARGET = Path(__file__).parent / "results" / "adjoint.md"
CASES = ("laminar", "turbulent", "frozen", "cells")
HALF = np.array([2.5, 1.0, 1.0])
ACROSS, OUTWARDS, FAR, GROWTH = 10, 28, 8.0, 40.0  # cells a side of each of six blocks, size, last over first
STEP = 0.03  # of each mode, both ways
SECONDS = 1500.0
HEADER = "FoamFile { version 2.0; format ascii; class %s; object %s; }\n"
WALL_LEFT_OUT = (
    "ATCModel standard; extraConvection 0; nSmooth 0; zeroATCPatchTypes (wall); maskType faceCells;"
)
AIR = Air("x", iterations=150, time_limit=SECONDS)

Move = Callable[[np.ndarray], np.ndarray]


def bulge(at: float) -> Move:
    """Thicker around a place along the flow."""
    return lambda p: p * [0, 1, 1] * np.exp(-(((p[:, :1] - at) / 0.8) ** 2))


MODES: dict[str, Move] = {
    "longer": lambda p: p * [1, 0, 0],
    "taller": lambda p: p * [0, 1, 0],
    "thicker behind": bulge(1.5),
    "thicker in front": bulge(-1.5),
}


@dataclass(frozen=True)
class Row:
    """Derivative of the drag area (of a body 5 long) by the amount of a mode, by both, and the adjoint
    pressure's last residual."""

    case: str
    mode: str
    adjoint: float
    difference: float
    residual: float


def written(folder: Path, template: str, values: dict[str, object]) -> None:
    """Every file of a template beside this script."""
    text = Template(Path(__file__).with_name(template).read_text(encoding="utf-8")).substitute(values)
    for section in text.split("=== ")[1:]:
        name, _, body = section.partition("\n")
        kind = "volVectorField" if name in ("0/U", "0/Ua") else "volScalarField"
        entry(folder, name, body, kind if name.startswith("0/") else "dictionary")


def entry(folder: Path, name: str, text: str, kind: str = "dictionary") -> None:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(HEADER % (kind, path.name) + text, encoding="utf-8")


def blocks() -> str:
    """Six blocks between two cubes."""
    corners = [(x * s, y * s, z * s) for s in (1.0, FAR) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    sides = ((0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5))
    inner = []
    for a, b, c, d in sides:
        p = np.array([corners[i] for i in (a, b, c, d)])
        outwards = np.cross(p[1] - p[0], p[3] - p[0]) @ p.mean(axis=0) > 0
        inner.append((a, b, c, d) if outwards else (d, c, b, a))

    def listed(shift: int) -> str:
        return " ".join(f"({' '.join(str(i + shift) for i in side)})" for side in inner)

    cells = "\n".join(
        f"hex ({' '.join(map(str, (*side, *(i + 8 for i in side))))}) ({ACROSS} {ACROSS} {OUTWARDS}) "
        "simpleGrading (1 1 1)"
        for side in inner
    )
    points = "\n".join("({} {} {})".format(*point) for point in corners)
    patches = f"body {{ type wall; faces ({listed(0)}); }} far {{ type patch; faces ({listed(8)}); }}"
    return f"convertToMeters 1;\nvertices ({points});\nblocks ({cells});\nboundary ({patches});\n"


def on_blocks(folder: Path, case: str, move: Move, adjoint: bool) -> None:
    """A case whose mesh follows the body, which is the spheroid and what `move` adds to its points."""
    turbulent = case != "laminar"
    viscosity = 5e-6 if turbulent else 0.01
    iterations, more = (250, 500) if turbulent else (150, 250)
    model = "RAS; RAS { RASModel SpalartAllmaras; turbulence on; printCoeffs off; }"
    values = {
        "end": iterations + more if adjoint else iterations,
        "back": "upwind" if turbulent else "linearUpwind gradUaConv",
        "nu": viscosity,
        "still": 3 * viscosity,
        "turbulence": model if turbulent else "laminar;",
        "iterations": iterations,
        "adjoint": more,
        "speed": 1,
        "atc": "ATCModel standard;",
        "model": "adjointSpalartAllmaras" if case == "turbulent" else "adjointLaminar",
    }
    written(folder, "adjoint_on_blocks.txt", values)
    entry(folder, "system/blockMeshDict", blocks())
    run(("blockMesh",), folder, SECONDS)
    points = folder / "constant" / "polyMesh" / "points"
    moved = around(read_points(points), move)
    rows = "\n".join("({:.15g} {:.15g} {:.15g})".format(*row) for row in moved)
    points.write_text(HEADER % ("vectorField", "points") + f"{len(moved)}\n(\n{rows}\n)\n")
    run(("adjointOptimisationFoam" if adjoint else "simpleFoam",), folder, SECONDS)


def around(points: np.ndarray, move: Move) -> np.ndarray:
    """Points between two cubes, moved to lie between the body and the outer one, denser near the body."""
    reach = np.abs(points).max(axis=1, keepdims=True)
    cube = points / reach
    ball = np.tan(cube * np.pi / 4)
    body = ball / np.linalg.norm(ball, axis=1, keepdims=True) * HALF
    share = (GROWTH ** ((reach - 1) / (FAR - 1)) - 1) / (GROWTH - 1)
    return (1 - share) * (body + move(body)) + share * FAR * cube


def read_points(path: Path) -> np.ndarray:
    text = path.read_text()
    rows = re.findall(r"\(([^()]*)\)", text[text.index("(", text.index("object")) + 1 :])
    return np.array([[float(word) for word in row.split()] for row in rows])


def slopes(folder: Path, modes: dict[str, Move]) -> tuple[dict[str, float], float]:
    """Of the drag area by each mode, from the map on the body; and the adjoint pressure's residual."""
    corners = body_faces(folder)
    centres = np.array([face.mean(axis=0) for face in corners])
    areas = np.array([np.cross(face, np.roll(face, -1, axis=0)).sum(axis=0) / 2 for face in corners])
    last = max((p for p in folder.iterdir() if p.name.isdigit()), key=lambda p: int(p.name))
    text = (last / "faceSensNormaldragESI").read_text()
    start = re.search(r"body\s*\{[^}]*?List<scalar>\s*\d+\s*\(", text, re.S)
    assert start is not None
    values = np.array(text[start.end() :].split(None, len(corners))[: len(corners)], dtype=float)
    # Faces of the mesh look out of the air, into the body: so does the displacement of the map.
    found = {
        name: float((values * (move(centres) * areas).sum(axis=1)).sum()) for name, move in modes.items()
    }
    log = (folder / "log.adjointOptimisationFoam").read_text()
    return found, float(re.findall(r"Solving for pa, Initial residual = ([^,]+)", log)[-1])


def drag_area(folder: Path) -> float:
    """Mean over the last quarter, of unit speed."""
    lines = (folder / "postProcessing" / "forces" / "0" / "force.dat").read_text().splitlines()
    number = re.compile(r"[-+]?\d[\d.]*(?:[eE][-+]?\d+)?")
    along = [float(number.findall(line)[1]) for line in lines if not line.startswith("#")]
    return 2 * float(np.mean(along[-max(1, len(along) // 4) :]))


def measured_on_blocks(case: str, known: dict[str, float]) -> list[Row]:
    """known: differences by mode, where another case of the same flow has them."""
    with tempfile.TemporaryDirectory() as folder:
        on_blocks(Path(folder), case, lambda p: 0 * p, True)
        found, residual = slopes(Path(folder), MODES)
    rows = []
    for name, move in MODES.items():
        difference = known.get(name)
        if difference is None:
            areas = [changed_area(case, move, step) for step in (STEP, -STEP)]
            difference = (areas[0] - areas[1]) / (2 * STEP)
        rows.append(Row(case, name, found[name], difference, residual))
        print(rows[-1], flush=True)
    return rows


def changed_area(case: str, move: Move, step: float) -> float:
    with tempfile.TemporaryDirectory() as folder:
        on_blocks(Path(folder), case, lambda p: step * move(p), False)
        return drag_area(Path(folder))


def measured_on_cells(case: str) -> list[Row]:
    """On the mesh that simulations have."""
    ball = trimesh.creation.icosphere(4)
    body = trimesh.Trimesh(ball.vertices * HALF, ball.faces, process=False)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_case(body, folder, AIR, 1.0)
        values = {
            "end": AIR.iterations + 150,
            "iterations": AIR.iterations,
            "adjoint": 150,
            "speed": AIR.speed,
            "atc": WALL_LEFT_OUT,
            "model": "adjointSpalartAllmaras",
        }
        written(folder, "adjoint_on_cells.txt", values)
        for command in (("blockMesh",), ("snappyHexMesh", "-overwrite"), ("adjointOptimisationFoam",)):
            run(command, folder, SECONDS)
        found, residual = slopes(folder, MODES)
    rows = []
    for mode, move in MODES.items():
        areas = []
        for step in (STEP, -STEP):
            moved = body.vertices + step * move(body.vertices)
            with tempfile.TemporaryDirectory() as name:
                changed = trimesh.Trimesh(moved, body.faces, process=False)
                areas.append(simulate(changed, Path(name, "case"), AIR).drag_area)
        rows.append(Row(case, mode, found[mode], (areas[0] - areas[1]) / (2 * STEP), residual))
        print(rows[-1], flush=True)
    return rows


TOLD = {
    "laminar": "laminar, mesh that follows the body",
    "turbulent": "turbulent, mesh that follows the body",
    "frozen": "the same, adjoint with frozen turbulence",
    "cells": "turbulent, mesh of `--simulate`",
}


def document(rows: list[Row]) -> str:
    lines = [
        "# Slopes of drag by an adjoint solver",
        "",
        "`python benchmarks/adjoint.py`; adjointOptimisationFoam of OpenFOAM 1912, a spheroid 5 long and 2",
        "thick. Derivatives of the drag area by four changes of the shape, by the adjoint solver's map on",
        f"the surface and by simulations of shapes changed by {STEP} both ways. Residual: the last one of",
        "the adjoint pressure. Alike: cosine between the four slopes of either kind.",
        "",
        "| case | change | adjoint | differences | residual | alike |",
        "|---|---|---:|---:|---:|---:|",
    ]
    for case in CASES:
        own = [row for row in rows if row.case == case]
        ours, theirs = (np.array([getattr(row, name) for row in own]) for name in ("adjoint", "difference"))
        for row in own:
            alike = f"{ours @ theirs / np.linalg.norm(ours) / np.linalg.norm(theirs):.2f}"
            lines.append(
                f"| {TOLD[case]} | {row.mode} | {row.adjoint:+.3f} | {row.difference:+.3f} | "
                f"{row.residual:.0e} | {alike} |"
            )
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rows", type=Path, required=True, help="measured rows, kept between runs")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES))
    options = parser.parse_args()
    kept = options.rows.read_text().splitlines() if options.rows.exists() else []
    rows = [Row(**json.loads(line)) for line in kept]
    for case in options.cases:
        if any(row.case == case for row in rows):
            continue
        same = {row.mode: row.difference for row in rows if {row.case, case} == {"turbulent", "frozen"}}
        more = measured_on_cells(case) if case == "cells" else measured_on_blocks(case, same)
        rows += more
        with options.rows.open("a") as file:
            file.writelines(json.dumps(dataclasses.asdict(row)) + "\n" for row in more)
        TARGET.write_text(document(rows), encoding="utf-8")
    print(document(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
