"""What pre-training sees: CAD parts as 64^3 voxels and as points with their side, kept in one file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from partwright.capri.network import UNIT_TO_PAPER, VOXELS
from partwright.errors import UnreadableFileError

_NEAR_SIGMAS = (0.02, 0.06)  # unit lengths: of the points near the surface
_FORMAT = "partwright-capri-collection-1"


@dataclass(frozen=True)
class PretrainingDataset:
    """voxels (N, 64^3 / 8) uint8, packed; points (N, n, 3) float16 in the paper's coordinates, the first half
    near the surface, the rest anywhere in the box; inside (N, n) bool."""

    voxels: NDArray[np.uint8]
    points: NDArray[np.float16]
    inside: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.points)

    def draw(
        self, size: int, count: int, near: bool, rng: np.random.Generator
    ) -> tuple[Tensor, Tensor, Tensor]:
        """A batch of `size` parts, turned or mirrored by one of the 48 symmetries of the cube: voxels
        (B, 1, 64, 64, 64), `count` points (B, n, 3) and inside (B, n); near: also near the surface."""
        parts = rng.choice(len(self), size, replace=False)
        half = self.points.shape[1] // 2
        chosen = np.sort(rng.integers(0 if near else half, 2 * half, count))
        voxels = np.unpackbits(self.voxels[parts], axis=1).reshape(size, VOXELS, VOXELS, VOXELS)
        points = self.points[parts][:, chosen].astype(np.float32)
        axes, signs = rng.permutation(3), rng.choice([-1, 1], 3)
        flipped = tuple(1 + axis for axis in range(3) if signs[axis] < 0)
        turned = np.flip(voxels.transpose(0, *(1 + axes)), flipped).astype(np.float32)
        moved = (points[..., axes] * signs).astype(np.float32)
        inside = self.inside[parts][:, chosen].astype(np.float32)
        return torch.from_numpy(turned)[:, None], torch.from_numpy(moved), torch.from_numpy(inside)

    def save(self, path: Path, parts: int, seed: int) -> None:
        """As safetensors, beside what it was made by."""
        from safetensors.numpy import save

        from partwright.atomic_io import write_bytes

        arrays: dict[str, NDArray[Any]] = {"voxels": self.voxels, "points": self.points}
        arrays["inside"] = np.packbits(self.inside, axis=1)
        about = {"format": _FORMAT, "parts": str(parts), "seed": str(seed)}
        write_bytes(path, save(arrays, {"about": json.dumps(about)}))


def load_pretraining_dataset(path: Path, parts: int, points: int, seed: int) -> PretrainingDataset:
    """The collection of these numbers from a file.

    Raises:
        UnreadableFileError: the file is damaged, or was made by other numbers.
    """
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, "np") as file:
            about = json.loads((file.metadata() or {})["about"])
            arrays = {name: file.get_tensor(name) for name in ("voxels", "points", "inside")}
    except (OSError, SafetensorError, KeyError, ValueError) as error:
        raise UnreadableFileError(f"{path}: is no collection of CAD parts ({error}); remove it") from error
    expected = {"format": _FORMAT, "parts": str(parts), "seed": str(seed)}
    if about != expected or arrays["points"].shape[1] != points:
        raise UnreadableFileError(f"{path}: holds other CAD parts ({about}); remove it, or write elsewhere")
    inside = np.unpackbits(arrays["inside"], axis=1, count=points).astype(bool)
    return PretrainingDataset(arrays["voxels"], arrays["points"], inside)


def make_pretraining_dataset(parts: int, points: int, seed: int) -> PretrainingDataset:
    """The first `parts` CAD parts of a seed, `points` points each."""
    from partwright.datasets.cad_parts import cad_parts
    from partwright.shapes import load_shape

    voxels = np.zeros((parts, VOXELS**3 // 8), dtype=np.uint8)
    places = np.zeros((parts, points, 3), dtype=np.float16)
    inside = np.zeros((parts, points), dtype=bool)
    for i, part in enumerate(cad_parts(parts, seed)):
        shape = load_shape(part.mesh)
        near = shape.samples(points // 2, 0, seed, _NEAR_SIGMAS).points
        anywhere = np.random.default_rng((seed, i)).uniform(-1, 1, (points - len(near), 3))
        places[i] = UNIT_TO_PAPER * np.concatenate([near, anywhere])
        inside[i] = shape.unit_distance(places[i].astype(np.float32) / UNIT_TO_PAPER) < 0
        voxels[i] = np.packbits(shape.unit_occupancy(VOXELS).ravel())
    return PretrainingDataset(voxels, places, inside)
