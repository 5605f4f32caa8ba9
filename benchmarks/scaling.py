"""How a fit's cost grows with the triangles of its shape and with the parts of its result.

    python benchmarks/scaling.py --shapes FOLDER [--name bunny] [--times 4] [--parts 4,8,16,32]

Triangles: the shape as it is and split over and over, each triangle into four, which leaves its surface where
it was. Parts: fits with a part budget; the shape that is asked for should deserve the largest. CPU seconds of
one thread, reading and scoring included. The exponent is the slope of log(seconds) over log(size): 1 is
linear growth. FOLDER is as for fit.py. The table goes to benchmarks/results/scaling.md; exits with 1 if the
exponent over triangles is 1 or more, or that over parts exceeds 1.2.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh
from fit import OWN_SHAPES, find_shapes, machine

import partwright as pw
from partwright.atomic_io import write_bytes

RESULT = Path(__file__).parent / "results" / "scaling.md"
LINEAR, NEARLY_LINEAR = 1.0, 1.2
HEAD = "| triangles | parts asked | parts | IoU | CPU seconds |"


class Case:
    """One fit of a file."""

    def __init__(self, path: Path, max_parts: int | None) -> None:
        start = time.process_time()
        shape = pw.load_shape(path)
        result = pw.fit(shape, max_parts=max_parts, threads=1)
        self.seconds = time.process_time() - start
        self.triangles = len(shape.input_faces)
        self.parts = result.scores.parts
        self.row = (
            f"| {self.triangles} | {max_parts or ''} | {self.parts} | {result.scores.iou:.3f} "
            f"| {self.seconds:.1f} |"
        )
        print(self.row, flush=True)


def exponent(sizes: list[int], seconds: list[float]) -> float:
    slope, _ = np.polyfit(np.log(sizes), np.log(seconds), 1)
    return float(slope)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shapes", type=Path, default=OWN_SHAPES)
    parser.add_argument("--name", default="bunny")
    parser.add_argument("--times", type=int, default=3, help="how often triangles are split")
    parser.add_argument("--parts", default="4,8,16,32")
    given = parser.parse_args()
    entries = find_shapes(given.shapes, set(), set())
    entry = next((one for one in entries if one.name == given.name), entries[0])
    pw.fit(pw.load_shape(entry.path), quality="draft", threads=1)  # imports
    mesh = trimesh.load_mesh(entry.path)
    finer = []
    with tempfile.TemporaryDirectory() as folder:
        for split in range(given.times + 1):
            path = Path(folder) / f"{split}.ply"
            mesh.export(path)
            finer.append(Case(path, None))
            mesh = mesh.subdivide()
    larger = [Case(entry.path, int(most)) for most in given.parts.split(",")]
    by_triangles = exponent([one.triangles for one in finer], [one.seconds for one in finer])
    by_parts = exponent([one.parts for one in larger], [one.seconds for one in larger])
    command = f"python benchmarks/scaling.py --shapes {given.shapes.name} --name {entry.name}"
    lines = [
        "# How the cost grows",
        "",
        f"`{command}` on {machine()}, one thread.",
        "",
        f"Exponent over triangles {by_triangles:.2f}, over parts {by_parts:.2f}; 1 is linear growth.",
        "",
        HEAD,
        "|" + "---:|" * (HEAD.count("|") - 1),
        *(one.row for one in (*finer, *larger)),
    ]
    write_bytes(RESULT, ("\n".join(lines) + "\n").encode())
    print(lines[4])
    return int(by_triangles >= LINEAR or by_parts > NEARLY_LINEAR)


if __name__ == "__main__":
    sys.exit(main())
