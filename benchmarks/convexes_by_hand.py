"""How few convexes a person would need in CAPRI-Net's language, beside those that the search finds.

    python benchmarks/convexes_by_hand.py

A tree is a union of convexes minus a union of convexes, each an intersection of planes, cylinders, cones,
spheres and ellipsoids, and what repeats by moves, turns or mirrors counts once. BY_HAND was counted from
pictures of the inputs and is one person's view. A fillet inside a corner is two convexes (what fills the
corner, and the cylinder that is taken out of it again), a rounded corner outside at least one; a bend is no
quadric, so it is cut into slices that a cylinder stands for.

For the other parts each feature that `--method solids` finds counts as one convex. That is less than these
features need, as an outline that is not convex is several convexes, but a person may draw fewer. Read from
benchmarks/results/solids.csv and capri.csv, so that both are as measured.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path
from statistics import mean

from partwright.atomic_io import write_bytes

RESULTS = Path(__file__).parent / "results"
BY_HAND: dict[str, dict[str, int]] = {
    "ttt_c_clamp_base": {
        "three bars": 3,
        "rounded outer corner, twice": 1,
        "inner fillet, twice": 2,
        "boss": 1,
        "bore": 1,
        "relief of the arm, twice": 1,
        "round end": 1,
        "hole in it": 1,
    },
    "ttt_corner_tie": {
        "base plate": 1,
        "rounded corner of it, twice": 1,
        "counterbored hole, twice": 2,
        "tilted plate and its round end": 2,
        "large hole": 1,
        "ear and its round top": 2,
        "hole in the ear": 1,
    },
    "ttt_angle_bracket": {
        "boss, two steps": 2,
        "bore": 1,
        "arm and leg": 2,
        "bend outside": 1,
        "fillet inside the bend": 2,
        "slot and its round end": 2,
        "round end about the boss": 1,
        "web between arm and boss": 1,
    },
    "ttt_bearing_jig": {
        "round body": 1,
        "bore": 1,
        "keyway": 1,
        "upper arm, twice, and its round end": 2,
        "lower arm, twice, and its round end": 2,
        "web": 1,
        "hole, four times": 1,
    },
    "ttt_post_cap": {"cup": 1, "hollow": 1, "hook, four slices": 4},
    "bdw_pipe_elbow": {"straight pipes": 2, "their bores": 2, "bend, two slices": 2, "its bore, two": 2},
    "bdw_snap_ring": {
        "ring": 1,
        "hole, off its middle": 1,
        "gap": 1,
        "ear, twice, and its round side": 2,
        "hole in the ear, twice": 1,
    },
    "bdw_weld_neck_flange": {
        "flange": 1,
        "neck": 1,
        "its bevelled end": 1,
        "fillet of the neck": 1,
        "bore": 1,
        "bolt hole": 1,
    },
    "bd_slide_latch": {
        "box": 1,
        "cavity": 1,
        "slot and its round end": 2,
        "ear and its round end": 2,
        "hole in the ear": 1,
    },
    "f360_rotor": {"drum": 1, "slot and its wide bottom": 2, "shaft, two steps": 2, "flat of it": 1},
}


def found(file: str, column: str, **only: str) -> dict[str, float]:
    """A column of a table of results, by shape, of the rows that are `only`."""
    with (RESULTS / file).open() as stream:
        rows = [row for row in csv.DictReader(stream) if all(row[k] == v for k, v in only.items())]
    return {row["name"]: float(row[column]) for row in rows if row[column]}


def table(searched: dict[str, float], excess: dict[str, float], features: dict[str, float]) -> list[str]:
    hand = {name: sum(parts.values()) for name, parts in BY_HAND.items()}
    least = {name: float(hand.get(name, features[name])) for name in searched}
    others = [name for name in searched if name not in hand]
    lines = [
        "# Convexes that a person would need",
        "",
        "`python benchmarks/convexes_by_hand.py`",
        "",
        "Union of convexes minus union of convexes, quadrics only, repeats by moves, turns and mirrors once.",
        "",
        f"- Ten parts by hand: {mean(hand.values()):.1f} on average; the search finds "
        f"{mean(searched[name] for name in hand):.1f} (repeats once, likewise).",
        f"- The other {len(others)} with one convex a feature that `--method solids` finds, which is less "
        f"than these need: {mean(least[name] for name in others):.1f}; the search finds "
        f"{mean(searched[name] for name in others):.1f}.",
        f"- All {len(least)} so: {mean(least.values()):.1f}; the search finds {mean(searched.values()):.1f}.",
        "",
        "| part | by hand | found | Chamfer x1e3 above its floor | convexes by hand |",
        "|---|---:|---:|---:|---|",
    ]
    for name, parts in BY_HAND.items():
        said = "; ".join(f"{part} ({count})" if count > 1 else part for part, count in parts.items())
        lines.append(f"| {name} | {hand[name]} | {searched[name]:g} | {1e3 * excess[name]:.3f} | {said} |")
    lines += ["", "| part | features of solids | convexes found |", "|---|---:|---:|"]
    return [*lines, *(f"| {name} | {features[name]:g} | {searched[name]:g} |" for name in others)]


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("-o", "--output", type=Path, default=RESULTS / "convexes_by_hand.md")
    options = parser.parse_args()
    searched = found("capri.csv", "convexes_once", row="mesh")
    chamfer, floor = (found("capri.csv", column, row="mesh") for column in ("chamfer", "chamfer_floor"))
    excess = {name: chamfer[name] - floor[name] for name in chamfer}
    lines = table(searched, excess, found("solids.csv", "parts", variant="solids"))
    write_bytes(options.output, ("\n".join(lines) + "\n").encode())
    print("\n".join(lines[6:9]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
