"""Other programs beside ours: the same shapes, the same measures, at equal seconds and at equal part count.

    python benchmarks/anchors.py [--shapes FOLDER] [--names A,B] [--peers coacd,detect_primitives]
        [--marching-primitives PYTHON] [--keep FOLDER]

Each peer runs with its own defaults (`peers.py`). Beside it stand two fits of ours: of at most as many parts,
and stopped when the processor has spent on it what it spent on the peer. All are measured as the mesh of a
solid, in the unit frame: IoU at 128^3 cells, Chamfer distance of 30,000 points each way, largest deviation in
% of the longest side (`partwright.metrics`). A peer that is not installed is left out, and named. --keep
writes every result, so that anybody can measure it anew. What is in benchmarks/results/anchors.csv is
not run again; anchors.md is brought up to date after every run. Seconds are of the processor, of all threads,
without reading and scoring.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import recorded
import trimesh
from fit import OWN_SHAPES, Entry, find_shapes, machine
from peers import PEERS, Made, Missing

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.errors import PartwrightError
from partwright.metrics.chamfer import chamfer
from partwright.metrics.deviation import surface_deviation
from partwright.metrics.iou import RESOLUTION, iou
from partwright.shapes import Shape
from partwright.shapes.sampling import sample_triangles

RESULTS = Path(__file__).parent / "results" / "anchors.csv"
POINTS = 30_000
UNIT_SIZE = 1.8  # the longest side in the unit frame
HEAD = "| shape | | parts | IoU | Chamfer x1e3 | deviation % | CPU s | |"
HOW = ("peer", "equal parts", "equal seconds")


@dataclass(frozen=True)
class Run:
    """One result; scores are None where there is no solid to measure."""

    shape: str
    peer: str
    how: str
    parts: int
    cpu_seconds: float
    iou: float | None = None
    chamfer: float | None = None
    deviation: float | None = None
    note: str = ""


def measured(mesh: trimesh.Trimesh, shape: Shape) -> dict[str, float]:
    """Of a solid whose mesh may be of pieces that overlap, against the shape; lengths in the unit frame."""
    other = pw.load_shape(mesh)
    own = shape.frame

    def distance(points: np.ndarray) -> np.ndarray:
        return np.asarray(other.signed_distance(own.from_unit(points)) * own.scale)

    vertices = own.to_unit(other.vertices)
    target = shape.unit_surface(POINTS, 1).points
    result = sample_triangles(vertices, other.faces, POINTS, 2)[0]
    apart = surface_deviation(shape, distance, vertices, other.faces, result, target)
    return {
        "iou": iou(distance, shape.unit_occupancy(RESOLUTION)),
        "chamfer": chamfer(result, target),
        "deviation": 100 * apart.maximum / UNIT_SIZE,
    }


def ours(
    shape: Shape, method: str, parts: int | None = None, seconds: float | None = None
) -> tuple[Made, str]:
    """A fit of at most so many parts, or of so many seconds of the processor."""
    cancel, ended = pw.Cancellation(), threading.Event()
    start = time.process_time()

    def watch() -> None:
        while not ended.wait(0.05):
            if time.process_time() - start > float(seconds or 0):
                cancel.request()
                return

    if seconds is not None:
        threading.Thread(target=watch, daemon=True).start()
    try:
        options = {"max_parts": parts} if parts is not None else {}
        result = pw.fit(shape, method, cancel=cancel, **options)
    except PartwrightError as error:
        return Made(0, time.process_time() - start, None, type(error).__name__), ""
    finally:
        ended.set()
    told = result.report["seconds"]
    spent = told["all"] - told["reading"] - told["scores"]
    return Made(result.scores.parts, spent, result.surface), result.outcome


def runs_of(entry: Entry, name: str, where: Path | None, keep: Path | None) -> list[Run]:
    """The peer on the shape, and ours beside it."""
    peer, shape = PEERS[name], pw.load_shape(entry.path)
    try:
        made = [(peer.run(shape, where), "")]
    except subprocess.TimeoutExpired as error:
        made = [(Made(0, error.timeout, None, "stopped: no result in so many seconds of the clock"), "")]
    if made[0][0].parts:
        made.append(ours(shape, peer.beside, parts=made[0][0].parts))
        made.append(ours(shape, peer.beside, seconds=made[0][0].cpu_seconds))
    found = []
    for how, (one, outcome) in zip(HOW, made, strict=False):
        scores = measured(one.mesh, shape) if one.mesh is not None else {}
        if keep is not None and one.mesh is not None:
            keep.mkdir(parents=True, exist_ok=True)
            one.mesh.export(keep / f"{entry.name}-{name}-{how.replace(' ', '_')}.ply")
        found.append(
            Run(entry.name, name, how, one.parts, one.cpu_seconds, **scores, note=one.note or outcome)
        )
        print(found[-1], flush=True)
    return found


def table(runs: list[Run], missing: dict[str, str], command: str) -> str:
    lines = [
        "# Other programs beside ours",
        "",
        f"`{command}` on {machine()}. Defaults of all, one measure for all (the script says which). Beside",
        "a peer: a fit of at most as many parts, and one stopped after as many seconds of the processor.",
    ]
    for name, peer in PEERS.items():
        its = [run for run in runs if run.peer == name]
        lines += ["", f"## {peer.about}", ""]
        if not its:
            lines.append(f"Not run: {missing.get(name, 'not asked for')}.")
            continue
        lines += [HEAD, "|---|---|" + "---:|" * 5 + "---|"]
        for run in its:
            label = peer.about.split(" (")[0] if run.how == "peer" else f"{peer.beside}, {run.how}"
            cells = [
                run.shape, label, str(run.parts) if run.parts else "-", _cell(run.iou, 4),
                _cell(run.chamfer and 1e3 * run.chamfer, 3), _cell(run.deviation, 2),
                f"{run.cpu_seconds:.1f}", run.note,
            ]  # fmt: skip
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _cell(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def main() -> int:
    time.perf_counter = time.process_time  # the stages of a report are then seconds of the processor
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = parser.add_argument
    option("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER", help="an index.json, or meshes")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--peers", default=",".join(PEERS), metavar="A,B", help="only these (default: %(default)s)")
    option("--marching-primitives", type=Path, metavar="PYTHON", help="of its environment")
    option("--keep", type=Path, metavar="FOLDER", help="writes every result's mesh here")
    given = parser.parse_args()
    wanted = set(filter(None, given.names.split(",")))
    entries = find_shapes(given.shapes, set(), wanted)
    places = {"marching_primitives": given.marching_primitives}
    runs, missing = recorded.read(RESULTS, Run), dict[str, str]()
    for name in given.peers.split(","):
        for entry in entries:
            if any(run.shape == entry.name and run.peer == name for run in runs):
                continue
            try:
                for run in runs_of(entry, name, places.get(name), given.keep):
                    runs.append(run)
                    recorded.append(RESULTS, run)
            except Missing as error:
                missing[name] = str(error)
                print(f"{name}: left out; {error}", file=sys.stderr)
                break
    write_bytes(RESULTS.with_suffix(".md"), table(runs, missing, "python benchmarks/anchors.py").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
