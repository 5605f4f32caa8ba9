"""Held-out shapes from points as scanners give them: few and many, with noise, with a side missing; and what
comes back of parts that half a scan does not show."""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from unittest.mock import patch

import numpy as np
import torch
from partsdf_encoder import NEAR
from partsdf_scores import command_line, scale_of, write

import partwright as pw
from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import PartwrightError
from partwright.metrics.iou import occupancy_iou
from partwright.partsdf import unseen
from partwright.partsdf.encoder import load_encoder
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct_unknown
from partwright.partsdf.targets import Target
from partwright.shapes import Shape
from partwright.shapes.sampling import sample_triangles


@dataclass(frozen=True)
class Scan:
    """count: of points; noise: standard deviation, unit lengths; missing: share beyond a plane."""

    name: str
    count: int
    noise: float = 0.0
    missing: float = 0.0


SCANS = (
    Scan("30,000 points", 30_000),
    Scan("2,048 points", 2048),
    Scan("2,048, noise of 0.005", 2048, 0.005),
    Scan("2,048, noise of 0.02", 2048, 0.02),
    Scan("2,048, a quarter missing", 2048, 0.0, 0.25),
    Scan("2,048, half missing", 2048, 0.0, 0.5),
)


def scanning(arguments: argparse.Namespace) -> None:
    """IoUs of occupancies, of the first parts and of the refined ones."""
    family, model = PreparedFamily(arguments.family), load_model(arguments.model)
    shapes = [family.load(i) for i in family.split("test")[: arguments.shapes]]
    first = "encoder" if load_encoder(model) else "nearest training shape"
    aim = "the surface that is laid through them" if arguments.surface else "these themselves"
    how = (
        f"Trained on {scale_of(model)}. {len(shapes)} test shapes, without labels, as they stand, from "
        f"points alone; what is come close to is {aim}. Noise is in unit lengths, of which the longest side "
        f"has 1.8. IoU and its mean over parts: at all samples, and at those within {NEAR} of the true "
        f"surface. First: {first}. Refined: {arguments.iterations} iterations of {arguments.points:,} "
        "samples. Seconds of the processor, one thread, and of laying the surface, which comes on top."
    )
    lines = [f"# PartSDF: held-out {family.name} from scans", "", how, "", command_line(), "",
             "| | first: IoU, pIoU % | near | refined: IoU, pIoU % | near | s | surface, s |",
             "|---|---|---|---|---|---|---|"]  # fmt: skip
    few = ReconstructionSettings(iterations=0, start="encoder" if load_encoder(model) else "nearest")
    full = ReconstructionSettings(iterations=arguments.iterations, points=arguments.points)
    for scan in SCANS:
        rows, failed = [], 0
        for number, shape in enumerate(shapes):
            start = time.process_time()
            try:
                seen = pw.load_shape(scanned(shape, scan, number))
            except PartwrightError:
                failed += 1
                continue
            laid = time.process_time() - start
            target = Target.of_shape(seen) if arguments.surface else Target.seen_in(seen)
            before = scores(reconstruct_unknown(model, target, few), seen, shape)
            start = time.process_time()
            after = scores(reconstruct_unknown(model, target, full), seen, shape)
            rows.append((*before, *after, time.process_time() - start, laid))
        means = np.mean(rows, axis=0) if rows else np.full(10, np.nan)
        cells = [f"{100 * a:.1f}, {100 * b:.1f}" for a, b in means[:8].reshape(4, 2)]
        name = scan.name + (f" ({failed} without a surface)" if failed else "")
        lines.append(f"| {name} | {' | '.join(cells)} | {means[8]:.1f} | {means[9]:.1f} |")
        print(lines[-1], flush=True)
    write(f"scans-{family.name}{'-surface' if arguments.surface else ''}", lines)


def scanned(shape: PreparedShape, scan: Scan, seed: int) -> np.ndarray:
    """Points (N, 3) of a prepared shape, unit frame, with what lies beyond a plane left out."""
    rng = np.random.default_rng(seed)
    drawn = round(scan.count / (1 - scan.missing))
    points, _ = sample_triangles(shape.vertices.astype(np.float64), shape.faces.astype(np.int64), drawn, seed)
    along = points @ rng.standard_normal(3)
    points = points[np.argsort(along)[: scan.count]]
    return np.asarray(points + scan.noise * rng.standard_normal(points.shape))


def scores(found: NeuralShape, seen: Shape, shape: PreparedShape) -> tuple[float, ...]:
    """IoU and its mean over the parts that the shape has, at all samples and near the surface."""
    # What was found lies in the frame of what was seen.
    points = seen.frame.to_unit(shape.points.astype(np.float64)).astype(np.float32)
    each = found.part_distances(points)
    inside, true = found.whole(each) < 0, shape.sdf < 0
    owner = np.where(inside, np.flatnonzero(found.present.numpy())[each.argmin(axis=0)], -1)
    label = np.where(true, shape.part, -1)
    result: list[float] = []
    for rows in (np.ones(len(points), bool), np.abs(shape.sdf) < NEAR):
        parts = [occupancy_iou(owner[rows] == p, label[rows] == p) for p in np.flatnonzero(shape.present)]
        result += [occupancy_iou(inside[rows], true[rows]), float(np.mean(parts))]
    return tuple(result)


SCANNED, SAMPLES = 4096, 8000  # points of a whole shape; samples of a target
SHOWN = 20  # points of a part, at least, with which it counts as seen
STRIDE = 13  # between the training shapes that are taken


def halving(arguments: argparse.Namespace) -> None:
    """How many parts that half a scan does not show come back, where the rest lies as it should."""
    lines = [
        "# PartSDF: parts that half a scan does not show", "",
        f"Training shapes of the models that ship, every {STRIDE}th; what is not seen is told by the other "
        f"ones. {SCANNED:,} points of each, the half on one side of a plane of random direction; parts with "
        f"less than {SHOWN} of these are lost, the others lie as the shape has them. Back: lost ones that "
        "are added; wrong: added ones that the shape has not. Without a plane: where it is not looked for "
        "where a scan ends.", "",
        command_line(), "",
        "| | shapes | lost | back | wrong | back, without a plane | wrong, without a plane |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for wanted in arguments.models.split(","):
        name, count = wanted.split(":")
        model, counts = load_model(name), np.zeros(5, int)
        for number in range(int(count)):
            counts += half_found(model, (STRIDE * number + 5) % len(model.shapes), number)
        lines.append(f"| {name} | {count} | {' | '.join(map(str, counts))} |")
        print(lines[-1], flush=True)
    write("unseen", lines)


def half_found(model: Model, index: int, seed: int) -> np.ndarray:
    """Parts lost, back, wrong, and these two without a plane (5,), of a training shape."""
    whole = NeuralShape.trained(model, str(index))
    surface = mesh_shape(whole, 64, parts=False).whole
    points = np.asarray(sample_triangles(surface.vertices, surface.faces, SCANNED, 0)[0])
    along = points @ np.random.default_rng(seed).standard_normal(3)
    kept = points[along > np.median(along)]
    nearest = np.abs(whole.part_distances(kept.astype(np.float32))).argmin(axis=0)
    shown = np.bincount(nearest, minlength=int(whole.present.sum())) >= SHOWN
    lost = whole.present.clone()
    lost[whole.present] = torch.from_numpy(~shown)
    seen = replace(whole, model=without(model, index), present=whole.present & ~lost)
    target = Target.of_points(kept, SAMPLES)
    counts = [int(lost.sum())]
    for least in (unseen._PLANE, np.inf):  # none tells places apart so well
        with patch.object(unseen, "_PLANE", least):
            found = unseen.with_unseen(seen, target).present
        counts += [int((found & lost).sum()), int((found & ~whole.present).sum())]
    return np.array(counts)


def without(model: Model, index: int) -> Model:
    """As if it had not been trained on that shape, as far as what it knows of its shapes goes."""
    others = torch.arange(len(model.shapes)) != index
    return replace(
        model,
        latents=model.latents[others],
        poses=model.poses.map(lambda t: t[others]),
        present=model.present[others],
        shapes=tuple(np.array(model.shapes)[others.numpy()].tolist()),
    )
