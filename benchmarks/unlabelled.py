"""How much of a family's parts `parts match` finds where their labels are hidden.

    python benchmarks/unlabelled.py [--made chairs:24 mixers:12 cars:8] [--parts FOLDER ...]

Made families are given by their whole surfaces alone; a folder of --parts has a folder a shape, with a mesh a
part and the whole as `_whole`. Surfaces are compared with the nearest true part.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.optimize import linear_sum_assignment

import partwright as pw
from partwright.atomic_io import write_bytes
from partwright.batch.unlabelled import Cut, cut_surface
from partwright.datasets.families import family
from partwright.datasets.inputs import PartFolder
from partwright.datasets.matching import COMMON, Matching, match
from partwright.shapes import MeshDistance, Shape

RESULTS = Path(__file__).parent / "results"


@dataclass(frozen=True)
class Labelled:
    """A shape without labels, cut by its fit, and what was hidden: the true part (F,) and area (F,) of each
    face, which sum to 1."""

    cut: Cut
    true: np.ndarray
    area: np.ndarray


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--made", nargs="*", default=["chairs:24", "mixers:12", "cars:8"])
    parser.add_argument("--parts", nargs="*", type=Path, default=[])
    parser.add_argument("--output", type=Path, default=RESULTS / "unlabelled.md")
    arguments = parser.parse_args()
    lines = [
        "# Parts of families whose labels are hidden", "",
        f"`{' '.join(['python', 'benchmarks/unlabelled.py', *_plain(sys.argv[1:])])}`", "",
        "Fits of draft quality, one thread. Surface: the share that is rightly labelled, where each true "
        "part is one found part at most, in all shapes the same; pIoU: mean over shapes and their true "
        "parts, by area. Pure: each found part stands for the true part that most of it is, so that a "
        "body in ten pieces counts. Best: regions of the fits, each by itself by its true part, which no "
        "matching can exceed. One part: all is the largest. To one template: one shape's regions are the "
        "parts, by the same assignment; mean over all shapes as the template.", "",
        "| family | shapes | parts | found | surface % | pIoU % | pure % | best % | one part % | "
        "to one template: surface, pIoU % | s a fit | s matching |",
        "|---|---|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for spec in arguments.made:
        name, _, count = spec.partition(":")
        shapes = [(s.name, dict(s.parts), s.whole) for s in family(name, int(count))]
        lines.append(row(f"{name}, made", shapes))
        print(lines[-1], flush=True)
    for folder in arguments.parts:
        lines.append(row(folder.name, [_read(entry) for entry in sorted(folder.iterdir()) if entry.is_dir()]))
        print(lines[-1], flush=True)
    write_bytes(arguments.output, ("\n".join(lines) + "\n").encode())
    print(f"written to {arguments.output}")


def _plain(words: Sequence[str]) -> list[str]:
    """Folders by their last names."""
    return [Path(word).name if Path(word).is_absolute() else word for word in words]


def _read(folder: Path) -> tuple[str, dict[str, trimesh.Trimesh], trimesh.Trimesh]:
    shape = PartFolder(folder).read()
    parts = {name: trimesh.Trimesh(p.vertices, p.faces, process=False) for name, p in shape.parts.items()}
    (whole,) = shape.whole
    return shape.name, parts, trimesh.Trimesh(whole.vertices, whole.faces, process=False)


def row(name: str, shapes: Sequence[tuple[str, dict[str, trimesh.Trimesh], trimesh.Trimesh]]) -> str:
    start = time.process_time()
    labelled = [hidden(*shape) for shape in shapes]
    fits = (time.process_time() - start) / len(shapes)
    names = sorted({str(n) for one in labelled for n in np.unique(one.true)})
    start = time.process_time()
    regions = [one.cut.regions for one in labelled]
    found = match(regions, COMMON)
    seconds = time.process_time() - start
    right, part_iou, pure = scores(labelled, found, names)
    templates = [scores(labelled, match(regions, template=i), names)[:2] for i in range(len(regions))]
    template = 100 * np.mean(templates, axis=0)
    largest = np.mean([[one.area[one.true == n].sum() for n in names] for one in labelled], axis=0).max()
    best = np.mean([_best(one, names) for one in labelled])
    numbers = " | ".join(f"{100 * x:.1f}" for x in (right, part_iou, pure, best, largest))
    return (f"| {name} | {len(shapes)} | {len(names)} | {len(found.slots)} | {numbers} | "
            f"{template[0]:.1f}, {template[1]:.1f} | {fits:.1f} | {seconds:.2f} |")  # fmt: skip


def hidden(name: str, parts: dict[str, trimesh.Trimesh], whole: trimesh.Trimesh) -> Labelled:
    shape: Shape = pw.load_shape(whole)
    cut = cut_surface(name, shape, pw.fit(shape, quality="draft", threads=1).assembly)
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in parts.values()])
    vertices = shape.frame.to_unit(np.concatenate([mesh.vertices for mesh in parts.values()]))
    faces = np.concatenate([m.faces + o for m, o in zip(parts.values(), offsets, strict=False)])
    owner = np.repeat(list(parts), [len(mesh.faces) for mesh in parts.values()])
    middle = shape.frame.to_unit(cut.vertices[cut.faces].mean(axis=1))
    nearest, _ = MeshDistance(vertices, faces, faces, closed=False).nearest(middle)
    sides = np.diff(cut.vertices[cut.faces], axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return Labelled(cut, owner[nearest], area / area.sum())


def scores(labelled: Sequence[Labelled], found: Matching, names: Sequence[str]) -> tuple[float, float, float]:
    """Share of the surface, mean IoU of parts, and purity."""
    labels = [of[one.cut.region] for one, of in zip(labelled, found.of, strict=True)]
    shared = np.zeros((len(found.slots), len(names)))
    for one, label in zip(labelled, labels, strict=True):
        for j, name in enumerate(names):
            mine = one.true == name
            shared[:, j] += np.bincount(label[mine], weights=one.area[mine], minlength=len(shared))
    slots, columns = linear_sum_assignment(-shared)
    slot_of = dict(zip(columns.tolist(), slots.tolist(), strict=True))
    ious = []
    for one, label in zip(labelled, labels, strict=True):
        for j, name in enumerate(names):
            true, said = one.true == name, label == slot_of.get(j, -1)
            if true.any():
                ious.append(one.area[true & said].sum() / one.area[true | said].sum())
    total = shared.sum()
    return (float(shared[slots, columns].sum() / total), float(np.mean(ious)),
            float(shared.max(axis=1).sum() / total))  # fmt: skip


def _best(one: Labelled, names: Sequence[str]) -> float:
    regions = np.unique(one.cut.region)
    return sum(
        max(float(one.area[(one.cut.region == r) & (one.true == n)].sum()) for n in names) for r in regions
    )


if __name__ == "__main__":
    main()
