"""Parts that come through others, as the edge of a blade through the wall of its tube: found, and drawn back.

What a part shows beside the others falls into pieces where they cut it. A small one beside a large one that
can be seen from outside is a tip that came out on the far side; one in a slit between parts is none. To draw
it back, latent and pose of the part move until the tip's surface is outside of the part, while the rest of
what is seen stays where it is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
import torch

from partwright.partsdf.cores import one_core_each
from partwright.partsdf.nearness import edges_of
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.unknowns import FamilyUnknowns
from partwright.render.raycast import Scene
from partwright.shapes.topology import components

if TYPE_CHECKING:
    import trimesh

_TIP = 0.1  # of its part's surface, at most: what is more is no tip, but a side of the part
_ALONG = np.array([0.25, 0.5, 0.75], np.float32)[:, None, None]  # where an edge is looked at for a thin wall
_OFF = 2e-3  # unit lengths above a surface from where one looks out
_SIDES = 64  # from which a point is looked at
_STEPS, _PLACES = 40, 1000
_BEYOND = 2e-3  # unit lengths that the part's surface is to end before the tip
_HOLD = 0.3  # weight of the rest of the surface, against the tip's
_RATES = ReconstructionSettings(rate=3e-3, pose_rate=1.2e-3)


@dataclass(frozen=True)
class Tip:
    """What came through. share: of the part's own surface; area of it; points (T, 3) there, and rest (R, 3),
    points of the part's surface that are seen besides. Unit frame."""

    part: str
    share: float
    area: float
    points: np.ndarray
    rest: np.ndarray


def tips(shape: NeuralShape, parts: dict[str, trimesh.Trimesh], off: Mapping[str, np.ndarray]) -> list[Tip]:
    """Of all parts that come through others, by the parts' own meshes (unit frame), of whose vertices `off`
    has how far they are from the other parts; the least area first: of two that cross, each cuts the other,
    and the smaller tip belongs to the one that went too far."""
    scene = cache(partial(_scene, parts))  # most parts need none
    found = [
        _tip(shape, number, name, parts[name], off[name], scene)
        for number, name in enumerate(shape.names())
        if name in parts
    ]
    return sorted((tip for tip in found if tip.share > 0), key=lambda tip: tip.area)


def _tip(
    shape: NeuralShape,
    number: int,
    name: str,
    mesh: trimesh.Trimesh,
    distance: np.ndarray,
    scene: Callable[[], Scene],
) -> Tip:
    """Of the part that is the `number`th of those that are there; distance (V,) of its vertices from the
    others; scene: of all parts."""
    points, edges = np.asarray(mesh.vertices, np.float32), edges_of(mesh)

    def outside(places: np.ndarray) -> np.ndarray:
        others = np.delete(shape.part_distances(places), number, axis=0)
        return np.asarray(others.min(axis=0, initial=np.inf))

    seen = distance > 0
    between = edges[seen[edges].all(axis=1)]
    first, second = points[between[:, 0]], points[between[:, 1]]
    near = np.flatnonzero(distance[between].sum(axis=1) < 1.2 * np.linalg.norm(first - second, axis=1))
    along = (1 - _ALONG) * first[near] + _ALONG * second[near]
    cut = (outside(along.reshape(-1, 3)).reshape(len(_ALONG), -1) < 0).any(axis=0)
    piece, own = (components(len(points), *e.T) for e in (np.delete(between, near[cut], axis=0), edges))
    area = np.zeros(len(points))
    np.add.at(area, np.asarray(mesh.faces), mesh.area_faces[:, None] / 3)
    areas = np.bincount(piece, area)
    largest: dict[int, int] = {}  # what is seen of each piece that the part has by itself
    for one in np.unique(piece[seen]).tolist():
        whole = int(own[np.argmax(piece == one)])
        if whole not in largest or areas[one] > areas[largest[whole]]:
            largest[whole] = one
    main = np.isin(piece, list(largest.values()))
    tip = seen & ~main & (areas[piece] <= _TIP * area.sum())
    if tip.any():
        tip[tip] = _open(scene(), points[tip], np.asarray(mesh.vertex_normals)[tip])
    there = float(area[tip].sum())
    return Tip(name, there / float(area.sum()), there, points[tip], points[seen & main])


def _scene(parts: dict[str, trimesh.Trimesh]) -> Scene:
    ends = np.cumsum([0] + [len(mesh.vertices) for mesh in parts.values()])
    faces = [mesh.faces + end for mesh, end in zip(parts.values(), ends, strict=False)]
    return Scene(np.concatenate([mesh.vertices for mesh in parts.values()]), np.concatenate(faces))


def _open(scene: Scene, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(T,) bool: whether a point of the surface is seen from far away, from some side at least."""
    start = points + _OFF * normals
    free = np.zeros(len(points), dtype=bool)
    height = (2 * np.arange(_SIDES) + 1) / _SIDES - 1
    around = np.pi * (3 - np.sqrt(5)) * np.arange(_SIDES)  # by the golden angle, evenly over the sphere
    wide = np.sqrt(1 - height**2)
    for side in np.stack([wide * np.cos(around), wide * np.sin(around), height], axis=1):
        if free.all():
            break
        hidden = ~free
        free[hidden] = ~scene.occluded(start[hidden], np.tile(side, (int(hidden.sum()), 1)))
    return free


@one_core_each()
def drawn_back(shape: NeuralShape, tip: Tip, move_pose: bool = True) -> NeuralShape:
    """The shape with latent and pose of the tip's part moved along the family's directions, until the tip is
    none of it; all other parts' stay as they are. move_pose: else, and of models without poses, the latent
    alone moves."""
    part = shape.model.index(tip.part)
    unknowns = FamilyUnknowns(shape, move_pose and shape.model.config.poses, 0)
    optimiser = torch.optim.Adam(unknowns.groups(_RATES))
    moved = [tensor for group in optimiser.param_groups for tensor in group["params"]]
    others = torch.arange(len(shape.present)) != part
    rng = np.random.default_rng(0)
    gone, held = (rng.permutation(points)[:_PLACES] for points in (tip.points, tip.rest))
    places = torch.from_numpy(np.concatenate([gone, held]))
    for _ in range(_STEPS):
        distance = shape.model.decoded(unknowns.latents(), unknowns.poses()).part(part, places)
        out = torch.relu(_BEYOND - distance[: len(gone)]).mean()
        loss = out + _HOLD * distance[len(gone) :].abs().sum() / max(1, len(held))
        optimiser.zero_grad()
        loss.backward()
        for tensor in moved:
            assert tensor.grad is not None
            tensor.grad[others] = 0
        optimiser.step()
    row = others[:, None]
    latents = torch.where(row, shape.latents, unknowns.latents().detach())
    poses = (torch.where(row, a, b.detach()) for a, b in zip(shape.poses, unknowns.poses(), strict=True))
    return replace(shape, latents=latents, poses=PoseTensors(*poses))
