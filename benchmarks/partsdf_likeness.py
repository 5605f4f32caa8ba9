"""Which pictures show a shape of the family: learned anew by image encoders that ship, whose rest stays, and
who is told that a picture shows none."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import torch
import trimesh
from partsdf_images import PIXELS, before_spots, seen_in
from partsdf_real import SHAPES as REAL
from partsdf_scores import command_line, write

from partwright.datasets import family as made_family
from partwright.datasets.families import FamilyShape
from partwright.datasets.families.recipes import FAMILIES, make_shape
from partwright.partsdf.companions import beside
from partwright.partsdf.from_photo import needed_encoder
from partwright.partsdf.image_encoder import KIND
from partwright.partsdf.likeness import learn_likeness
from partwright.partsdf.model import load_model
from partwright.partsdf.photos import Photo
from partwright.partsdf.poses import identity
from partwright.partsdf.strangers import usual_likeness, warnings_of
from partwright.partsdf.views import EACH, PartMeshes, Views, views_of
from partwright.render import Camera, render_mesh
from partwright.shapes import LONGEST_SIDE

LEARNED, LIMITED = 7, 10  # seeds of new shapes, that no model was trained on: to learn from, for the limit
OWN, SHAPES = 240, 32  # of these
NEW = 99  # seed of shapes that nothing was learned from
VIEWS, COUNT = 3, 16  # pictures of each, and shapes of each family
SIZES, SEEDS = (32, 64, 96, 128, 200), range(6)  # of pictures of nothing
# Real things that no model is of.
STRANGERS = (
    *("airplane", "armadillo", "benchy", "boot", "bunny", "cat", "chess_knight", "duck", "hammer", "human"),
    *("kettle", "lamp_standing", "motorcycle", "mug", "penguin", "stuffed_toy", "ycb_power_drill"),
)


def learn(arguments: argparse.Namespace) -> None:
    """As at the end of `parts train-encoder --from images`, but from new shapes of the made families in the
    place of the training and validation shapes. Writes the encoders anew."""
    for name in arguments.names.split(","):
        model = load_model(name)
        encoder = needed_encoder(model)
        generator = torch.Generator().manual_seed(0)
        own = views([_made(name, LEARNED, i) for i in range(OWN)], model.up, generator)
        learn_likeness(encoder.network, own, model.up, generator)
        held: Any = [_whole(_made(name, LIMITED, i)) for i in range(SHAPES)]
        encoder = replace(encoder, usual=usual_likeness(encoder, held))
        path = beside(model, KIND)
        assert path is not None
        encoder.save(path)
        print(f"{path.name}: usual above {encoder.usual:.2f}", flush=True)


def views(shapes: list[FamilyShape], up: str, generator: torch.Generator) -> Views:
    """Of each shape, from all sides."""
    parts = max(len(shape.parts) for shape in shapes)
    corners = [[mesh.vertices for mesh in shape.parts.values()] for shape in shapes]
    faces = [[mesh.faces for mesh in shape.parts.values()] for shape in shapes]
    present = torch.tensor([[p < len(one) for p in range(parts)] for one in faces])
    none = [np.zeros((0, 3), int)]
    faces = [one + none * (parts - len(one)) for one in faces]
    donors = torch.arange(len(shapes))[:, None].expand(-1, parts)
    poses = identity(parts).map(lambda t: t.expand(len(shapes), *t.shape))
    return views_of(PartMeshes(corners, faces), up, donors, poses, present, EACH * len(shapes), generator)


def _made(name: str, seed: int, number: int) -> FamilyShape:
    return make_shape(name, FAMILIES[name], seed, number)


def _whole(shape: FamilyShape) -> SimpleNamespace:
    mesh = in_unit_frame(shape.whole)
    return SimpleNamespace(vertices=mesh.vertices, faces=mesh.faces)


def in_unit_frame(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    vertices = (mesh.vertices - mesh.bounds.mean(axis=0)) * (LONGEST_SIDE / mesh.extents.max())
    return trimesh.Trimesh(vertices, mesh.faces, process=False)


def new_meshes(name: str, count: int) -> Iterator[trimesh.Trimesh]:
    """Whole shapes that no model was trained on, in the unit frame."""
    return (in_unit_frame(shape.whole) for shape in made_family(name, count, seed=NEW))


def pictures_of_nothing(arguments: argparse.Namespace) -> None:
    """How many pictures of noise, of other families and of other things are refused and warned of, and how
    many of what is there."""
    names, folder = arguments.names.split(","), arguments.shapes_from
    lines = [
        "# PartSDF: pictures that show no shape of the family",
        "",
        f"Shapes: {COUNT} of each family, made with seed {NEW}, and real ones; {VIEWS} renders of each from "
        "random sides: on the ground, alone, and before spots and stripes. Real ones: "
        f"{', '.join(STRANGERS)}. Noise: each pixel of its own or squares of 8 x 8, coloured or grey, of "
        f"{', '.join(map(str, SIZES))} pixels a side, {len(SEEDS)} seeds. Refused: no shape is seen. Warned "
        "of: one line that this may be no picture of the family. Cars are vehicles, too.",
        "",
        command_line(),
        "",
        "| model | pictures of | pictures | refused | warned of | of these before spots |",
        "|---|---|---:|---:|---:|---:|",
    ]
    noises = [noise(seed, n, *kind) for kind in ((1, 3), (1, 1), (8, 3)) for n in SIZES for seed in SEEDS]
    made = {name: list(photos(new_meshes(name, COUNT))) for name in FAMILIES}
    strange = list(photos(real(folder / "toys" / f"{name}.ply" for name in STRANGERS)))
    for name in names:
        encoder = needed_encoder(load_model(name))
        own = list(photos(real(folder / path for model, path in REAL if model == name)))
        kinds = {name: made[name], **({f"real {name}": own} if own else {})}
        kinds |= {other: each for other, each in made.items() if other != name}
        kinds |= {"other things": strange, "noise": noises}
        for label, every in kinds.items():
            seen = [seen_in(encoder, photo) for photo in every]
            told = [one is not None and bool(warnings_of(encoder, one)) for one in seen]
            spots = "" if label == "noise" else sum(told[2::VIEWS])
            lines.append(f"| {name} | {label} | {len(seen)} | {seen.count(None)} | {sum(told)} | {spots} |")
            print(lines[-1], flush=True)
    write("images-of-nothing", lines)


def real(paths: Iterable[Path]) -> Iterator[trimesh.Trimesh]:
    for path in paths:
        yield in_unit_frame(trimesh.load(path, force="mesh", process=False))


def photos(meshes: Iterable[trimesh.Trimesh]) -> Iterator[Photo]:
    rng = np.random.default_rng(0)
    for number, mesh in enumerate(meshes):
        for view in range(VIEWS):
            camera = Camera(rng.uniform(0, 360), rng.uniform(5, 40), margin=0.1)
            image = render_mesh(mesh, camera, (PIXELS, PIXELS), ground=view == 0).astype(np.float32) / 255
            yield Photo(before_spots(image, mesh, camera, number) if view == 2 else image, None)


def noise(seed: int, side: int, square: int, channels: int) -> Photo:
    """Squares of random colours, or greys, side by side."""
    levels = np.random.default_rng(seed).random((side // square, side // square, channels))
    pixels = np.kron(np.repeat(levels, 3 // channels, axis=2), np.ones((square, square, 1)))
    return Photo(pixels.astype(np.float32), None)
