"""Screw threads of standard sizes, meshed as a CAD program would, measured by `--method solids`.

    python benchmarks/threads.py [--shapes FOLDER]

Each is a ridge of the ISO profile swept along a helix and united with its core, outside on a bolt and, as
what a nut lacks, inside, right- and left-handed, in three tessellations, turned to any side. Columns: how
many are found and named right, the largest errors of pitch and diameter, of the length in pitches, CPU
seconds.
--shapes: also how many threads are seen in parts that have some or none (an index.json, or meshes).
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from fit import find_shapes, machine
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.meshing.manifolds import as_mesh, closed
from partwright.superfrusta.threaded import description, plain_shape

SIZES = {  # outer diameter, pitch: mm
    "M3": (3.0, 0.5),
    "M5": (5.0, 0.8),
    "M8": (8.0, 1.25),
    "M8x1": (8.0, 1.0),
    "M12": (12.0, 1.75),
    "M20": (20.0, 2.5),
    "M36": (36.0, 4.0),
    "1/4-20 UNC": (6.35, 1.27),
    "1/2-20 UNF": (12.7, 1.27),
}
CHORDS = (24, 48, 120)  # a turn
LENGTH = 1.5  # diameters


@dataclass(frozen=True)
class Row:
    """One thread. Errors: shares of pitch and diameter, and pitches of the length."""

    name: str
    found: bool
    named: bool
    pitch: float
    diameter: float
    length: float
    seconds: float


def rod(diameter: float, pitch: float, length: float, chords: int, left: bool) -> Manifold:
    """A threaded rod about z, from 0 to its length."""
    outer, depth = diameter / 2, 0.6134 * pitch
    low, high = outer - depth - 0.05 * pitch, outer
    flank = 5 / 16 * pitch * (high - low) / depth
    corners = np.array(
        [(low, -pitch / 16 - flank), (high, -pitch / 16), (high, pitch / 16), (low, pitch / 16 + flank)]
    )
    steps = np.arange(math.ceil((length / pitch + 2) * chords) + 1)
    turn, rise = 2 * math.pi * steps / chords, pitch * (steps / chords - 1)
    rings = np.stack(
        [
            corners[:, 0] * np.cos(turn)[:, None],
            corners[:, 0] * np.sin(turn)[:, None],
            corners[:, 1] + rise[:, None],
        ],
        axis=-1,
    )
    k, j = (index.ravel() for index in np.meshgrid(steps[:-1], np.arange(4), indexing="ij"))
    after = (j + 1) % 4
    a, b, c, d = 4 * k + j, 4 * k + after, 4 * k + 4 + j, 4 * k + 4 + after
    last = 4 * int(steps[-1])
    ends = [(0, 1, 2), (0, 2, 3), (last, last + 2, last + 1), (last, last + 3, last + 2)]
    faces = np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d]), np.array(ends)])
    ridge = closed(rings.reshape(-1, 3), faces)
    ridge = ridge if ridge.volume() > 0 else closed(rings.reshape(-1, 3), faces[:, ::-1])
    core = Manifold.cylinder(length, outer - depth, outer - depth, chords)
    whole = core + (ridge ^ Manifold.cylinder(length, 2 * outer, 2 * outer, 8))
    return whole.mirror((1, 0, 0)) if left else whole


def bolt(diameter: float, pitch: float, chords: int, left: bool) -> Manifold:
    head = Manifold.cylinder(0.65 * diameter, 0.95 * diameter, 0.95 * diameter, 6)
    return rod(diameter, pitch, LENGTH * diameter, chords, left) + head.translate((0, 0, LENGTH * diameter))


def nut(diameter: float, pitch: float, chords: int, left: bool) -> Manifold:
    length = 0.8 * diameter
    inside = rod(diameter, pitch, 2 * length, chords, left).translate((0, 0, -0.5 * length))
    return Manifold.cylinder(length, 0.95 * diameter, 0.95 * diameter, 6) - inside


def rows() -> Iterator[Row]:
    turns = np.random.default_rng(0)
    for kind, make, share in (("external", bolt, LENGTH), ("internal", nut, 0.8)):
        for name, (diameter, pitch) in SIZES.items():
            for chords in CHORDS:
                left = bool(turns.integers(2))
                move = np.column_stack([Rotation.random(random_state=turns).as_matrix(), np.zeros(3)])
                body = make(diameter, pitch, chords, left).transform(move)
                shape = pw.load_shape(as_mesh(body), unit="mm")
                started = time.process_time()
                _, threads = plain_shape(shape)
                seconds = time.process_time() - started
                label = f"{kind} {name}, {chords} chords"
                if len(threads) != 1:
                    yield Row(label, False, False, math.nan, math.nan, math.nan, seconds)
                    continue
                said = description(threads[0], "mm")
                hand = "left" if left else "right"
                right = (said["thread"], said["thread_kind"], said["thread_hand"]) == (name, kind, hand)
                found = threads[0]
                yield Row(
                    label,
                    True,
                    right,
                    abs(abs(found.pitch) / pitch - 1),
                    abs(2 * found.outer / diameter - 1),
                    abs(found.length - share * diameter) / pitch,
                    seconds,
                )


def line(name: str, own: Sequence[Row]) -> str:
    seen = [row for row in own if row.found]

    def most(key: str) -> float:
        return max((getattr(row, key) for row in seen), default=math.nan)

    cells = [name, str(len(own)), str(len(seen)), str(sum(row.named for row in own))]
    cells += [f"{100 * most('pitch'):.2f}", f"{100 * most('diameter'):.2f}", f"{most('length'):.2f}"]
    return f"| {' | '.join(cells)} | {np.mean([row.seconds for row in own]):.2f} |"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shapes", type=Path, metavar="FOLDER")
    parser.add_argument("--sets", default="cad,toys", metavar="A,B")
    parser.add_argument("--output", type=Path, default=Path(__file__).parent / "results/threads.md")
    options = parser.parse_args()
    found = []
    for row in rows():
        found.append(row)
        print(row, flush=True)
    chosen = [
        (f"{kind}, {chords} chords a turn", kind, chords)
        for kind in ("external", "internal")
        for chords in CHORDS
    ]
    lines = [
        "# Screw threads, measured",
        "",
        f"`python benchmarks/threads.py{' --shapes data' if options.shapes else ''}` on {machine()}.",
        "",
        f"{len(SIZES)} sizes ({', '.join(SIZES)}), either hand, turned to any side.",
        "",
        "| threads | made | found | name, kind and hand right | pitch off at most, % | outer diameter, % "
        "| length, pitches | CPU s |",
        "|---|---:|---:|---:|---:|---:|---:|---:|",
        *(
            line(
                name,
                [
                    row
                    for row in found
                    if row.name.startswith(kind) and row.name.endswith(f" {chords} chords")
                ],
            )
            for name, kind, chords in chosen
        ),
        line("all", found),
        "",
    ]
    missed = [row.name for row in found if not row.named]
    lines += [f"Not found, or not named right: {'; '.join(missed)}.", ""] if missed else []
    if options.shapes:
        seen = {}
        shapes = find_shapes(options.shapes, set(options.sets.split(",")), set())
        for entry in shapes:
            _, threads = plain_shape(pw.load_shape(entry.path))
            if threads:
                seen[entry.name] = len(threads)
        lines += [
            f"In {len(shapes)} shapes of the sets {options.sets}: "
            + (", ".join(f"{name} {count}" for name, count in seen.items()) or "none")
            + "; none in the others.",
            "",
        ]
    write_bytes(options.output, "\n".join(lines).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
