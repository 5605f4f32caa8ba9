"""New shapes against held-out ones: MMD-CD, COV-CD and 1-NNA, by parts, whether parts touch, how new."""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from partsdf_scores import command_line, scale_of, write
from scipy.spatial import cKDTree

from partwright.datasets.families.recipes import recipe_of
from partwright.datasets.inputs import MadeShape
from partwright.datasets.labelling import label_surface
from partwright.datasets.prepared import PreparedFamily
from partwright.errors import NoSurfaceError
from partwright.metrics.sets import chamfer_matrix, scores_of_distances
from partwright.partsdf.generator import load_generator
from partwright.partsdf.generator_training import gaussian_samples
from partwright.partsdf.meshing import labelled_surface, mesh_shape
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.novelty import nearest_training_shape
from partwright.shapes.sampling import morton_order, sample_triangles

POINTS, PART_POINTS = 512, 1500
MATCHED = 128  # of a part's points, where parts are compared
TOUCH, USUAL = 0.04, 0.95  # unit lengths; the share of training shapes in which two parts touch


@dataclass(frozen=True)
class Cloud:
    """points (N, 3) of the whole surface, and of each part (P,), empty where it is absent."""

    points: np.ndarray
    parts: list[np.ndarray]


@dataclass(frozen=True)
class Distances:
    """Of A shapes to B held-out ones: Chamfer distances among them (A, A), and between, whole and by part
    (A, B)."""

    among: np.ndarray
    between: np.ndarray
    by_part: np.ndarray

    @classmethod
    def of(cls, made: Sequence[Cloud], held: Sequence[Cloud]) -> Distances:
        wholes = [c.points for c in made]
        between = chamfer_matrix(wholes, [c.points for c in held])
        return cls(chamfer_matrix(wholes), between, part_distances(made, held))


@dataclass(frozen=True)
class Held:
    """Held-out shapes: clouds (B,), the distances (B, B) among them, and which parts usually touch (P, P)."""

    clouds: list[Cloud]
    among: np.ndarray
    usual: np.ndarray


def generation(arguments: argparse.Namespace) -> None:
    """Diffusion, a Gaussian, and training shapes against as many held-out ones."""
    family, model = PreparedFamily(arguments.family), load_model(arguments.model)
    real = [cloud_of_family(family, i) for i in family.split("test")[: arguments.held]]
    real += [fresh_cloud(family, i) for i in range(arguments.fresh)]
    count = len(real)
    numbers = {entry.name: i for i, entry in enumerate(family.shapes)}
    training = [cloud_of_family(family, numbers[name]) for name in model.shapes]
    held = Held(real, chamfer_matrix([c.points for c in real]), touching_pairs(training))
    lines = [
        f"# PartSDF: new {family.name} against held-out ones", "",
        f"Trained on {scale_of(model)}. {count} samples of each kind against as many held-out shapes, "
        f"{arguments.fresh} of which were made with another seed; meshed at {arguments.resolution}^3, "
        f"{POINTS:,} points each; failures are left out and counted. By part: the mean Chamfer distance of "
        f"the parts that both have, {MATCHED} points each. "
        f"Touch: the share of shapes whose parts touch (within {TOUCH}) wherever those of {USUAL:.0%} of the "
        "training shapes do and both are there. New: the median of the mean difference of clamped distances "
        "to the nearest training shape, x1e4, and the least. Training shapes are drawn once each, as far as "
        "they go; nearest: the training shape that is "
        "nearest to each held-out one, so that one may come several times; decoded: "
        "what the model has for them.", "",
        command_line(), "",
        "| | MMD-CD x1e4 | COV-CD % | 1-NNA % | by part: MMD x1e4 | COV % | touch % | new, median | least | "
        "failed | s a sample |",
        "|---|---|---|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip

    def say(line: str) -> None:
        lines.append(line)
        print(line, flush=True)
        write(f"generation-{family.name}", lines)  # the rows so far

    drawn = np.random.default_rng(0).permutation(len(training))[:count]
    nearest = chamfer_matrix([c.points for c in training], [c.points for c in real]).argmin(axis=0)
    for label, rows in (("training shapes", drawn), ("nearest training shapes", nearest)):
        shapes = [training[i] for i in rows]
        say(row(label, shapes, held, Distances.of(shapes, real), [], 0, 0.0))
    for label, make in (
        ("training shapes, decoded", lambda: [NeuralShape.trained(model, model.shapes[i]) for i in drawn]),
        ("Gaussian", lambda: gaussian_samples(model, count, arguments.seed)),
        ("diffusion", lambda: load_generator(model).generate(count, arguments.seed)),
    ):
        start = time.process_time()
        made = make()
        clouds = [cloud_of(shape, arguments.resolution) for shape in made]
        seconds = (time.process_time() - start) / len(made)
        far = [nearest_training_shape(shape)[1] for shape in made]
        there = [cloud for cloud in clouds if cloud]
        failed = len(made) - len(there)
        say(row(label, there, held, Distances.of(there, real), far, failed, seconds))


def row(
    label: str, clouds: Sequence[Cloud], held: Held, distances: Distances, far: list[float],
    failed: int, seconds: float,
) -> str:  # fmt: skip
    scores = scores_of_distances(distances.among, distances.between, held.among)
    covered = len(np.unique(distances.by_part.argmin(axis=1))) / len(held.clouds)
    touch = np.mean([holds_together(cloud, held.usual) for cloud in clouds])
    new = f"{1e4 * np.median(far):.0f} | {1e4 * min(far):.0f}" if far else " | "
    return (
        f"| {label} | {1e4 * scores.mmd:.1f} | {100 * scores.coverage:.1f} | "
        f"{100 * scores.nearest_accuracy:.1f} | {1e4 * distances.by_part.min(axis=0).mean():.1f} | "
        f"{100 * covered:.1f} | {100 * touch:.0f} | {new} | {failed} | "
        f"{f'{seconds:.1f}' if seconds else ''} |"
    )


def part_distances(made: Sequence[Cloud], real: Sequence[Cloud]) -> np.ndarray:
    """(A, B) mean Chamfer distance of the parts that both have; infinite where there are none."""
    total, count = np.zeros((len(made), len(real))), np.zeros((len(made), len(real)))
    for p in range(len(real[0].parts)):
        rows, columns = ([i for i, c in enumerate(clouds) if len(c.parts[p])] for clouds in (made, real))
        first, second = ([thinned(a[i].parts[p]) for i in own] for a, own in ((made, rows), (real, columns)))
        total[np.ix_(rows, columns)] += chamfer_matrix(first, second)
        count[np.ix_(rows, columns)] += 1
    return np.where(count > 0, total / np.maximum(count, 1), np.inf)


def thinned(points: np.ndarray) -> np.ndarray:
    """(MATCHED, 3), evenly from points that lie along a curve that fills space."""
    return points[np.linspace(0, len(points) - 1, MATCHED).round().astype(int)]


def cloud_of_family(family: PreparedFamily, index: int) -> Cloud:
    shape = family.load(index)
    return _cloud(shape.vertices, shape.faces, shape.label, len(family.parts))


def fresh_cloud(family: PreparedFamily, number: int) -> Cloud:
    """Of a shape of a made family with another seed, which no model has seen: only its surface is made."""
    made = MadeShape(family.name, family.seed + 1, number).read()
    if recipe_of(family.name).parts != family.parts:
        raise SystemExit(f"{family.folder}: has not the parts of made {family.name}; prepare it again")
    labelled = label_surface(made, family.parts)
    vertices = labelled.shape.frame.to_unit(labelled.shape.vertices)
    return _cloud(vertices, labelled.shape.faces, labelled.label, len(family.parts))


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
        each.append(points_on(corners, mine, PART_POINTS) if len(mine) else np.zeros((0, 3)))
    return Cloud(points_on(corners, triangles, POINTS), each)


def points_on(corners: np.ndarray, triangles: np.ndarray, count: int) -> np.ndarray:
    """In the order of a curve that fills space: neighbours asked for in turn are found faster.

    Each surface has random numbers of its own. By the same ones, made shapes, whose triangles are alike,
    would have points at like places, and be nearer to one another than to those that are meshed otherwise.
    """
    points = sample_triangles(corners, triangles, count, zlib.crc32(corners.tobytes()))[0]
    return points[morton_order(points)]


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
