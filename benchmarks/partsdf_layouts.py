"""What new shapes are told by: layouts or forms, each in turn exchanged for a training shape's."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
import torch
import trimesh
from partsdf_generation import POINTS, points_on
from partsdf_likeness import new_meshes
from partsdf_scores import command_line, write

from partwright.errors import NoSurfaceError
from partwright.metrics.sets import chamfer_matrix, scores_of_distances
from partwright.partsdf.generator import load_generator
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import POSE, PartVectors

CELLS, OFF = 64, 0.1  # along the unit frame; in poses' spreads
LAYOUTS = 480  # to see how they spread, without meshes


def layouts_or_forms(arguments: argparse.Namespace) -> None:
    """1-NNA of new shapes with made layouts, made forms, or both."""
    count = arguments.count
    names = arguments.names.split(",")
    lines = [
        "# PartSDF: what new shapes are told by", "",
        f"{count} of each kind against as many shapes of the family, made with another seed; meshed at "
        f"{CELLS}^3, {POINTS} points each. 50 % of 1-NNA is what cannot be told, 100 what always is. "
        "Projected: latents along the principal directions that a generator knows. Off: numbers of poses by "
        f"a normal error of {OFF} of their spreads. Made forms: as they are denoised; mixed: from those of "
        "three training shapes. Nearest forms: each part's the training shape's that is "
        "nearest; nearest layout: forms of the training shape whose layout is nearest.", "",
        command_line(), "",
        f"| | {' | '.join(f'{name}: MMD-CD x1e4 | COV-CD % | 1-NNA %' for name in names)} |",
        "|---|" + "---|---|---|" * len(names),
    ]  # fmt: skip
    rows: dict[str, list[str]] = {}
    spreads = []
    for name in names:
        spreads.append(how_wide(load_model(name), arguments.seed))
        held = [cloud(mesh) for mesh in new_meshes(name, count)]
        among = chamfer_matrix(held)
        for label, make in variants(load_model(name), count, arguments.seed).items():
            start, made = time.process_time(), clouds_of(make())
            scores = scores_of_distances(chamfer_matrix(made), chamfer_matrix(made, held), among)
            said = (
                f"{1e4 * scores.mmd:.1f} | {100 * scores.coverage:.0f} | {100 * scores.nearest_accuracy:.0f}"
            )
            rows.setdefault(label, []).append(said)
            print(f"{name}, {label}: {said}, {time.process_time() - start:.0f} s", flush=True)
    table = [f"| {label} | {' | '.join(said)} |" for label, said in rows.items()]
    said = f"Of the variance of training layouts, {LAYOUTS} made ones have: {', '.join(spreads)}."
    write("layouts-or-forms", [*lines, *table, "", said])


def how_wide(model: Model, seed: int) -> str:
    """How much of the variance of training layouts made ones have."""
    generator = load_generator(model)
    training = generator.layout_of(model.poses, model.present)
    made = torch.stack([
        generator.layout_of(shape.poses, shape.present) for shape in generator.generate(LAYOUTS, seed)
    ])  # fmt: skip
    wide, known = (float(one.var(dim=0).sum()) for one in (made, training))
    return f"{model.name} {wide / known:.2f}"


def variants(model: Model, count: int, seed: int) -> dict[str, Callable[[], list[NeuralShape]]]:
    vectors, generator = PartVectors.of(model), replace(load_generator(model), matched=False)
    drawn = np.random.default_rng(0).permutation(len(model.shapes))[:count]
    training = [NeuralShape.trained(model, model.shapes[i]) for i in drawn]
    made = generator.generate(count, seed)
    known = vectors.of_poses(model.poses).flatten(1)

    def projected(shape: NeuralShape) -> NeuralShape:
        (latents,) = vectors.latents(vectors.of_latents(shape.latents[None]))
        return replace(shape, latents=torch.where(shape.present[:, None], latents, shape.latents))

    def off(number: int, shape: NeuralShape) -> NeuralShape:
        error = torch.randn(len(model.parts), POSE, generator=torch.Generator().manual_seed(number))
        poses = vectors.poses(vectors.of_poses(shape.poses) + OFF * error)
        return NeuralShape.of(model, shape.latents, poses, shape.present)

    def nearest_forms(shape: NeuralShape) -> NeuralShape:
        (latents,) = vectors.nearest_trained(model, shape.latents[None])
        return NeuralShape.of(model, latents, shape.poses, shape.present)

    def nearest_layout(shape: NeuralShape) -> NeuralShape:
        apart = torch.cdist(known, vectors.of_poses(shape.poses).flatten()[None])[:, 0]
        return NeuralShape.of(model, model.latents[int(apart.argmin())], shape.poses, shape.present)

    return {
        "training shapes": lambda: training,
        "training shapes, projected": lambda: [projected(s) for s in training],
        "training shapes, poses off": lambda: [off(k, s) for k, s in enumerate(training)],
        "training layouts, made forms": lambda: [
            generator.generate(1, seed + k, s, keep_layout=True)[0] for k, s in enumerate(training)
        ],
        "made layouts, made forms": lambda: made,
        "made layouts, mixed forms": lambda: replace(generator, matched=True).generate(count, seed),
        "made layouts, nearest forms": lambda: [nearest_forms(s) for s in made],
        "made layouts, forms of the nearest layout": lambda: [nearest_layout(s) for s in made],
    }


def cloud(mesh: trimesh.Trimesh) -> np.ndarray:
    return points_on(np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64), POINTS)


def clouds_of(shapes: Sequence[NeuralShape]) -> list[np.ndarray]:
    """Of those that have a surface."""
    found = []
    for shape in shapes:
        with suppress(NoSurfaceError):
            found.append(cloud(mesh_shape(shape, CELLS, parts=False).whole))
    return found
