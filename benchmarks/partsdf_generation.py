"""New shapes against held-out ones: MMD-CD, COV-CD and 1-NNA, whether parts touch, and how new they are."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from partsdf_scores import command_line, scale_of, write
from scipy.spatial import cKDTree

from partwright.datasets.prepared import PreparedFamily
from partwright.errors import NoSurfaceError
from partwright.metrics.sets import chamfer_matrix, set_scores
from partwright.partsdf.generator import load_generator
from partwright.partsdf.generator_training import gaussian_samples
from partwright.partsdf.meshing import labelled_surface, mesh_shape
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.novelty import nearest_training_shape
from partwright.shapes.sampling import sample_triangles

POINTS, PART_POINTS = 2048, 1500
TOUCH, USUAL = 0.04, 0.95  # unit lengths; the share of training shapes in which two parts touch


@dataclass(frozen=True)
class Cloud:
    """points (N, 3) of the whole surface, and of each part (P,), empty where it is absent."""

    points: np.ndarray
    parts: list[np.ndarray]


@dataclass(frozen=True)
class Held:
    """Held-out shapes: clouds (B,), the distances (B, B) among them, and which parts usually touch (P, P)."""

    clouds: list[Cloud]
    among: np.ndarray
    usual: np.ndarray


def generation(arguments: argparse.Namespace) -> None:
    """Diffusion, a Gaussian, and training shapes against as many held-out ones."""
    family, model = PreparedFamily(arguments.family), load_model(arguments.model)
    unknown = [(family, i) for i in family.split("test")]
    if arguments.fresh:  # made with another seed, so all of them are unknown to the model
        fresh = PreparedFamily(arguments.fresh)
        unknown += [(fresh, i) for i in range(len(fresh))]
    real = [cloud_of_family(source, i) for source, i in unknown[: arguments.samples]]
    count = len(real)
    rng = np.random.default_rng(0)
    numbers = {entry.name: i for i, entry in enumerate(family.shapes)}
    training = [cloud_of_family(family, numbers[name]) for name in model.shapes]
    held = Held(real, chamfer_matrix([c.points for c in real]), touching_pairs(training))
    lines = [
        f"# PartSDF: new {family.name} against held-out ones", "",
        f"Trained on {scale_of(model)}. {count} samples of each kind against as many held-out shapes, "
        f"meshed at {arguments.resolution}^3, {POINTS:,} points each; failures are left out and counted. "
        f"Touch: the share of shapes whose parts touch (within {TOUCH}) wherever those of {USUAL:.0%} of the "
        "training shapes do and both are there. New: the median of the mean difference of clamped distances "
        "to the nearest training shape, x1e4, and the least.", "",
        command_line(), "",
        "| | MMD-CD x1e4 | COV-CD % | 1-NNA % | touch % | new, median | least | "
        "failed | s a sample |",
        "|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    chosen = [training[i] for i in rng.choice(len(training), count, replace=False)]
    lines.append(row("training shapes", chosen, held, [], 0, 0.0))
    generator = load_generator(model)
    for label, make in (
        ("diffusion", lambda: generator.generate(count, arguments.seed)),
        ("Gaussian", lambda: gaussian_samples(model, count, arguments.seed)),
    ):
        start = time.process_time()
        shapes = make()
        clouds = [cloud_of(shape, arguments.resolution) for shape in shapes]
        seconds = (time.process_time() - start) / len(shapes)
        far = [nearest_training_shape(shape)[1] for shape in shapes]
        there = [cloud for cloud in clouds if cloud]
        lines.append(row(label, there, held, far, len(shapes) - len(there), seconds))
        print(lines[-1], flush=True)
    write(f"generation-{family.name}", lines)


def row(
    label: str, clouds: Sequence[Cloud], held: Held, far: list[float], failed: int, seconds: float
) -> str:  # fmt: skip
    scores = set_scores([c.points for c in clouds], [c.points for c in held.clouds], held.among)
    touch = np.mean([holds_together(cloud, held.usual) for cloud in clouds])
    new = f"{1e4 * np.median(far):.0f} | {1e4 * min(far):.0f}" if far else " | "
    return (
        f"| {label} | {1e4 * scores.mmd:.1f} | {100 * scores.coverage:.1f} | "
        f"{100 * scores.nearest_accuracy:.1f} | {100 * touch:.0f} | {new} | {failed} | "
        f"{f'{seconds:.1f}' if seconds else ''} |"
    )


def cloud_of_family(family: PreparedFamily, index: int) -> Cloud:
    shape = family.load(index)
    return _cloud(shape.vertices, shape.faces, shape.label, len(family.parts))


def cloud_of(shape: NeuralShape, resolution: int) -> Cloud | None:
    try:
        surface = labelled_surface(shape, mesh_shape(shape, resolution, parts=False).whole)
    except NoSurfaceError:
        return None
    return _cloud(surface.vertices, surface.faces, surface.label, len(shape.model.parts))


def _cloud(vertices: np.ndarray, faces: np.ndarray, label: np.ndarray, parts: int) -> Cloud:
    corners, triangles = vertices.astype(np.float64), faces.astype(np.int64)
    each = []
    for p in range(parts):
        mine = triangles[label == p]
        each.append(sample_triangles(corners, mine, PART_POINTS, 0)[0] if len(mine) else np.zeros((0, 3)))
    return Cloud(sample_triangles(corners, triangles, POINTS, 0)[0], each)


def touching(cloud: Cloud) -> np.ndarray:
    """(P, P): whether two parts touch; nan where one is absent."""
    parts = cloud.parts
    found = np.full((len(parts), len(parts)), np.nan)
    for i, a in enumerate(parts):
        for j in range(i):
            if len(a) and len(parts[j]):
                found[i, j] = cKDTree(a).query(parts[j])[0].min() < TOUCH
    return found


def touching_pairs(clouds: Sequence[Cloud]) -> np.ndarray:
    """(P, P) of those pairs that usually touch."""
    all_pairs = np.array([touching(cloud) for cloud in clouds])
    there = (~np.isnan(all_pairs)).sum(axis=0)
    return np.nansum(all_pairs, axis=0) >= USUAL * np.maximum(there, 1)


def holds_together(cloud: Cloud, usual: np.ndarray) -> bool:
    found = touching(cloud)
    return bool((found[usual & ~np.isnan(found)] == 1).all())
