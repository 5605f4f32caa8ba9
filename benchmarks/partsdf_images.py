"""Held-out shapes from one picture each: what the image encoder sees, beside what needs no picture at all;
and who is told that a picture shows nothing of the family."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import torch
import trimesh
from partsdf_scores import command_line, scale_of, score, write

from partwright.datasets import family as made_family
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
from partwright.partsdf.strangers import standpoint_of, warnings_of
from partwright.partsdf.targets import Target
from partwright.render import Camera, render_mesh
from partwright.shapes import LONGEST_SIDE

# Azimuth and elevation, degrees; another of these for each shape first, so that all sides are seen.
PLACES = ((30.0, 20.0), (150.0, 10.0), (260.0, 35.0), (330.0, 5.0), (80.0, 25.0), (200.0, 40.0))
COLOURS = ((196, 200, 208), (150, 90, 50), (60, 90, 150), (70, 70, 75), (190, 60, 50))
PIXELS = 256
OTHERS = ("cars", "chairs", "mixers")
OUTLINED = 64  # cells of the meshes that outlines are of
SIDE = 30  # degrees of azimuth within which a shape is well seen


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
        "the outline is the picture's; told, as seen: pictures that are said "
        f"to be of no shape of the family, maybe, and that share of those seen within {SIDE} degrees of the "
        "true azimuth. Seconds of the "
        "processor, one thread: to see, without meshing; to see, mesh coarsely and move.", "",
        command_line(), "",
        "| | IoU % | pIoU % | CD x1e4 | parts right % | camera, degrees | outline % | told % | "
        "of well seen % | s |",
        "|---|---|---|---|---|---|---|---|---|---|",
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

    add(f"| mean shape | {scored([(NeuralShape.mean(model), s) for s in shapes])} | | | | | |")
    add(f"| nearest training shape | {scored([(nearest(model, s), s) for s in shapes])} | | | | | |")
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
        ious, told = outlines(encoder, seen)
        well = told[np.array(off) < SIDE]
        add(
            f"| seen, {label} | {scored(found)} | {np.median(off):.0f} | {100 * ious.mean():.0f} | "
            f"{100 * told.mean():.0f} | {100 * well.mean():.0f} | {seconds:.3f} |"
        )
        start = time.process_time()
        fits = [one and moved_to_outline(one)[1] for one in seen]
        seconds += (time.process_time() - start) / len(taken)
        found = [(fit and fit.shape, s) for fit, (s, _, _) in zip(fits, taken, strict=True)]
        off = [
            degrees_off(fit.eye.camera.azimuth if fit else None, azimuth)
            for fit, (_, azimuth, _) in zip(fits, taken, strict=True)
        ]
        iou = np.mean([fit.iou if fit else 0.0 for fit in fits])
        add(
            f"| moved, {label} | {scored(found)} | {np.median(off):.0f} | {100 * iou:.0f} | | | "
            f"{seconds:.3f} |"
        )
    for name in OTHERS:
        if name != family.name and (family.folder.parent / name).is_dir():
            other = PreparedFamily(family.folder.parent / name)
            some = [other.load(i) for i in other.split("test")[: arguments.shapes]]
            seen = [seen_in(encoder, photo) for _, _, photo in pictures(some, arguments.views, False)]
            ious, told = outlines(encoder, seen)
            add(f"| pictures of {name} | | | | | | {100 * ious.mean():.0f} | {100 * told.mean():.0f} | | |")
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


def outlines(encoder: ImageEncoder, seen: list[Looked | None]) -> tuple[np.ndarray, np.ndarray]:
    """(N,) their IoUs, and whether each is told to be of no shape of the family."""
    ious, told = [], []
    for one in seen:
        if one is None:
            ious.append(0.0)
            told.append(True)
            continue
        found = found_from(one)
        ious.append(found.iou)
        told.append(bool(warnings_of(encoder, one, found)))
    return np.array(ious), np.array(told)


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
                image = _before(image, mesh, camera, i * views + j)
            yield shape, camera.azimuth, Photo(image, None)


def _before(image: np.ndarray, mesh: trimesh.Trimesh, camera: Camera, seed: int) -> np.ndarray:
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


SIZES, SEEDS = (32, 64, 96, 128, 200), range(6)  # of pictures of nothing
NEW = 99  # seed of shapes that no model was trained on
VIEWS = 3


def pictures_of_nothing(arguments: argparse.Namespace) -> None:
    """How many pictures of noise are refused and warned of, and how many of what is there."""
    model = load_model(arguments.model)
    encoder = needed_encoder(model)
    lines = [
        f"# PartSDF: pictures in which there is nothing for {model.name}", "",
        f"Noise: each pixel of its own, of {', '.join(map(str, SIZES))} pixels a side, {len(SEEDS)} seeds; "
        f"squares: of 8 x 8 pixels. Shapes: made with seed {NEW}, {VIEWS} renders each from random sides, "
        "two with shadows. Refused: no shape is seen. Warned of: one line that this may be no picture of the "
        "family; without the mirror: by the other signs alone.", "",
        command_line(), "",
        "| | pictures | refused | warned of | without the mirror |", "|---|---|---|---|---|",
    ]  # fmt: skip
    kinds = {
        "noise, coloured": [noise(seed, n, 1, 3) for n in SIZES for seed in SEEDS],
        "noise, grey": [noise(seed, n, 1, 1) for n in SIZES for seed in SEEDS],
        "squares, coloured": [noise(seed, n, 8, 3) for n in SIZES for seed in SEEDS],
        "one grey": [noise(seed, n, n, 1) for n in SIZES for seed in SEEDS],
        **{name: list(new_pictures(name, count)) for name, count in (("chairs", 16), ("vehicles", 6))},
    }
    for label, photos in kinds.items():
        refused = told = plainly = 0
        for photo in photos:
            one = seen_in(encoder, photo)
            if one is None:
                refused += 1
                continue
            found = found_from(one)
            told += bool(warnings_of(encoder, one, found))
            plainly += bool(warnings_of(encoder, replace(one, mirrored=1.0), found))
        lines.append(f"| {label} | {len(photos)} | {refused} | {told} | {plainly} |")
        print(lines[-1], flush=True)
    write(f"images-of-nothing-{model.name}", lines)


def noise(seed: int, side: int, square: int, channels: int) -> Photo:
    """Squares of random colours, or greys, side by side."""
    levels = np.random.default_rng(seed).random((side // square, side // square, channels))
    pixels = np.kron(np.repeat(levels, 3 // channels, axis=2), np.ones((square, square, 1)))
    return Photo(pixels.astype(np.float32), None)


def new_meshes(name: str, count: int) -> Iterator[trimesh.Trimesh]:
    """Whole shapes that no model was trained on, in the unit frame."""
    for shape in made_family(name, count, seed=NEW):
        mesh = shape.whole
        vertices = (mesh.vertices - mesh.bounds.mean(axis=0)) * (LONGEST_SIDE / mesh.extents.max())
        yield trimesh.Trimesh(vertices, mesh.faces, process=False)


def new_pictures(name: str, count: int) -> Iterator[Photo]:
    rng = np.random.default_rng(0)
    for mesh in new_meshes(name, count):
        for view in range(VIEWS):
            camera = Camera(rng.uniform(0, 360), rng.uniform(5, 40))
            image = render_mesh(mesh, camera, (PIXELS, PIXELS), ground=view % 2 == 0)
            yield Photo(image.astype(np.float32) / 255, None)
