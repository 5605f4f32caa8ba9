"""Parts moved until their outline is the one that a picture shows, and the camera with them.

An image encoder tells poses that are right on the whole; the outline says where each leg ends. When points on
its rim move, the blurred mask of a shape flows with them, so a step is a linear least squares (Gauss, Newton;
damped as by Levenberg and Marquardt) over the poses of all parts and the camera: what the masks differ by,
and how far the poses leave what was seen and what is usual, in the directions and by the amounts in which
those of the family vary together. Legs that are equally long in all training shapes stay so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import torch
from scipy import ndimage

from partwright.partsdf.layout import together
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import POSE, PartVectors, covariance
from partwright.partsdf.photos import Covered
from partwright.partsdf.pinhole import Pinhole
from partwright.partsdf.poses import PoseTensors
from partwright.render.raycast import Scene

if TYPE_CHECKING:
    import trimesh

_BLURS = (3.0, 1.5)  # pixels, by rounds: far off first
_STEPS, _TRIES = 12, 4  # of each round, and of each step, at most
_GAIN = 1e-3  # of the cost: less ends a round
_DAMPING, _LESS, _MORE = 1e-2, 3.0, 5.0
_BAND = 1e-3  # of the steepest that a mask can be: what changes less is not looked at
_STEP = 1e-5
# Chosen on new chairs and cars, no test shapes.
_WEIGHT = 2.0  # of the squares of pixels
_LOOSE, _USUAL = 0.25, 0.5  # of the family's spread, as which poses may leave what was seen; weight of it
# By how much the camera may be seen wrongly: three angles, radians, nearness, logarithm of the size, place.
_CAMERA = np.array([math.radians(12), math.radians(15), math.radians(3), 0.1, 0.5, 0.2, 0.2])


@dataclass(frozen=True)
class OutlineFit:
    """shape: with its parts moved; eye: the camera; iou: of its mask with what is covered in the picture."""

    shape: NeuralShape
    eye: Pinhole
    iou: float


def fit_outline(
    shape: NeuralShape, meshes: dict[str, trimesh.Trimesh], seen: Covered, start: Pinhole
) -> OutlineFit:
    """The shape and the camera whose picture is most like the one that was seen.

    meshes: of the shape's parts, by name, unit frame; they move with the parts' boxes, though a decoder may
    change them a little.
    """
    problem = _Problem(_Layout(shape), _PlacedParts(shape, meshes), seen, start)
    layout, eye = np.zeros(problem.layout.size), start
    for blur in _BLURS:
        layout, eye, mask = problem.descended(layout, eye, blur)
    there = seen.mask
    iou = float((mask & there).sum() / max((mask | there).sum(), 1))
    moved = NeuralShape.of(shape.model, shape.latents, problem.layout.poses(layout), shape.present)
    return OutlineFit(moved, eye, iou)


class _Layout:
    """Poses of the Q parts that are there by Q 12 numbers, each of which varies by 1 in the family, and by
    itself; all are 0 where the shape begins."""

    def __init__(self, shape: NeuralShape) -> None:
        self._shape, self._vectors = shape, PartVectors.of(shape.model)
        self._there = np.flatnonzero(shape.present.numpy())
        model, v = shape.model, self._vectors
        known = together(v.of_poses(model.poses)[:, self._there], model.present[:, self._there])
        values, ways = torch.linalg.eigh(covariance(known))
        self.basis = (ways * values.sqrt()).numpy()
        self.size = len(self.basis)
        self._begun = v.of_poses(shape.poses)[self._there].double()
        self._own = replace(
            v, pose_mean=v.pose_mean[self._there].double(), pose_spread=v.pose_spread[self._there].double()
        )

    @property
    def unusual(self) -> np.ndarray:
        """(Q 12,): by how much the shape, where it begins, is off the family's mean."""
        return np.linalg.solve(self.basis, self._begun.numpy().ravel())

    def _moved(self, numbers: np.ndarray) -> torch.Tensor:
        return self._begun + torch.from_numpy(self.basis @ numbers).unflatten(0, (-1, POSE))

    def poses(self, numbers: np.ndarray) -> PoseTensors:
        """Of all parts; absent ones as they were."""
        vectors = self._vectors.of_poses(self._shape.poses)
        vectors[self._there] = self._moved(numbers).float()
        return self._vectors.poses(vectors)

    def frames(self, numbers: np.ndarray) -> np.ndarray:
        """(Q, 3, 4) from places in parts' boxes to the unit frame."""
        return self._frames(self._moved(numbers))

    def slopes(self, numbers: np.ndarray) -> np.ndarray:
        """(Q, 3, 4, 12): how `frames` change with each part's pose vector, by central differences."""
        rows, steps = self._moved(numbers), _STEP * torch.eye(POSE, dtype=torch.float64)
        each = [(self._frames(rows + s) - self._frames(rows - s)) / (2 * _STEP) for s in steps]
        return np.stack(each, axis=-1)

    def _frames(self, rows: torch.Tensor) -> np.ndarray:
        place, turned, size = self._own.frames(rows)
        return torch.cat([turned * size[..., None, :], place[..., None]], dim=-1).numpy()


class _PlacedParts:
    """Meshes of parts in their boxes: corners (V, 3), faces (F, 3), and which part each corner is of."""

    def __init__(self, shape: NeuralShape, meshes: dict[str, trimesh.Trimesh]) -> None:
        corners, faces, owner, before = [], [], [], 0
        for i, name in enumerate(shape.names()):
            if name in meshes:
                corners.append(shape.in_box(name, meshes[name].vertices).astype(np.float64))
                faces.append(meshes[name].faces + before)
                owner.append(np.full(len(corners[-1]), i))
                before += len(corners[-1])
        self._corners, self.faces = np.concatenate(corners), np.concatenate(faces)
        self._owner = np.concatenate(owner)
        self.owner = self._owner[self.faces[:, 0]]  # of faces

    def placed(self, frames: np.ndarray) -> np.ndarray:
        """(V, 3) in the unit frame."""
        mine = frames[self._owner]
        return np.einsum("vij,vj->vi", mine[..., :3], self._corners) + mine[..., 3]


@dataclass(frozen=True)
class _State:
    """Unknowns, the mask (N, N) that they make, the face (H,) and point (H, 3) that each of its pixels sees,
    by rows; how much the blurred mask covers of each pixel, what it is off by, and what all costs."""

    layout: np.ndarray
    eye: Pinhole
    mask: np.ndarray
    face: np.ndarray
    point: np.ndarray
    share: np.ndarray
    off: np.ndarray
    cost: float


class _Problem:
    def __init__(self, layout: _Layout, parts: _PlacedParts, seen: Covered, start: Pinhole) -> None:
        self.layout, self.parts, self.seen, self.start = layout, parts, seen, start
        none = np.zeros(len(_CAMERA))
        self._held = 1 / np.concatenate([np.full(layout.size, _LOOSE), _CAMERA]) ** 2
        self._family = np.concatenate([np.full(layout.size, _USUAL), none])
        self._unusual = np.concatenate([layout.unusual, none])

    def descended(
        self, layout: np.ndarray, eye: Pinhole, blur: float
    ) -> tuple[np.ndarray, Pinhole, np.ndarray]:
        """The layout and the camera at the end of a round, and the mask (N, N) bool."""
        state, damping = self._state(layout, eye, blur), _DAMPING
        for _ in range(_STEPS):
            before, change = state.cost, self._change(state)
            for _ in range(_TRIES):
                step = self._step(state, change, damping)
                size = self.layout.size
                tried = self._state(state.layout + step[:size], state.eye.moved(step[size:]), blur)
                if tried.cost < before:
                    state, damping = tried, damping / _LESS
                    break
                damping *= _MORE
            if state.cost > (1 - _GAIN) * before:
                break
        return state.layout, state.eye, state.mask

    def _state(self, layout: np.ndarray, eye: Pinhole, blur: float) -> _State:
        scene, cells = Scene(self.parts.placed(self.layout.frames(layout)), self.parts.faces), self.seen.cells
        origin, rays = eye.rays(cells)
        face, distance, _ = scene.first_hit(np.broadcast_to(origin, rays.shape), rays)
        hit = face >= 0
        share = ndimage.gaussian_filter(hit.reshape(cells, cells).astype(float), blur)
        off = self.seen.trust * (share - ndimage.gaussian_filter(self.seen.share, blur))
        own = self._unknowns(layout, eye)
        cost = _WEIGHT * (off**2).sum() + self._held @ own**2 + self._family @ (own + self._unusual) ** 2
        points = origin + distance[hit, None] * rays[hit]
        return _State(layout, eye, hit.reshape(cells, cells), face[hit], points, share, off, float(cost))

    def _unknowns(self, layout: np.ndarray, eye: Pinhole) -> np.ndarray:
        return np.concatenate([layout, eye.numbers - self.start.numbers])

    def _step(self, state: _State, change: tuple[np.ndarray, np.ndarray], damping: float) -> np.ndarray:
        slopes, off = change
        own = self._unknowns(state.layout, state.eye)
        normal = _WEIGHT * slopes.T @ slopes + np.diag(self._held + self._family)
        pull = _WEIGHT * slopes.T @ off + self._held * own + self._family * (own + self._unusual)
        return np.asarray(np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -pull))

    def _change(self, state: _State) -> tuple[np.ndarray, np.ndarray]:
        """(M, U) how pixels of the blurred mask change with all unknowns, where they do, and (M,) what they
        are off by, each by its trust."""
        cells = self.seen.cells
        down, across = np.gradient(state.share * cells)
        band = np.hypot(down, across) > _BAND * cells
        # A pixel flows as the nearest point on the rim does.
        rim = state.mask & ~ndimage.binary_erosion(state.mask)
        nearest = ndimage.distance_transform_edt(~rim, return_distances=False, return_indices=True)
        order = np.cumsum(state.mask).reshape(state.mask.shape) - 1
        used, mine = np.unique(order[nearest[0][band], nearest[1][band]], return_inverse=True)
        points, owner = state.point[used], self.parts.owner[state.face[used]]
        frames, slopes = self.layout.frames(state.layout)[owner], self.layout.slopes(state.layout)[owner]
        local = np.linalg.solve(frames[..., :3], (points - frames[..., 3])[..., None])[..., 0]
        moved = np.einsum("nijk,nj->nik", slopes, np.pad(local, ((0, 0), (0, 1)), constant_values=1.0))
        uphill = np.stack([across[band], -down[band]], axis=1)  # to the right and above
        own = -np.einsum("mi,mik->mk", uphill, (state.eye.by_points(points) @ moved)[mine])
        by_pose = np.zeros((len(mine), self.layout.size // POSE, POSE))
        by_pose[np.arange(len(mine)), owner[mine]] = own
        by_camera = -np.einsum("mi,mik->mk", uphill, state.eye.by_numbers(points)[mine])
        change = np.concatenate([by_pose.reshape(len(mine), -1) @ self.layout.basis, by_camera], axis=1)
        return self.seen.trust[band][:, None] * change, state.off[band]
