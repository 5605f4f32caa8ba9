"""How good the CSG trees of `--method capri` are: CAPRI-Net's measures, other methods beside them, ablations.

    python benchmarks/capri.py --shapes FOLDER --sets cad --rows mesh,voxels,points,solids,superfrusta
    python benchmarks/capri.py --shapes FOLDER --names fandisk,featuretype --rows planes,union

A row is an input and a way to fit it (`ROWS`). Voxels are 64^3 occupancies and point clouds 8,192 points with
normals, as in the paper's sections 4.2 and 4.3; whatever the input was, the mesh is what is scored against.
FOLDER holds an index.json (a list of {"name", "set", "file"}), or just meshes. Each fit appends its scores to
benchmarks/results/capri.csv, and what is there is not fitted again, so a run can be cut off and go on:
`--again` fits anew. The tables in capri.md beside it are brought up to date after every fit.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, median
from typing import Any

import numpy as np
import recorded
from fit import OWN_SHAPES, Entry, find_shapes, machine

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.errors import PartwrightError
from partwright.methods import METHODS, FitRequest
from partwright.methods import Run as MethodRun
from partwright.metrics.cad import cad_scores
from partwright.metrics.complexity import convexes, distinct_primitives, primitives
from partwright.shapes import Shape
from partwright.shapes.sampling import sample_triangles

RESULTS = Path(__file__).parent / "results" / "capri.csv"
VOXELS = 64  # along a side of [-1, 1]^3 (section 4.2)
POINTS = 8192  # section 4.3

NOTES = (  # what the present table is made of; to be taken out when all of its rows are run anew
    "From the mesh, voxels and points: run after convexes alike became copies of one, and after places far",
    "off are mended; the other rows lack both, and their seconds are those of a slower machine.",
)


@dataclass(frozen=True)
class Row:
    """A way to fit: `given` is mesh, voxels or points; `changes` go into the method's settings."""

    about: str
    given: str = "mesh"
    method: str = "capri"
    changes: dict[str, Any] = field(default_factory=dict)


ROWS = {
    "mesh": Row("capri, from the mesh"),
    "voxels": Row("capri, from 64^3 voxels", given="voxels"),
    "points": Row("capri, from 8,192 points with normals", given="points"),
    "solids": Row("solids (ResFit), from the mesh", method="solids"),
    "superfrusta": Row("superfrusta (ResFit), from the mesh", method="superfrusta"),
    "planes": Row("planes only", changes={"kinds": ("plane",)}),
    "weights": Row("from the pre-trained network alone", changes={"start": "weights"}),
    "auto": Row("from both, the cheaper tree", changes={"start": "auto"}),
    "union": Row("without difference", changes={"subtract": False, "nested": False}),
    "flat": Row("without difference within a convex (the paper's form)", changes={"nested": False}),
    "aligned": Row("without cross terms (the paper's quadrics)", changes={"oriented": False}),
    "seven": Row("without cones and general quadrics", changes={"kinds": ("plane", "cylinder", "sphere")}),
    "first": Row("without ruin and recreate", changes={"tries": 0}),
    "cheap": Row("a tenth of the prices", changes={"price": 6e-5, "convex_price": 3e-4}),
    "double": Row("2.3 times the price of a convex", changes={"convex_price": 7e-3}),
    "dear": Row("five times the price of a convex", changes={"convex_price": 1.5e-2}),
    "paper": Row("the paper's schedule from the tree found, 3 x 1,000 iterations",
                 changes={"schedule": "paper", "iterations": 1000}),
    "paper-voxels": Row("the same, supervised by voxel centres", given="voxels",
                        changes={"schedule": "paper", "iterations": 1000, "supervision": "voxels"}),
    "tenth": Row("the paper's schedule from the pre-trained network, 3 x 1,200 iterations",
                 changes={"schedule": "paper", "start": "weights", "iterations": 1200}),
    "whole": Row("the same, 3 x 12,000 iterations (the paper's)",
                 changes={"schedule": "paper", "start": "weights"}),
}  # fmt: skip


@dataclass(frozen=True)
class Run:
    """One fit. Scores are those of `partwright.metrics.cad`; None where the fit failed. primitives, convexes:
    with every copy of what repeats, a primitive in every convex that has it; ..._once: without copies.
    distinct_primitives: one that convexes share counts once; distinct_once: and without copies."""

    name: str
    row: str
    outcome: str
    chamfer: float | None = None
    chamfer_floor: float | None = None
    normal_consistency: float | None = None
    normal_consistency_floor: float | None = None
    edge_chamfer: float | None = None
    edge_chamfer_floor: float | None = None
    light_field_distance: float | None = None
    primitives: float | None = None
    convexes: float | None = None
    seconds: float = 0.0
    cpu_seconds: float = 0.0
    primitives_once: float | None = None
    convexes_once: float | None = None
    distinct_primitives: float | None = None
    distinct_once: float | None = None

    @property
    def excess(self) -> float | None:
        """Chamfer distance above its floor."""
        return (
            None if self.chamfer is None or self.chamfer_floor is None else self.chamfer - self.chamfer_floor
        )


def fit_once(entry: Entry, name: str, seed: int, threads: int) -> Run:
    """Fits one shape one way and scores it."""
    row = ROWS[name]
    shape = pw.load_shape(entry.path)
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        counted = {"named": False} if row.method == "capri" else {}  # #P and #C are of quadrics
        settings = METHODS[row.method].settings(**row.changes, **counted)
        fitted = FitRequest(GIVEN[row.given](shape), settings, MethodRun(seed, threads=threads)).fitted()
        cost = {"seconds": time.perf_counter() - wall, "cpu_seconds": time.process_time() - cpu}
        measured = cad_scores(fitted.assembly.expanded(), shape, seed=seed).to_dict()
        measured |= {
            "distinct_primitives": distinct_primitives(fitted.assembly.expanded()),
            "distinct_once": distinct_primitives(fitted.assembly, groups_once=True),
            "primitives_once": primitives(fitted.assembly, groups_once=True),
            "convexes_once": convexes(fitted.assembly, groups_once=True),
        }
    except PartwrightError as error:
        return Run(entry.name, name, f"failed: {error}".replace("|", "/"))
    del measured["points"]
    return Run(entry.name, name, fitted.outcome, **measured, **cost)


def as_voxels(shape: Shape) -> Shape:
    """From the occupancies of 64^3 voxels of the unit frame, in the shape's own units and place."""
    step = 2 / VOXELS
    centres = (np.arange(VOXELS) + 0.5) * step - 1
    grid = np.stack(np.meshgrid(centres, centres, centres, indexing="ij"), axis=-1).reshape(-1, 3)
    occupied = (shape.unit_distance(grid) < 0).reshape(VOXELS, VOXELS, VOXELS)
    origin = shape.frame.from_unit(np.full((1, 3), centres[0]))[0]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "voxels.npz"
        np.savez(path, occupancy=occupied, origin=origin, spacing=shape.frame.length_from_unit(step))
        return pw.load_shape(path)


def as_points(shape: Shape) -> Shape:
    """From 8,192 points of the surface with the normals of their triangles."""
    points, face = sample_triangles(shape.vertices, shape.faces, POINTS, 0)
    a, b, c = (shape.vertices[shape.faces[face, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    return pw.load_shape(np.c_[points, normal / np.linalg.norm(normal, axis=1, keepdims=True)])


GIVEN: dict[str, Callable[[Shape], Shape]] = {
    "mesh": lambda shape: shape,
    "voxels": as_voxels,
    "points": as_points,
}


def read(path: Path) -> list[Run]:
    """The runs of a CSV file that `append` wrote; the last one of the same shape and row counts."""
    runs = recorded.read(path, Run)
    return list({(run.name, run.row): run for run in runs}.values())


# header, how many digits, times what, and the number
COLUMNS: dict[str, tuple[int, float, Callable[[Run], float | None]]] = {
    "CD x1e3": (3, 1e3, lambda run: run.chamfer),
    "above floor": (3, 1e3, lambda run: run.excess),
    "NC": (3, 1.0, lambda run: run.normal_consistency),
    "its ceiling": (3, 1.0, lambda run: run.normal_consistency_floor),
    "ECD x1e3": (2, 1e3, lambda run: run.edge_chamfer),
    "LFD": (0, 1.0, lambda run: run.light_field_distance),
    "#P": (1, 1.0, lambda run: run.primitives),
    "#C": (1, 1.0, lambda run: run.convexes),
    "#P distinct": (1, 1.0, lambda run: run.distinct_primitives),
    "#P distinct, once": (1, 1.0, lambda run: run.distinct_once),
    "#P once": (1, 1.0, lambda run: run.primitives_once),
    "#C once": (1, 1.0, lambda run: run.convexes_once),
    "CPU s": (0, 1.0, lambda run: run.cpu_seconds),
}


def cells(runs: list[Run], reduce: Callable[[list[float]], float]) -> str:
    """One value a column over the runs that have it."""
    shown = []
    for digits, factor, value in COLUMNS.values():
        known = [number for run in runs if (number := value(run)) is not None]
        shown.append(f"{reduce(known) * factor:.{digits}f}" if known else "-")
    return " | ".join(shown)


def summary(runs: list[Run], names: list[str]) -> Iterator[str]:
    """A line a row: medians over the named shapes, and means of what the paper gives means of."""
    yield f"| row | shapes | | {' | '.join(COLUMNS)} |"
    yield "|---|---:|---|" + "---:|" * len(COLUMNS)
    for key, row in ROWS.items():
        of = [run for run in runs if run.row == key and run.name in names]
        good = [run for run in of if run.chamfer is not None]
        if not good:
            continue
        failed = f", {len(of) - len(good)} failed" if len(good) < len(of) else ""
        yield f"| {row.about} | {len(good)}{failed} | median | {cells(good, median)} |"
        yield f"| | | mean | {cells(good, mean)} |"


def ablations(runs: list[Run]) -> Iterator[str]:
    """For every ablation, the default over the same shapes beside it."""
    yield f"| row | shapes | {' | '.join(COLUMNS)} |"
    yield "|---|---:|" + "---:|" * len(COLUMNS)
    default = {run.name: run for run in runs if run.row == "mesh" and run.chamfer is not None}
    for key in list(ROWS)[5:]:
        good = [run for run in runs if run.row == key and run.chamfer is not None and run.name in default]
        if good:
            yield f"| {ROWS[key].about} | {len(good)} | {cells(good, mean)} |"
            beside = [default[run.name] for run in good]
            yield f"| &nbsp; default, the same shapes | | {cells(beside, mean)} |"


def by_shape(runs: list[Run], key: str) -> Iterator[str]:
    yield f"| shape | {' | '.join(COLUMNS)} |"
    yield "|---|" + "---:|" * len(COLUMNS)
    for run in sorted((run for run in runs if run.row == key), key=lambda run: run.name):
        yield f"| {run.name} | {cells([run], mean) if run.chamfer is not None else run.outcome} |"


def document(runs: list[Run], command: str) -> str:
    everywhere = [{r.name for r in runs if r.row == key} for key in list(ROWS)[:5]]
    common = sorted(set.union(*everywhere)) if runs else []
    lines = [
        "# CSG trees: CAPRI-Net's measures",
        "",
        f"`{command}`",
        "",
        f"One thread each on {machine()}; seconds are those of the processor. 30,000 points a surface.",
        "The floor of the Chamfer distance (CD) and the ceiling of the normal consistency (NC) are what",
        "a second sample of the shape itself reaches. ECD: edge Chamfer distance; LFD: light field",
        "distance; #P and #C: primitives, in every convex that has them, and convexes; distinct: those that",
        "convexes share counted once; once: what repeats counted once, by moves, turns or mirrors (these",
        "from the mesh only; in other rows holes of one direction alone, and no other convex, repeat). A",
        "solid of `solids` and a SuperFrustum count as one primitive each, where a box takes six planes.",
        *NOTES,
        "",
        "## Inputs and methods",
        "",
        *summary(runs, common),
        "",
        "## Ablations (means, from the mesh)",
        "",
        *ablations(runs),
    ]
    for key in ("mesh", "voxels", "points"):
        if any(run.row == key for run in runs):
            lines += ["", f"## {ROWS[key].about}, shape by shape", "", *by_shape(runs, key)]
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    names, sets, rows = (
        [*filter(None, text.split(","))] for text in (options.names, options.sets, options.rows)
    )
    unknown = set(rows) - set(ROWS)
    if unknown:
        raise SystemExit(f"rows: {', '.join(sorted(unknown))} unknown; choose from {', '.join(ROWS)}")
    entries = find_shapes(options.shapes, set(sets), set(names))
    RESULTS.parent.mkdir(exist_ok=True)
    runs = read(RESULTS)
    known = set() if options.again else {(run.name, run.row) for run in runs}
    for row in rows:
        for entry in entries:
            if (entry.name, row) in known:
                continue
            run = fit_once(entry, row, options.seed, options.threads)
            recorded.append(RESULTS, run)
            print(row, entry.name, run.outcome, cells([run], mean), flush=True)
            write_tables(options)
    write_tables(options)
    return 0


def write_tables(options: argparse.Namespace) -> None:
    """capri.md, of what the CSV file holds."""
    runs = read(RESULTS)
    write_bytes(RESULTS.with_suffix(".md"), document(runs, _command(options, runs)).encode())


def _command(options: argparse.Namespace, runs: list[Run]) -> str:
    """What to type to get these tables; of the folder of shapes only its name, wherever it lies."""
    rows = ",".join(key for key in ROWS if any(run.row == key for run in runs))
    given = {"--shapes": options.shapes.name if options.shapes != OWN_SHAPES else "", "--sets": options.sets}
    given |= {"--rows": rows, "--seed": options.seed}
    return " ".join(["python benchmarks/capri.py", *(f"{k} {v}" for k, v in given.items() if v)])


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER", help="an index.json, or meshes")
    option("--sets", default="", metavar="A,B", help="only these sets")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--rows", default="mesh", metavar="A,B", help=f"of {', '.join(ROWS)} (default: mesh)")
    option("--seed", type=int, default=0, metavar="S")
    option("--threads", type=int, default=1, metavar="N", help="of each fit (default: 1)")
    option("--again", action="store_true", help="fit also what the CSV file holds")
    return result


if __name__ == "__main__":
    sys.exit(main())
