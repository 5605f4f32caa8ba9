"""Held-out shapes from points: what the encoder sees, and what is left after refinement without labels."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from partsdf_scores import command_line, scale_of, write

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import SettingError
from partwright.metrics.iou import occupancy_iou
from partwright.partsdf.encoder import load_encoder
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct_unknown
from partwright.partsdf.starts import nearest_trained
from partwright.partsdf.targets import Target
from partwright.shapes.sampling import sample_triangles

NEAR = 0.05  # unit lengths: occupancies are compared there
CLOUDS: tuple[tuple[str, int, float], ...] = (("2,048 points", 2048, 0.0), ("256 points", 256, 0.0),
                                             ("2,048, noise of 0.02", 2048, 0.02))  # fmt: skip


def encoding(arguments: argparse.Namespace) -> None:
    """IoUs of occupancies near the surface: nearest training shape, encoder, refined from either."""
    family, model = PreparedFamily(arguments.family), load_model(arguments.model)
    encoder = load_encoder(model)
    if encoder is None:
        raise SettingError(f"{model.name} has no encoder; make one with `parts train-encoder`")
    shapes = [family.load(i) for i in family.split("test")[: arguments.shapes]]
    lines = [f"# PartSDF: held-out {family.name} from points", "",
             f"Trained on {scale_of(model)}. {len(shapes)} test shapes; IoU and its mean over parts, by "
             f"occupancies at the samples within {NEAR} of the surface, where a little more or less tells "
             f"most. Refined: {arguments.iterations} iterations of {arguments.points:,} samples, without "
             "labels. Seconds of the processor, one thread.", "", command_line(), "",
             "| | IoU % | pIoU % | parts right % | s |", "|---|---|---|---|---|"]  # fmt: skip

    def add(label: str, find: Callable[[PreparedShape], NeuralShape]) -> None:
        scores = []
        for shape in shapes:
            start = time.process_time()
            found = find(shape)
            seconds = time.process_time() - start
            right = (found.present.numpy() == shape.present.astype(bool)).all()
            scores.append((*near_surface(found, shape), float(right), seconds))
        iou, parts, right, seconds = np.mean(scores, axis=0)
        lines.append(f"| {label} | {100 * iou:.1f} | {100 * parts:.1f} | {100 * right:.0f} | {seconds:.2f} |")
        print(lines[-1], flush=True)

    settings = ReconstructionSettings(iterations=arguments.iterations, points=arguments.points)
    add("nearest training shape", lambda s: nearest_trained(model, target(s))[0][1])
    for label, count, noise in CLOUDS:
        add(f"encoder, {label}", lambda s, c=count, n=noise: encoder.encode(cloud(s, c, n)[None])[0])
    seen = replace(settings, start="encoder")
    at_once = replace(seen, iterations=1)
    add("encoder, 2,048 points, one iteration", lambda s: reconstruct_unknown(model, target(s), at_once))
    add("encoder, 2,048 points, refined", lambda s: reconstruct_unknown(model, target(s), seen))
    nearest = replace(settings, start="nearest")
    add("nearest training shapes, refined", lambda s: reconstruct_unknown(model, target(s), nearest))
    add("default: both, refined", lambda s: reconstruct_unknown(model, target(s), settings))
    write(f"encode-{family.name}", lines)


def cloud(shape: PreparedShape, count: int, noise: float) -> torch.Tensor:
    points, _ = sample_triangles(shape.vertices.astype(np.float64), shape.faces.astype(np.int64), count, 1)
    return torch.from_numpy(points + noise * np.random.default_rng(0).standard_normal(points.shape)).float()


def target(shape: PreparedShape) -> Target:
    return Target(torch.tensor(shape.points), torch.tensor(shape.sdf), surface=cloud(shape, 2048, 0.0))


def near_surface(found: NeuralShape, shape: PreparedShape) -> tuple[float, float]:
    """IoU, and its mean over the parts that the shape has."""
    rows = np.abs(shape.sdf) < NEAR
    each = found.part_distances(shape.points[rows])
    inside, true = found.whole(each) < 0, shape.sdf[rows] < 0
    owner = np.where(inside, np.flatnonzero(found.present.numpy())[each.argmin(axis=0)], -1)
    label = np.where(true, shape.part[rows], -1)
    parts = [occupancy_iou(owner == p, label == p) for p in np.flatnonzero(shape.present)]
    return occupancy_iou(inside, true), float(np.mean(parts))
