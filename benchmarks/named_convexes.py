"""How many convexes of `--method capri` become named solids, extrusions or revolutions, and what changes.

    python benchmarks/named_convexes.py --shapes FOLDER --trees FOLDER [--quality draft]

Trees of quadrics are read from FOLDER/NAME.json, or fitted and put there. The table goes to
benchmarks/results/named_convexes.md.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from pathlib import Path

import partwright as pw
from partwright.approximation.named_convexes import with_named_convexes
from partwright.assembly import Assembly, Node
from partwright.meshing.csg import solid_of
from partwright.metrics.complexity import convexes

TABLE = Path(__file__).parent / "results" / "named_convexes.md"
COLUMNS = "| shape | convexes | named | as | volume in one of the two only | CPU seconds |"
ALIGNED = "|---|--:|--:|---|--:|--:|"


def unnamed(node: Node) -> int:
    """Convexes that stayed quadrics."""
    if node.is_part:
        return int(node.field.quadric() is not None)
    if node.operation == "intersection":
        return int(any(unnamed(child) for child in node.children))
    return sum(map(unnamed, node.children))


def tree_of(path: Path, folder: Path, quality: str) -> Assembly:
    kept = folder / f"{path.stem}.json"
    if not kept.exists():
        pw.fit(pw.load_shape(path), "capri", quality=quality, named=False).assembly.save(kept)
    return pw.load_assembly(kept)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shapes", type=Path, required=True)
    parser.add_argument("--trees", type=Path, required=True)
    parser.add_argument("--quality", default="draft")
    given = parser.parse_args()
    rows, total, left = [], 0, 0
    for path in sorted(given.shapes.glob("*.ply")):
        tree = tree_of(path, given.trees, given.quality)
        start = time.process_time()
        named = with_named_convexes(tree)
        seconds = time.process_time() - start
        before, after = solid_of(tree), solid_of(named)
        apart = ((before - after).volume() + (after - before).volume()) / before.volume()
        count, stayed = convexes(tree), unnamed(named)
        kinds = Counter(part.field.kind for part in named.parts if part.field.quadric() is None)
        words = ", ".join(f"{number} {kind}" for kind, number in kinds.most_common())
        rows.append(f"| {path.stem} | {count} | {count - stayed} | {words} | {apart:.2%} | {seconds:.1f} |")
        total, left = total + count, left + stayed
    command = f"python benchmarks/named_convexes.py --shapes SHAPES --trees TREES --quality {given.quality}"
    head = (
        f"# Convexes that become what they are\n\n`{command}`\n\n"
        f"{total - left} of {total} convexes ({1 - left / total:.0%}) of {len(rows)} trees become boxes, "
        "cylinders, cones, frusta,\nspheres, extrusions or revolutions. The rest stay intersections of "
        "quadrics: freeform patches, threads, and\nconvexes whose faces run along no one axis.\n"
    )
    TABLE.write_text("\n".join([head, COLUMNS, ALIGNED, *rows]) + "\n")
    print(TABLE.read_text())


if __name__ == "__main__":
    main()
