"""What bounds cost: how tight a containing, an inner and a tolerant assembly are, and whether they hold.

    python benchmarks/tolerances.py --shapes FOLDER [--names robot_arm_ur5] [--quality draft]

Each shape is fitted as it is, with --contain --max-parts 8, with --inside, and with two tolerances. `judged`
is measured anew, on other samples than the fit's own check: by how much the shape sticks out, the parts stick
out, or the surfaces are apart, in percent of the longest side. FOLDER is as for fit.py; without it the shape
that ships with the project is taken. The table goes to benchmarks/results/tolerances.md, and a picture of the
first shape with --picture FILE.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

from fit import OWN_SHAPES, find_shapes, machine

from partwright.atomic_io import write_bytes

RESULT = Path(__file__).parent / "results" / "tolerances.md"
CASES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("plain", {}),
    ("--max-parts 8", {"max_parts": 8}),
    ("--contain --max-parts 8", {"contain": True, "max_parts": 8}),
    ("--inside", {"inside": True}),
    ("--tolerance 5%", {"tolerance": "5%"}),
    ("--tolerance 2%", {"tolerance": "2%"}),
)
FRESH = 4242  # seed of the samples that judge


def judged(result: Any, options: dict[str, Any]) -> str:
    """In percent of the longest side."""
    from partwright.metrics.frames import in_unit_frame
    from partwright.tolerances import DistanceBounds, check

    asked = {name: options[name] for name in ("contain", "inside", "tolerance") if name in options}
    bounds = DistanceBounds.of(result.shape, **asked)
    found = check(in_unit_frame(result.assembly, result.shape.frame), result.shape, bounds, FRESH).found
    return ", ".join(f"{100 * max(side.worst, 0.0) / 1.8:.2f}" for side in found.values())


def row(name: str, label: str, shape: Any, options: dict[str, Any], quality: str) -> tuple[str, Any]:
    import partwright as pw

    start = time.process_time()
    result = pw.fit(shape, quality=quality, threads=1, **options)
    seconds = time.process_time() - start
    found = result.report.get("bounds", {})
    kept = ", ".join("kept" if one["kept"] else "missed" for one in found.values() if isinstance(one, dict))
    return (
        f"| {name} | {label} | {result.scores.parts} | {result.scores.iou:.3f} "
        f"| {result.surface.volume / shape.volume:.3f} "
        f"| {100 * shape.frame.length_to_unit(result.scores.max_deviation) / 1.8:.2f} "
        f"| {kept} | {judged(result, options) if found else ''} | {seconds:.0f} |"
    ), result


def main() -> int:
    from partwright.shapes import load_shape

    options = parser().parse_args()
    entries = find_shapes(options.shapes, set(), {*filter(None, options.names.split(","))})
    lines, pictured = [], []
    for entry in entries:
        shape = load_shape(entry.path)
        for label, asked in CASES:
            line, result = row(entry.name, label, shape, asked, options.quality)
            print(line, flush=True)
            lines.append(line)
            if entry is entries[0]:
                pictured.append((label, result))
        write_bytes(RESULT, document(lines, options).encode())
    if options.picture:
        picture(pictured, options.picture)
    return 0


def picture(pictured: list[tuple[str, Any]], path: Path) -> None:
    from partwright.render import curve_sheet

    captions = [
        f"{label}: {r.scores.parts} parts, volume {r.surface.volume / r.shape.volume:.2f}"
        for label, r in pictured
    ]
    curve_sheet([r.assembly for _, r in pictured], captions, path, title=pictured[0][1].shape.name)


def document(lines: list[str], options: argparse.Namespace) -> str:
    folder = f" --shapes {options.shapes.name}" if options.shapes != OWN_SHAPES else ""
    names = f" --names {options.names}" if options.names else ""
    return "\n".join(
        [
            "# Bounds",
            "",
            f"`python benchmarks/tolerances.py{folder}{names} --quality {options.quality}` on {machine()}.",
            "",
            "Volume is that of the parts over the shape's. Largest deviation and judged (on other samples",
            "than the fit's own check) are percent of the longest side. Seconds are CPU time of one thread.",
            "",
            "| shape | options | parts | IoU | volume | largest deviation | bound | judged | seconds |",
            "|---|---|---:|---:|---:|---:|---|---:|---:|",
            *lines,
            "",
        ]
    )


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER", help="an index.json, or meshes")
    option("--names", default="", metavar="A,B", help="only these shapes")
    option("--quality", choices=("draft", "normal", "high"), default="draft")
    option("--picture", type=Path, metavar="FILE", help="a picture of the first shape's assemblies")
    return result


if __name__ == "__main__":
    sys.exit(main())
