"""Whether a fit repeats, and how little it minds how its shape lies and is meshed.

    python benchmarks/stability.py --shapes FOLDER [--names mug,bunny] [--turns 3] [--seeds 3] [--quality Q]

Every fit is a process of its own. The same seed has to give the same bytes, again and at one thread and two.
A shape that is moved and scaled, or turned too, has to keep its IoU within 0.01 and its parts within 10 % or
one; remeshed to a tenth of its triangles, or with noise of 0.2 % of its longest side on its vertices (of
20,000 triangles or more in both cases), its IoU within 0.02. What counts is the median over the seeds, of the
disturbed shape against that of the original: one fit against another would measure luck, whose range the
table shows. All assemblies are brought back to the original shape and measured there. FOLDER: as for fit.py.
Needs the extra "bench". The table goes to benchmarks/results/stability.md; exits with 1 if a row fails.
"""

from __future__ import annotations

import argparse
import hashlib
import multiprocessing
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import numpy as np
from fit import OWN_SHAPES, Entry, find_shapes, machine
from scipy.spatial.transform import Rotation

from partwright.atomic_io import write_bytes
from partwright.errors import MissingDependencyError

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Similarity
    from partwright.shapes import Shape

RESULT = Path(__file__).parent / "results" / "stability.md"
NAMES = ("mug", "bunny", "armchair", "ttt_angle_bracket")
FEWER, NOISE, MOVE_SEED = 0.1, 0.002, 100
CAREFUL = 3  # at fast-simplification's default of 7 a mug loses a twentieth of its volume
FINE = 20_000  # triangles that a mesh is given before it loses nine tenths
OWN_RESOLUTION = 64  # cells along a side, by exact distances: twice as many take minutes
POSE_LIMIT, SURFACE_LIMIT, PARTS_LIMIT = 0.01, 0.02, 0.1


@dataclass(frozen=True)
class Check:
    """One fit. limit: of the change in IoU against the base; None for none. parts: their number counts, too.
    same: the bytes of assembly.json have to be those of the base.

    turn: seed of a random rotation, scale and move. moved: only scale and move. remeshed, noisy: see above.
    """

    name: str
    limit: float | None = None
    parts: bool = False
    same: bool = False
    threads: int = 1
    turn: int | None = None
    moved: bool = False
    remeshed: bool = False
    noisy: bool = False


@dataclass(frozen=True)
class Measured:
    """iou, parts: of the assembly. own: IoU of the disturbed shape itself with the original, if that was
    asked for. digest: of assembly.json."""

    iou: float
    parts: int
    own: float | None
    digest: str


@dataclass(frozen=True)
class Spread:
    """What the seeds gave."""

    fits: tuple[Measured, ...]

    @property
    def iou(self) -> float:
        return median(one.iou for one in self.fits)

    @property
    def parts(self) -> float:
        return median(one.parts for one in self.fits)


BASE = Check("one thread")


def checks(turns: int) -> list[Check]:
    return [
        Check("the same again", same=True),
        Check("the same at two threads", same=True, threads=2),
        Check("moved and scaled", limit=POSE_LIMIT, parts=True, moved=True),
        *(
            Check(f"turned, moved and scaled, {i + 1}", limit=POSE_LIMIT, parts=True, turn=i)
            for i in range(turns)
        ),
        Check("remeshed to a tenth of the triangles", limit=SURFACE_LIMIT, remeshed=True),
        Check("noise of 0.2 %", limit=SURFACE_LIMIT, noisy=True),
    ]


def similarity(check: Check) -> Similarity:
    """From the original to where the shape is fitted."""
    from partwright.assembly import Similarity

    if not check.moved and check.turn is None:
        return Similarity()
    rng = np.random.default_rng(MOVE_SEED if check.turn is None else check.turn)
    x, y, z, w = Rotation.random(random_state=rng).as_quat()
    rotation = (1.0, 0.0, 0.0, 0.0) if check.turn is None else (w, x, y, z)
    scale = 25.4 if check.turn is None else float(np.exp(rng.uniform(-4, 4)))
    tx, ty, tz = (scale * rng.uniform(-3, 3, 3)).tolist()
    return Similarity(scale, tuple(map(float, rotation)), (tx, ty, tz))


def disturbed(check: Check, shape: Shape) -> trimesh.Trimesh:
    """The shape's surface as the check asks for it.

    A mesh of few triangles is subdivided first: a tenth of 460 would be no chair, and noise on so few corners
    moves whole walls (of a mug of 366 triangles 2.6 % of the IoU), which makes another shape of it.
    """
    import trimesh

    vertices, faces = shape.vertices, shape.faces
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    while (check.remeshed or check.noisy) and len(faces) < FINE:
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    if check.remeshed:
        try:
            import fast_simplification
        except ImportError as error:
            raise MissingDependencyError(
                'remeshing needs fast-simplification: pip install "partwright[bench]"'
            ) from error
        fewer = fast_simplification.simplify(vertices, faces, 1 - FEWER, agg=CAREFUL)
        mesh = trimesh.Trimesh(*fewer, process=False)
    if check.noisy:
        longest = float(np.ptp(vertices, axis=0).max())
        noise = np.random.default_rng(0).normal(0, NOISE * longest, vertices.shape)
        mesh = trimesh.Trimesh(vertices + noise, faces, process=False)
    return trimesh.Trimesh(similarity(check)(mesh.vertices), mesh.faces, process=False)


def measure(entry: Entry, check: Check, quality: str, seed: int) -> Measured:
    """Fits the disturbed shape, and measures its assembly against the original. What the shape itself makes
    is the same at every seed: the first measures it."""
    from partwright.methods import FitRequest, Run
    from partwright.metrics.frames import in_unit_frame
    from partwright.metrics.iou import RESOLUTION, iou
    from partwright.shapes import load_shape
    from partwright.superfrusta import Settings

    original = load_shape(entry.path)
    there = similarity(check)
    plain = check == BASE or not (check.remeshed or check.noisy or check.moved or check.turn is not None)
    shape = original if plain else load_shape(disturbed(check, original))
    run = Run(seed, threads=check.threads)
    assembly = FitRequest(shape, Settings.for_quality(quality), run).fitted().assembly
    back = assembly if plain else assembly.transformed(there.inverse())

    def distance(points: np.ndarray) -> np.ndarray:
        there_off = shape.signed_distance(there(original.frame.from_unit(points)))
        return there_off * original.frame.scale / there.scale

    own = None if seed else 1.0 if plain else iou(distance, original.unit_occupancy(OWN_RESOLUTION))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "assembly.json"
        assembly.save(path)
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    reached = iou(in_unit_frame(back, original.frame).distance, original.unit_occupancy(RESOLUTION))
    return Measured(reached, len(assembly), own, digest)


def verdict(check: Check, base: Spread, one: Spread) -> str:
    if check.same:
        bytes_ = all(a.digest == b.digest for a, b in zip(one.fits, base.fits, strict=False))
        return "pass" if bytes_ else "FAIL: other bytes"
    if check.limit is None or len(one.fits) < len(base.fits):
        return ""
    failures = []
    if abs(one.iou - base.iou) > check.limit:
        failures.append(f"IoU by more than {check.limit}")
    if check.parts and abs(one.parts - base.parts) > max(1, PARTS_LIMIT * base.parts):
        failures.append("parts by more than 10 %")
    return f"FAIL: {', '.join(failures)}" if failures else "pass"


Results = dict[str, dict[Check, Spread]]


def table(results: Results) -> Iterator[str]:
    yield "| shape | fit | IoU | change | range | parts | change | range | the input's own IoU | |"
    yield "|---|---|---:|---:|---:|---:|---:|---:|---:|---|"
    for name, measured in results.items():
        base = measured[BASE]
        for check, one in measured.items():
            change = "" if check == BASE else f"{one.iou - base.iou:+.4f}"
            more = "" if check == BASE else f"{one.parts - base.parts:+.0f}"
            ious, parts = [fit.iou for fit in one.fits], [fit.parts for fit in one.fits]
            yield (
                f"| {name} | {check.name} | {one.iou:.4f} | {change} | {min(ious):.3f} to {max(ious):.3f} "
                f"| {one.parts:.0f} | {more} | {min(parts)} to {max(parts)} | {one.fits[0].own:.4f} "
                f"| {verdict(check, base, one)} |"
            )


def failures(results: Results) -> list[str]:
    return [
        f"{name}, {check.name}: {verdict(check, measured[BASE], one)}"
        for name, measured in results.items()
        for check, one in measured.items()
        if verdict(check, measured[BASE], one).startswith("FAIL")
    ]


def document(results: Results, command: str) -> str:
    judged = [c for measured in results.values() for c in measured if c.same or c.limit is not None]
    lines = [
        "# Stability",
        "",
        f"`{command}` on {machine()}.",
        "",
        f"{len(judged) - len(failures(results))} of {len(judged)} checks pass. IoU is that of the assembly",
        "with the original shape, wherever the fit took place; the input's own IoU is that of the disturbed",
        "shape with the original. IoU and parts are medians over the seeds, with their range.",
        "",
        *table(results),
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    names = {*filter(None, options.names.split(","))}
    entries = find_shapes(options.shapes, set(), names)
    if not names:
        entries = [entry for entry in entries if entry.name in NAMES] or entries
    todo = [
        (entry, check, seed)
        for entry in entries
        for check in (BASE, *checks(options.turns))
        for seed in range(1 if check.same else options.seeds)
    ]
    results: Results = {entry.name: {} for entry in entries}
    RESULT.parent.mkdir(exist_ok=True)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.jobs, context, max_tasks_per_child=1) as pool:
        futures = [pool.submit(measure, entry, check, options.quality, seed) for entry, check, seed in todo]
        for (entry, check, seed), future in zip(todo, futures, strict=True):
            one, measured = future.result(), results[entry.name]
            fits = measured[check].fits if check in measured else ()
            measured[check] = Spread((*fits, one))
            said = verdict(check, measured[BASE], measured[check])
            where = f"{entry.name}, {check.name}, seed {seed}"
            print(f"{where}: IoU {one.iou:.4f}, {one.parts} parts {said}", flush=True)
            done = {name: measured for name, measured in results.items() if measured}
            write_bytes(RESULT, document(done, _command(options)).encode())
    print(f"{len(failures(results))} failed; written to {RESULT}")
    return int(bool(failures(results)))


def _command(options: argparse.Namespace) -> str:
    """What to type to get this; of the folder of shapes only its name, wherever it lies."""
    given = {
        "--shapes": options.shapes.name if options.shapes != OWN_SHAPES else "",
        "--names": options.names,
    }
    given |= {"--turns": options.turns, "--seeds": options.seeds, "--quality": options.quality}
    return " ".join(["python benchmarks/stability.py", *(f"{k} {v}" for k, v in given.items() if v)])


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER", help="an index.json, or meshes")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--turns", type=int, default=3, metavar="N", help="random rotations of each shape")
    option("--seeds", type=int, default=3, metavar="N", help="fits of each, of which the median counts")
    option("--quality", choices=("draft", "normal", "high"), default="normal")
    option("--jobs", type=int, default=2, metavar="N", help="fits at a time")
    return result


if __name__ == "__main__":
    sys.exit(main())
