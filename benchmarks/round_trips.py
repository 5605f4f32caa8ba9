"""Known assemblies of solids, meshed, fitted, cleaned and compared with what they were.

    python benchmarks/round_trips.py [--keep FOLDER]

A known part comes back where the fit has one of the same sign that shares most of its volume: by kind where
the two are of one kind, by size where each number that is seen in the shape is right to 1 %. A relation that
`partwright clean` finds in the known assembly comes back by the share of its members that the clean fit
relates in the same way; members whose ends are not seen, such as a hole's that goes through, do not count.
Every case is appended to benchmarks/results/round_trips.csv as it ends, and those that are there are not made
again: delete the file, or rows of it, to measure anew.
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median

import numpy as np
import recorded
from fit import machine
from known_solids import NAMES, Known, known_assembly
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

import partwright as pw
from partwright.assembly.similarity import rotation_matrix
from partwright.atomic_io import write_bytes
from partwright.cleaning import Relation
from partwright.cleaning.dimensions import dimensions, values
from partwright.fields import Box, Field, HollowBox
from partwright.meshing import mesh_assembly
from partwright.superfrusta.flat_tree import flattened

HERE = Path(__file__).parent
_SAME = 0.5  # of volume shared over volume of either: the same part
_EXACT = 0.01
_POINTS = 60_000
_ONE_KIND = {"cone": "cone or frustum", "frustum": "cone or frustum"}


@dataclass(frozen=True)
class Copy:
    """One copy of a leaf; name: as relations call it, "hole/2" for the second copy of one leaf."""

    name: str
    leaf: str
    part: pw.Part
    added: bool


@dataclass(frozen=True)
class Row:
    """One case. parts, fitted: copies counted each. found, kinds: of those parts. numbers, sizes: numbers
    that are seen, and those of parts of the same kind that are right. relations_back: the sum of shares."""

    name: str
    sort: str
    parts: int
    fitted: int
    found: int
    kinds: int
    numbers: int
    sizes: int
    relations: int
    relations_back: float
    iou: float
    clean_iou: float
    cpu_seconds: float


def run(known: Known, keep: Path | None) -> Row:
    shape = pw.load_shape(mesh_assembly(known.assembly, 128), unit="mm")
    start = time.process_time()
    result = pw.fit(shape, "solids", clean=True, seed=0, profiles=False)  # so that kinds compare
    seconds = time.process_time() - start
    assert result.clean is not None
    if keep:
        known.assembly.save(keep / f"{known.name}_known.json")
        result.assembly.save(keep / f"{known.name}_fit.json")
    truth = pw.clean(known.assembly)  # equal parts as one, and the relations that it was made with
    seen = dict(zip((part.name for part in known.assembly.parts), known.seen, strict=True))
    own, made = copies(truth.assembly), copies(result.assembly)
    pairs = matched(own, made, shape)
    alike = [(a, b) for a, b in pairs if kind(a.part.field) == kind(b.part.field)]
    images = {a.name: b.name for a, b in pairs}
    found = [(relation.kind, members(relation, made)) for relation in result.clean.relations]
    asked = [(relation.kind, shown(relation, own, seen)) for relation in truth.relations]
    shares = [
        share({images.get(name, "") for name in group}, [other for sort, other in found if sort == kind_])
        for kind_, group in asked
        if group
    ]
    return Row(
        known.name,
        known.sort,
        parts=len(own),
        fitted=len(made),
        found=len(pairs),
        kinds=len(alike),
        numbers=sum(sum(seen[copy.leaf]) for copy in own),
        sizes=sum(right(a, b, seen[a.leaf]) for a, b in alike),
        relations=len(shares),
        relations_back=sum(shares),
        iou=result.clean.before.iou,
        clean_iou=result.clean.after.iou,
        cpu_seconds=seconds,
    )


def copies(assembly: pw.Assembly) -> list[Copy]:
    return [
        Copy(part.name if i == 0 else f"{part.name}/{i + 1}", part.name, copy, added)
        for part, added in flattened(assembly)
        for i, copy in enumerate(part.copies)
    ]


def kind(field: Field) -> str:
    return _ONE_KIND.get(field.kind, field.kind)


def matched(own: Sequence[Copy], made: Sequence[Copy], shape: pw.Shape) -> list[tuple[Copy, Copy]]:
    """Pairs of the same sign that share most of their volume within the shape's box, the best first."""
    low, high = shape.vertices.min(axis=0), shape.vertices.max(axis=0)
    points = np.random.default_rng(0).uniform(low, high, (_POINTS, 3))
    inside = [np.stack([copy.part.distance(points) < 0 for copy in side]) for side in (own, made)]
    both = (inside[0][:, None] & inside[1]).sum(axis=2)
    iou = both / np.maximum((inside[0][:, None] | inside[1]).sum(axis=2), 1)
    iou *= np.array([[a.added == b.added for b in made] for a in own])
    chosen = zip(*linear_sum_assignment(-iou), strict=True)
    return [(own[a], made[b]) for a, b in chosen if iou[a, b] >= _SAME]


def right(own: Copy, made: Copy, seen: Sequence[bool]) -> int:
    """How many of the numbers that are seen are right."""
    a, b = numbers(own.part.field), numbers(made.part.field)
    if isinstance(own.part.field, Box | HollowBox):
        turn = np.abs(rotation_matrix(own.part.rotation).T @ rotation_matrix(made.part.rotation))
        b = np.concatenate([b[:3][turn.argmax(axis=1)], b[3:]])
    elif type(own.part.field) is not type(made.part.field):
        b = np.full(len(a), np.nan)  # a cone against a frustum
    return int((np.asarray(seen) & (np.abs(b - a) <= _EXACT * a)).sum())


def numbers(field: Field) -> NDArray[np.float64]:
    return np.asarray(values(field), np.float64)


def members(relation: Relation, of: Sequence[Copy]) -> set[str]:
    """Names of the copies that a relation binds; a leaf's name alone stands for all of its copies."""
    bound: set[str] = set()
    for entry in relation.parts:
        leaf = next((c.leaf for c in of if entry in (c.leaf, c.name) or entry.startswith(c.leaf + " ")), "")
        own = [c.name for c in of if c.leaf == leaf]
        single = "/" in entry or any(other.startswith(f"{leaf}/") for other in relation.parts)
        bound |= {entry} if single else set(own)
    return bound


def shown(relation: Relation, own: Sequence[Copy], seen: Mapping[str, Sequence[bool]]) -> set[str]:
    """The members whose part in the relation is seen in the shape; none where too few are left."""
    group = members(relation, own)
    axis = re.search(r"(?:centred on|flush at) ([xyz]) =", relation.text)
    left = set()
    for copy in (one for one in own if one.name in group):
        names = [d.name for d in dimensions(type(copy.part.field))]
        if axis is not None:
            local = int(np.abs(rotation_matrix(copy.part.rotation)["xyz".index(axis[1])]).argmax())
            bound = [f"size {'xyz'[local]}"] + ["height"] * (local == 2)
        elif relation.kind == "equal":
            entry = next(e for e in (*relation.parts, copy.leaf) if e.startswith(copy.leaf))
            told = f"{entry} {relation.text}".replace("_", " ")
            bound = [name for name in names if name.replace("_", " ") in told]
        else:
            bound = []
        if all(seen[copy.leaf][names.index(name)] for name in bound if name in names):
            left.add(copy.name)
    return left if len(left) > 1 or relation.kind == "centred" or len(group) == 1 else set()


def share(image: set[str], groups: Sequence[set[str]]) -> float:
    """Of the images of a relation's members, those that one relation of the fit binds; one alone is none,
    unless the relation is of one part."""
    best = max((len(image & group) for group in groups), default=0)
    return best / len(image) if best > 1 or len(image) == 1 else 0.0


def summary(rows: Sequence[Row]) -> Iterator[str]:
    yield ("| sort | cases | parts | fitted | found | kinds | sizes | relations | IoU | clean IoU | CPU s |")
    yield "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|"
    sorts = [(sort, [r for r in rows if r.sort == sort]) for sort in dict.fromkeys(r.sort for r in rows)]
    for sort, of in [*sorts, ("**all**", list(rows))]:
        parts, seen = sum(r.parts for r in of), sum(r.numbers for r in of)
        related = max(sum(r.relations for r in of), 1)
        yield (
            f"| {sort} | {len(of)} | {parts} | {sum(r.fitted for r in of)} | "
            f"{sum(r.found for r in of) / parts:.0%} | {sum(r.kinds for r in of) / parts:.0%} | "
            f"{sum(r.sizes for r in of) / seen:.0%} | {sum(r.relations_back for r in of) / related:.0%} | "
            f"{mean(r.iou for r in of):.3f} | {mean(r.clean_iou for r in of):.3f} | "
            f"{median(r.cpu_seconds for r in of):.1f} |"
        )


def document(rows: Sequence[Row], planned: int) -> str:
    lines = [
        "# Round trips: known assemblies of solids, fitted and cleaned",
        "",
        f"`python benchmarks/round_trips.py` on {machine()}."
        + (f" Unfinished: {len(rows)} of {planned} cases." if len(rows) < planned else ""),
        "",
        "Found: a part of the same sign shares half of the volume or more. Kinds: it is of the same kind",
        "too (cone and frustum are one). Sizes: of all numbers that can be seen in the shape, those that",
        "are right to 1 %. Relations: of those of the known assembly, the share that binds the same parts.",
        "CPU seconds of fitting and cleaning. First reach: 80 % of kinds.",
        "",
        *summary(rows),
        "",
        "| case | parts | fitted | found | kinds | sizes | relations | IoU | clean IoU | CPU s |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for r in rows:
        lines.append(
            f"| {r.name} | {r.parts} | {r.fitted} | {r.found} | {r.kinds} | {r.sizes} of {r.numbers} | "
            f"{r.relations_back:.1f} of {r.relations} | {r.iou:.3f} | {r.clean_iou:.3f} | "
            f"{r.cpu_seconds:.1f} |"
        )
    return "\n".join(lines) + "\n"


def main() -> int:
    options = parser().parse_args()
    path = options.output.with_suffix(".csv")
    chosen = set(filter(None, options.names.split(",")))
    if options.keep:
        options.keep.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        rows = recorded.read(path, Row)
        if any(row.name == name for row in rows) or (chosen and name not in chosen):
            continue
        row = run(known_assembly(name), options.keep)
        recorded.append(path, row)
        print(
            f"{row.name}: kinds {row.kinds} of {row.parts}, sizes {row.sizes} of {row.numbers}, relations "
            f"{row.relations_back:.1f} of {row.relations}, IoU {row.clean_iou:.3f}, {row.cpu_seconds:.1f} s",
            flush=True,
        )
        write_bytes(options.output, document([*rows, row], len(NAMES)).encode())
    rows = recorded.read(path, Row)
    write_bytes(options.output, document(rows, len(NAMES)).encode())
    print("", *summary(rows), sep="\n")
    return 0


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = result.add_argument
    option("--names", default="", metavar="A,B", help="only these cases")
    option("--keep", type=Path, metavar="FOLDER", help="also save each known assembly and its fit there")
    option("-o", "--output", type=Path, default=HERE / "results" / "round_trips.md", metavar="FILE")
    return result


if __name__ == "__main__":
    sys.exit(main())
