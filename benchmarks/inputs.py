"""Points and grids instead of a mesh: what a fit loses by them.

    python benchmarks/inputs.py --shapes FOLDER --seeds 0,1,2

Every mesh is turned into 30,000 points with and without normals and into 128^3 grids of occupancy and of
signed distance, each written to a file and read back. All of them are fitted, and the assemblies scored
against the mesh. The table goes to benchmarks/results/inputs.md. Exits with 1 if a median IoU over the seeds
falls more than 0.02 short of the mesh's own.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median

import numpy as np

from partwright.atomic_io import write_bytes
from partwright.methods import FitRequest, Run
from partwright.metrics.frames import in_unit_frame
from partwright.metrics.iou import iou, occupancy_iou
from partwright.shapes import MESH_SUFFIXES, Shape, load_shape
from partwright.superfrusta import Settings

HERE = Path(__file__).parent
POINTS, RESOLUTION = 30_000, 128
MOST_LOST = 0.02
HEADERS = ("shape", "input", "load s", "confidence", "input IoU", "fit IoU", "lost", "parts")


def points_with_normals(shape: Shape) -> dict[str, np.ndarray]:
    samples = shape.unit_surface(POINTS, seed=1)
    return {"points": shape.frame.from_unit(samples.points), "normals": samples.normals}


def points_alone(shape: Shape) -> dict[str, np.ndarray]:
    return {"points": points_with_normals(shape)["points"]}


def occupancy(shape: Shape) -> dict[str, np.ndarray]:
    return {"occupancy": shape.unit_occupancy(RESOLUTION), **_placement(shape)}


def signed_distance(shape: Shape) -> dict[str, np.ndarray]:
    axis = -1 + (2 * np.arange(RESOLUTION) + 1) / RESOLUTION
    centres = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    distance = shape.frame.length_from_unit(shape.unit_distance(centres))
    return {"sdf": distance.reshape((RESOLUTION,) * 3), **_placement(shape)}


def _placement(shape: Shape) -> dict[str, np.ndarray]:
    first = shape.frame.from_unit(np.full((1, 3), -1 + 1 / RESOLUTION))[0]
    return {"origin": first, "spacing": shape.frame.length_from_unit(2 / RESOLUTION)}


INPUTS: dict[str, Callable[[Shape], dict[str, np.ndarray]]] = {
    "points with normals": points_with_normals,
    "points": points_alone,
    "occupancy grid": occupancy,
    "distance grid": signed_distance,
}


def rows_of(path: Path, seeds: list[int], quality: str) -> Iterator[tuple[list[str], float]]:
    """The table's cells and the IoU lost, for the mesh and then for every other input."""
    mesh, seconds = _loaded(path)
    own, parts = _fitted(mesh, mesh, seeds, quality)
    yield (
        [path.stem, "mesh", f"{seconds:.2f}", f"{mesh.confidence:.2f}", "", f"{own:.4f}", "", f"{parts:g}"],
        0.0,
    )
    for name, arrays in INPUTS.items():
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "input.npz"
            np.savez_compressed(file, **arrays(mesh))
            shape, seconds = _loaded(file)
        reached, parts = _fitted(shape, mesh, seeds, quality)
        cells = [path.stem, name, f"{seconds:.2f}", f"{shape.confidence:.2f}", f"{_same(shape, mesh):.4f}"]
        yield [*cells, f"{reached:.4f}", f"{own - reached:+.4f}", f"{parts:g}"], own - reached


def _loaded(path: Path) -> tuple[Shape, float]:
    start = time.perf_counter()
    return load_shape(path), time.perf_counter() - start


def _fitted(shape: Shape, mesh: Shape, seeds: list[int], quality: str) -> tuple[float, float]:
    """Medians over the seeds: IoU of the shape's assembly with the mesh, and parts."""
    settings = Settings.for_quality(quality)
    assemblies = [FitRequest(shape, settings, Run(seed)).fitted().assembly for seed in seeds]
    reached = [
        iou(in_unit_frame(a, mesh.frame).distance, mesh.unit_occupancy(RESOLUTION)) for a in assemblies
    ]
    return median(reached), median(len(a) for a in assemblies)


def _same(shape: Shape, mesh: Shape) -> float:
    """IoU of the input's own surface with the mesh, at the mesh's cell centres."""
    axis = -1 + (2 * np.arange(RESOLUTION) + 1) / RESOLUTION
    centres = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = shape.signed_distance(mesh.frame.from_unit(centres)) < 0
    return occupancy_iou(inside.reshape((RESOLUTION,) * 3), mesh.unit_occupancy(RESOLUTION))


def document(rows: list[list[str]], command: str, seeds: list[int]) -> str:
    lines = [
        "# Points and grids instead of a mesh",
        "",
        f"`{command}`",
        "",
        f"{POINTS:,} points on the surface, grids of {RESOLUTION}^3. IoU is with the mesh: of the surface",
        f"made of the input, and of the assembly fitted to it (median over seeds {seeds}). `lost` is what",
        "the fit falls short of the fit to the mesh itself.",
        "",
        "| " + " | ".join(HEADERS) + " |",
        "|" + "---|" * len(HEADERS),
        *("| " + " | ".join(row) + " |" for row in rows),
    ]
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    own = HERE.parent / "examples" / "shapes"
    parser.add_argument("names", nargs="*", help="only these shapes, by their files' names without suffix")
    parser.add_argument("--shapes", type=Path, default=own, metavar="FOLDER", help="meshes, in it or below")
    parser.add_argument("--seeds", default="0", metavar="0,1,2", help="the median over these counts")
    parser.add_argument("--quality", default="normal", choices=("draft", "normal", "high"))
    options = parser.parse_args()
    seeds = [int(seed) for seed in options.seeds.split(",")]
    paths = sorted(p for p in options.shapes.rglob("*") if p.suffix.lower() in MESH_SUFFIXES)
    paths = [p for p in paths if not options.names or p.stem in options.names]
    if not paths:
        raise SystemExit(f"{options.shapes} holds none of the shapes that were asked for")
    given = {"--shapes": options.shapes.name if options.shapes != own else "", "--seeds": options.seeds}
    given["--quality"] = options.quality if options.quality != "normal" else ""
    words = [*(f"{key} {value}" for key, value in given.items() if value), *options.names]
    command = " ".join(["python benchmarks/inputs.py", *words])
    rows, worst = [], 0.0
    for path in paths:
        for row, lost in rows_of(path, seeds, options.quality):
            print(" | ".join(row), flush=True)
            rows.append(row)
            worst = max(worst, lost)
    target = HERE / "results" / "inputs.md"
    write_bytes(target, document(rows, command, seeds).encode())
    print(f"worst loss {worst:.4f}; written to {target}")
    return int(worst > MOST_LOST)


if __name__ == "__main__":
    sys.exit(main())
