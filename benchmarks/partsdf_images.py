"""Held-out shapes from one picture each: what the image encoder sees, beside what needs no picture at all;
and who is told that a picture shows nothing of the family."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator

import numpy as np
import torch
import trimesh
from partsdf_scores import command_line, scale_of, score, write

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import EmptyShapeError
from partwright.metrics.reconstruction import ReconstructionScores, mean_scores, reconstruction_scores
from partwright.partsdf.from_photo import moved_to_outline, needed_encoder
from partwright.partsdf.image_encoder import ImageEncoder
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.photos import Looked, Photo, look_at
from partwright.partsdf.standpoint import Standpoint
from partwright.partsdf.starts import nearest_trained
from partwright.partsdf.strangers import standpoint_of
from partwright.partsdf.targets import Target
from partwright.render import Camera, render_mesh

# Azimuth and elevation, degrees; another of these for each shape first, so that all sides are seen.
PLACES = ((30.0, 20.0), (150.0, 10.0), (260.0, 35.0), (330.0, 5.0), (80.0, 25.0), (200.0, 40.0))
COLOURS = ((196, 200, 208), (150, 90, 50), (60, 90, 150), (70, 70, 75), (190, 60, 50))
PIXELS = 256
OUTLINED = 64  # cells of the meshes that outlines are of


def imaging(arguments: argparse.Namespace) -> None:
    """Scores of what is seen in renders with shadows on the ground, plain or with something behind; floors;
    and how often pictures of other families are told apart."""
    family, model = PreparedFamily(arguments.family), load_model(arguments.model)
    encoder = needed_encoder(model)
    shapes = [family.load(i) for i in family.split("test")[: arguments.shapes]]
    lines = [
        f"# PartSDF: held-out {family.name} from one picture", "",
        f"Trained on {scale_of(model)}. {len(shapes)} test shapes, {arguments.views} pictures of each, from "
        f"all sides, with shadows, {PIXELS} pixels, looked at in 64; meshed at {arguments.resolution}^3. The "
        "nearest training shape is told by the true shape's distances, which no picture gives. Camera: the "
        "median error of the azimuth; outline: the mean IoU of silhouettes; moved: parts and camera, until "
        "the outline is the picture's. Seconds of the "
        "processor, one thread: to see, without meshing; to see, mesh coarsely and move.", "",
        command_line(), "",
        "| | IoU % | pIoU % | CD x1e4 | parts right % | camera, degrees | outline % | s |",
        "|---|---|---|---|---|---|---|---|",
    ]  # fmt: skip

    def add(line: str) -> None:
        lines.append(line)
        print(line, flush=True)

    def scored(found: list[tuple[NeuralShape | None, PreparedShape]]) -> str:
        m = mean_scores([scores_of(one, truth, arguments.resolution) for one, truth in found])
        right = [
            one is not None and (one.present.numpy() == t.present.astype(bool)).all() for one, t in found
        ]
        return (
            f"{100 * m.iou:.1f} | {100 * m.part_iou:.1f} | {1e4 * m.chamfer:.0f} | {100 * np.mean(right):.0f}"
        )

    add(f"| mean shape | {scored([(NeuralShape.mean(model), s) for s in shapes])} | | | |")
    add(f"| nearest training shape | {scored([(nearest(model, s), s) for s in shapes])} | | | |")
    for label, cluttered in (("plain background", False), ("spots and stripes behind", True)):
        taken = list(pictures(shapes, arguments.views, cluttered))
        start = time.process_time()
        seen = [seen_in(encoder, photo) for _, _, photo in taken]
        seconds = (time.process_time() - start) / len(taken)
        off = [
            degrees_off(one.sight.azimuth if one else None, azimuth)
            for one, (_, azimuth, _) in zip(seen, taken, strict=True)
        ]
        found = [(one and one.sight.shape, s) for one, (s, _, _) in zip(seen, taken, strict=True)]
        iou = np.mean([found_from(one).iou if one else 0.0 for one in seen])
        add(f"| seen, {label} | {scored(found)} | {np.median(off):.0f} | {100 * iou:.0f} | {seconds:.3f} |")
        start = time.process_time()
        fits = [one and moved_to_outline(one)[1] for one in seen]
        seconds += (time.process_time() - start) / len(taken)
        found = [(fit and fit.shape, s) for fit, (s, _, _) in zip(fits, taken, strict=True)]
        off = [
            degrees_off(fit.eye.camera.azimuth if fit else None, azimuth)
            for fit, (_, azimuth, _) in zip(fits, taken, strict=True)
        ]
        iou = np.mean([fit.iou if fit else 0.0 for fit in fits])
        add(f"| moved, {label} | {scored(found)} | {np.median(off):.0f} | {100 * iou:.0f} | {seconds:.3f} |")
    write(f"images-{family.name}", lines)


def seen_in(encoder: ImageEncoder, photo: Photo) -> Looked | None:
    try:
        return look_at(encoder, photo)
    except EmptyShapeError:
        return None


def scores_of(found: NeuralShape | None, truth: PreparedShape, resolution: int) -> ReconstructionScores:
    return score(found, truth, resolution) if found else reconstruction_scores(None, truth)


def complete(found: NeuralShape, truth: PreparedShape) -> bool:
    """Whether it has the parts that the shape has, and no other."""
    return bool((found.present.numpy() == truth.present.astype(bool)).all())


def degrees_off(found: float | None, azimuth: float) -> float:
    """Between the azimuth that was found and the true one, degrees."""
    return 180.0 if found is None else abs((found - azimuth + 180) % 360 - 180)


def found_from(one: Looked) -> Standpoint:
    """Where what was seen is seen from, by a coarse mesh of it."""
    return standpoint_of(one, mesh_shape(one.sight.shape, OUTLINED, parts=False).whole)


def nearest(model: Model, shape: PreparedShape) -> NeuralShape:
    return nearest_trained(model, Target(torch.tensor(shape.points), torch.tensor(shape.sdf)))[0][1]


def pictures(
    shapes: list[PreparedShape], views: int, cluttered: bool
) -> Iterator[tuple[PreparedShape, float, Photo]]:
    """Each shape, the azimuth, and a picture from there; the same ones each time."""
    for i, shape in enumerate(shapes):
        mesh = trimesh.Trimesh(shape.vertices, shape.faces, process=False)
        for j in range(views):
            azimuth, elevation = PLACES[(i + 2 * j) % len(PLACES)]
            camera = Camera(azimuth + 7 * i, elevation, margin=0.1)
            colour = COLOURS[(i + j) % len(COLOURS)]
            image = render_mesh(mesh, camera, (PIXELS, PIXELS), colour).astype(np.float32) / 255
            if cluttered:
                image = before_spots(image, mesh, camera, i * views + j)
            yield shape, camera.azimuth, Photo(image, None)


def before_spots(image: np.ndarray, mesh: trimesh.Trimesh, camera: Camera, seed: int) -> np.ndarray:
    """The shape before stripes and spots of several colours."""
    rng = np.random.default_rng(seed)
    alone = render_mesh(mesh, camera, (PIXELS, PIXELS), (0, 0, 0), ground=False)
    there = (alone < 235).all(axis=2)[..., None]
    y, x = np.mgrid[:PIXELS, :PIXELS] / PIXELS
    behind = np.full((PIXELS, PIXELS, 3), rng.random(3))
    for _ in range(6):
        way, centre = rng.standard_normal(2), rng.random(2)
        where = np.hypot(x - centre[0], y - centre[1]) < rng.uniform(0.05, 0.25)
        if rng.random() < 0.5:
            where = abs((x - centre[0]) * way[0] + (y - centre[1]) * way[1]) < 0.08
        behind[where] = rng.random(3)
    return np.where(there, image, 0.4 * behind + 0.3).astype(np.float32)
