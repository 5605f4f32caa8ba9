"""What tells new shapes from made ones: their surface, or the points that are drawn on it.

    python benchmarks/partsdf_sampling.py [--model cars] [--count 50] [--threads 1]

Training shapes as they were made, as the model has them, and new ones, against as many made shapes of
another seed: with the same random numbers for the points of all surfaces, as the tables of generation had
them, and with numbers of each surface's own. Surfaces are made anew, so no prepared family is needed.
Table: benchmarks/results/partsdf-sampling-NAME.md.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence

import numpy as np
import torch
from partsdf_scores import write

from partwright.datasets.inputs import MadeShape
from partwright.datasets.labelling import label_surface
from partwright.metrics.sets import chamfer_matrix, scores_of_distances
from partwright.partsdf.generator import load_generator
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.shapes.sampling import sample_triangles

POINTS, RESOLUTION, STREAM = 512, 96, 1000
Mesh = tuple[np.ndarray, np.ndarray]


def made(family: str, parts: Sequence[str], seed: int, number: int) -> Mesh:
    """A made shape's surface, unit frame."""
    shape = label_surface(MadeShape(family, seed, number).read(), parts).shape
    return shape.frame.to_unit(shape.vertices).astype(np.float64), shape.faces.astype(np.int64)


def decoded(shape: NeuralShape) -> Mesh:
    mesh = mesh_shape(shape, RESOLUTION, parts=False).whole
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def clouds(meshes: Sequence[Mesh], stream: int | None) -> list[np.ndarray]:
    """By the same random numbers if `stream` is None, else each by its own."""
    seeds = [0 if stream is None else STREAM * stream + i for i in range(len(meshes))]
    return [sample_triangles(*mesh, POINTS, seed)[0] for mesh, seed in zip(meshes, seeds, strict=True)]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--model", default="cars")
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--threads", type=int, default=0)
    arguments = parser.parse_args()
    if arguments.threads:
        torch.set_num_threads(arguments.threads)
    model, count = load_model(arguments.model), arguments.count
    family, names = model.config.family, model.shapes[: arguments.count]
    held = [made(family, model.parts, 1, i) for i in range(count)]
    sets = {
        "training shapes": [made(family, model.parts, 0, int(name.rsplit("_", 1)[1])) for name in names],
        "the same, decoded": [decoded(NeuralShape.trained(model, name)) for name in names],
        "new ones": [decoded(shape) for shape in load_generator(model).generate(count, 0)],
    }
    lines = [
        f"# PartSDF: points on surfaces of {family}", "",
        f"{count} shapes of each kind against as many made ones, {POINTS} points each, decoded at "
        f"{RESOLUTION}^3; by the same random numbers for all surfaces, and by each surface's own.", "",
        f"    python benchmarks/partsdf_sampling.py {shlex.join(sys.argv[1:])}", "",
        "| random numbers | | MMD-CD x1e4 | COV-CD % | 1-NNA % |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for how, own in (("the same", False), ("own", True)):
        real = clouds(held, 0 if own else None)
        among = chamfer_matrix(real)
        for stream, (label, meshes) in enumerate(sets.items(), 1):
            points = clouds(meshes, stream if own else None)
            scores = scores_of_distances(chamfer_matrix(points), chamfer_matrix(points, real), among)
            lines.append(
                f"| {how} | {label} | {1e4 * scores.mmd:.1f} | {100 * scores.coverage:.0f} | "
                f"{100 * scores.nearest_accuracy:.0f} |"
            )
            print(lines[-1], flush=True)
    write(f"sampling-{family}", lines)


if __name__ == "__main__":
    main()
