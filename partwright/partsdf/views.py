"""Views that an image encoder learns from: training shapes, ray cast from all around, not yet lit.

As clouds do, shapes may have parts of several training shapes, each placed in the pose of the one that it
stands in for; the whole is stretched a little along its axes. What a pixel sees is kept (a normal, a part,
whether a light reaches it), so that each view can be lit and coloured many times.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor

from partwright.datasets.poses import Poses
from partwright.datasets.prepared import PreparedFamily
from partwright.methods import Cancellation
from partwright.partsdf.clouds import donors_of, training_shapes
from partwright.partsdf.model import Model
from partwright.partsdf.poses import PoseTensors, local_points, rotation_matrices
from partwright.processes import carried_out
from partwright.render.camera import Camera, View
from partwright.render.raycast import Scene, cast
from partwright.shapes import LONGEST_SIDE

SIDE = 64  # pixels
SHADED = 128  # added to a pixel's label where the light does not reach it
EACH = 4  # views of a shape once it is put together
_WORTH = 64  # shapes, whose views take as long as a process needs to start
_ELEVATION, _FIELD = (-8.0, 50.0), (8.0, 50.0)  # degrees
_ROLL = math.radians(2.5)
_STRETCH = 0.1  # standard deviation of the logarithm
_CLOSE = 0.8  # of the views are cut out closely, as a found silhouette is; the rest anyhow
_FILLED, _LOOSE = (0.82, 0.98), (0.4, 0.82)  # shares of the picture


@dataclass(frozen=True)
class PartMeshes:
    """Triangles of each part of S training shapes: corners (V, 3) in the part's frame, faces (F, 3)."""

    corners: list[list[np.ndarray]]
    faces: list[list[np.ndarray]]

    @classmethod
    def of(cls, family: PreparedFamily, model: Model) -> PartMeshes:
        """Of the model's training shapes; raises FamilyError as `training_shapes`."""
        corners: list[list[np.ndarray]] = []
        faces: list[list[np.ndarray]] = []
        for s, shape in enumerate(training_shapes(family, model)):
            corners.append([])
            faces.append([])
            for p in range(len(model.parts)):
                used, mine = np.unique(shape.faces[shape.label == p], return_inverse=True)
                pose = model.poses.map(lambda t, s=s, p=p: t[s, p][None])
                local = local_points(torch.from_numpy(shape.vertices[used]), pose)[0]
                corners[-1].append(local.numpy())
                faces[-1].append(mine.reshape(-1, 3))
        return cls(corners, faces)

    def seen(self) -> Tensor:
        """(S, P) whether a part has a surface."""
        return torch.tensor([[len(f) > 0 for f in each] for each in self.faces])


@dataclass(frozen=True)
class Views:
    """V views: normal (V, SIDE, SIDE, 3) int8, world, in 127ths; label (V, SIDE, SIDE) uint8, 0 where nothing
    is seen, else the part's number plus 1, and SHADED; light and back (V, 3), towards the light and the
    viewer; camera (V, 3): cosine and sine of the azimuth, and elevation in radians; donors (V, P) that
    latents are of; poses (V, P, ...) and present (V, P) of what is seen, in the unit frame."""

    normal: Tensor
    label: Tensor
    light: Tensor
    back: Tensor
    camera: Tensor
    donors: Tensor
    poses: PoseTensors
    present: Tensor

    def to(self, device: torch.device) -> Views:
        poses = self.poses.map(lambda t: t.to(device))
        rest = {k: v.to(device) for k, v in vars(self).items() if k != "poses"}
        return Views(**rest, poses=poses)


def draw_views(
    meshes: PartMeshes,
    model: Model,
    count: int,
    generator: torch.Generator,
    told: Callable[[int], None] | None = None,
    cancel: Cancellation | None = None,
    workers: int = 1,
) -> Views:
    """`count` views, or those that there are once it is cancelled, but `EACH` at least.

    workers: processes, as of `carried_out`; the views are the same by however many.
    """
    shapes = torch.randint(len(model.shapes), (-(-count // EACH),), generator=generator)
    donors = donors_of(model, shapes, meshes.seen(), generator)
    poses = _stretched(model.poses.map(lambda t: t[shapes]), generator)
    present = model.present[shapes]
    return views_of(meshes, model.up, donors, poses, present, count, generator, told, cancel, workers)


def views_of(
    meshes: PartMeshes,
    up: str,
    donors: Tensor,
    poses: PoseTensors,
    present: Tensor,
    count: int,
    generator: torch.Generator,
    told: Callable[[int], None] | None = None,
    cancel: Cancellation | None = None,
    workers: int = 1,
) -> Views:
    """As `draw_views`, of parts that come from these donors (S, P), in these poses (S, P, ...), of shapes
    that have them (S, P) and stand with the axis `up`; each is seen from `EACH` sides."""
    seed = int(torch.randint(1 << 40, (), generator=generator))
    orders = [
        _Order(donors[i].tolist(), present[i].tolist(), poses.map(lambda t, i=i: t[i]).numpy(), (seed, i))
        for i in range(len(donors))
    ]
    label = np.zeros((EACH * len(orders), SIDE, SIDE), np.uint8)
    normal = np.zeros((*label.shape, 3), np.int8)
    light, back, camera = np.zeros((3, len(label), 3), np.float32)
    framed: list[PoseTensors] = []
    draw = partial(_drawn, meshes, up)
    with closing(carried_out(draw, orders, min(workers, len(orders) // _WORTH), 8)) as drawn:
        for one in drawn:
            rows = slice(EACH * len(framed), EACH * (len(framed) + 1))
            label[rows], normal[rows] = one.label, one.normal
            light[rows], back[rows], camera[rows] = one.light, one.back, one.camera
            framed.append(PoseTensors.of(one.poses))
            if told is not None:
                told(min(count, rows.stop))
            if cancel is not None and cancel.requested:
                break
    made = EACH * len(framed)
    each = torch.arange(made) // EACH
    placed = PoseTensors(*(torch.stack(t) for t in zip(*framed, strict=True)))
    pixels = torch.from_numpy(normal[:made]), torch.from_numpy(label[:made])
    ways = torch.from_numpy(light[:made]), torch.from_numpy(back[:made]), torch.from_numpy(camera[:made])
    return Views(
        *pixels, *ways, donors[each], placed.map(lambda t: t[each]), present[each],
    )  # fmt: skip


class _Order(NamedTuple):
    """A shape to be put together: each part's donor, which are there, their poses, and the seed of views."""

    donors: list[int]
    present: list[bool]
    poses: Poses
    seed: tuple[int, int]


class _Made(NamedTuple):
    """Of `Views`: the rows of one shape, and its poses."""

    normal: np.ndarray
    label: np.ndarray
    light: np.ndarray
    back: np.ndarray
    camera: np.ndarray
    poses: Poses


def _drawn(meshes: PartMeshes, up: str, order: _Order) -> _Made:
    """A shape, put together and seen from `EACH` sides."""
    corners, faces, labels, poses = _put_together(meshes, order)
    rng, scene = np.random.default_rng(order.seed), Scene(corners, faces)
    label = np.zeros((EACH, SIDE, SIDE), np.uint8)
    normal = np.zeros((*label.shape, 3), np.int8)
    rows = [
        _seen(scene, labels, up, rng, normal[j].reshape(-1, 3), label[j].reshape(-1)) for j in range(EACH)
    ]
    light, back, camera = (np.array(a, dtype=np.float32) for a in zip(*rows, strict=True))
    return _Made(normal, label, light, back, camera, poses)


def _stretched(poses: PoseTensors, generator: torch.Generator) -> PoseTensors:
    """Along the axes of the whole; a part that is turned is stretched along its own as far as they go."""
    factor = torch.exp(_STRETCH * torch.randn(len(poses.scale), 1, 3, generator=generator))
    along = (factor[..., None] * rotation_matrices(poses.rotation)).norm(dim=-2)
    return PoseTensors(poses.translation * factor, poses.rotation, poses.scale * along)


def _put_together(meshes: PartMeshes, order: _Order) -> tuple[np.ndarray, np.ndarray, np.ndarray, Poses]:
    """Corners, faces and a part a face of the parts in their poses, brought to the unit frame, and the poses
    there."""
    placed = PoseTensors.of(order.poses)
    matrix = rotation_matrices(placed.rotation).numpy()
    place, scale = placed.translation.numpy(), placed.scale.numpy()
    corners, faces, labels, before = [], [], [], 0
    for p, donor in enumerate(order.donors):
        mine = meshes.faces[donor][p]
        if not order.present[p] or not len(mine):
            continue
        corners.append((meshes.corners[donor][p] * scale[p]) @ matrix[p].T + place[p])
        faces.append(mine + before)
        labels.append(np.full(len(mine), p + 1, np.uint8))
        before += len(corners[-1])
    every = np.concatenate(corners)
    low, high = every.min(axis=0), every.max(axis=0)
    centre, larger = (low + high) / 2, LONGEST_SIDE / (high - low).max()
    moved = PoseTensors(
        (placed.translation - torch.from_numpy(centre)) * larger, placed.rotation, placed.scale * larger
    )
    return (every - centre) * larger, np.concatenate(faces), np.concatenate(labels), moved.numpy()


def _seen(
    scene: Scene, labels: np.ndarray, up: str, rng: np.random.Generator, normal: np.ndarray, label: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A view from somewhere, written to normal and label; the light, the way back, and the camera."""
    camera = Camera(rng.uniform(0, 360), rng.uniform(*_ELEVATION), rng.uniform(*_FIELD), up, 0.0)
    view = _rolled(camera.fitted(scene.vertices, SIDE, SIDE), _ROLL * rng.standard_normal())
    filled = rng.uniform(*(_FILLED if rng.random() < _CLOSE else _LOOSE))
    room = 0.9 * (1 - filled) / 2
    place = (np.arange(SIDE) + 0.5) / SIDE - 0.5
    across, down = (place / filled + 0.5 + rng.uniform(-room, room) / filled for _ in range(2))
    rays = view.through(np.tile(across, SIDE), np.repeat(down, SIDE))
    hits = cast(scene, view, rays)
    light = (
        view.back + 0.9 * rng.standard_normal() * view.right + (0.6 + 0.5 * rng.standard_normal()) * view.up
    )
    light /= np.linalg.norm(light)
    start = hits.round + 1e-3 * scene.size * hits.normal
    hidden = scene.occluded(start, np.broadcast_to(light, start.shape))
    label[hits.pixel] = labels[hits.face] + SHADED * hidden.astype(np.uint8)
    normal[hits.pixel] = np.rint(127 * hits.normal)
    azimuth = math.radians(camera.azimuth)
    return light, view.back, np.array([math.cos(azimuth), math.sin(azimuth), math.radians(camera.elevation)])


def _rolled(view: View, angle: float) -> View:
    c, s = math.cos(angle), math.sin(angle)
    return View(view.eye, c * view.right + s * view.up, c * view.up - s * view.right, view.back, view.half)
