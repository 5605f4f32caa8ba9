"""What pre-training sees: CAD parts as 64^3 voxels and as points with their side, kept in one file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from partwright.capri.network import UNIT_TO_PAPER, VOXELS
from partwright.errors import UnreadableFileError
from partwright.processes import carried_out

_NEAR_SIGMAS = (0.02, 0.06)  # unit lengths: of the points near the surface
_FORMAT = "partwright-capri-collection-1"
_AT_ONCE = 16  # parts that a process makes


@dataclass(frozen=True)
class PretrainingDataset:
    """voxels (N, 64^3 / 8) uint8, packed; points (N, n, 3) float16 in the paper's coordinates, the first half
    near the surface, the rest anywhere in the box; inside (N, n) bool."""

    voxels: Tensor
    points: Tensor
    inside: Tensor

    def __len__(self) -> int:
        return len(self.points)

    def to(self, device: torch.device) -> PretrainingDataset:
        return PretrainingDataset(*(t.to(device) for t in vars(self).values()))

    def draw(
        self, size: int, count: int, near: bool, rng: np.random.Generator
    ) -> tuple[Tensor, Tensor, Tensor]:
        """A batch of `size` parts, turned or mirrored by one of the 48 symmetries of the cube: voxels
        (B, 1, 64, 64, 64), `count` points (B, n, 3) and inside (B, n); near: also near the surface."""
        device = self.points.device
        parts = torch.from_numpy(rng.choice(len(self), size, replace=False)).to(device)
        half = self.points.shape[1] // 2
        chosen = torch.from_numpy(np.sort(rng.integers(0 if near else half, 2 * half, count))).to(device)
        axes, signs = rng.permutation(3).tolist(), rng.choice([-1, 1], 3)
        voxels = _unpacked(self.voxels[parts]).view(size, VOXELS, VOXELS, VOXELS)
        flipped = [1 + axis for axis in range(3) if signs[axis] < 0]
        turned = voxels.permute(0, *(1 + axis for axis in axes)).flip(flipped)
        moved = self.points[parts][:, chosen].float()[..., axes] * torch.from_numpy(signs).float().to(device)
        return turned[:, None].contiguous().float(), moved, self.inside[parts][:, chosen].float()

    def rows(self, rows: slice) -> tuple[Tensor, Tensor, Tensor]:
        """Some parts as they stand, with all their points: voxels, points and inside as of `draw`."""
        voxels = _unpacked(self.voxels[rows]).view(-1, 1, VOXELS, VOXELS, VOXELS)
        return voxels.float(), self.points[rows].float(), self.inside[rows].float()

    def save(self, path: Path, parts: int, seed: int) -> None:
        """As safetensors, beside what it was made by."""
        from safetensors.numpy import save

        from partwright.atomic_io import write_bytes

        arrays = {"voxels": self.voxels.numpy(), "points": self.points.numpy()}
        arrays["inside"] = np.packbits(self.inside.numpy(), axis=1)
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
    return _dataset(arrays["voxels"], arrays["points"], inside)


def make_pretraining_dataset(parts: int, points: int, seed: int, workers: int = 1) -> PretrainingDataset:
    """The first `parts` CAD parts of a seed, `points` points each; the same by however many processes."""
    jobs = [range(parts)[first : first + _AT_ONCE] for first in range(0, parts, _AT_ONCE)]
    make = partial(_made, points=points, seed=seed)
    made = list(carried_out(make, jobs, workers))
    return _dataset(*(np.concatenate(each) for each in zip(*made, strict=True)))


def _made(parts: range, points: int, seed: int) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Voxels, points and inside of the parts of these numbers."""
    from partwright.datasets.cad_parts import cad_part
    from partwright.shapes import load_shape

    places = np.zeros((len(parts), points, 3), dtype=np.float16)
    voxels = np.zeros((len(parts), VOXELS**3 // 8), dtype=np.uint8)
    inside = np.zeros((len(parts), points), dtype=bool)
    for i, number in enumerate(parts):
        shape = load_shape(cad_part(number, seed).mesh)
        near = shape.samples(points // 2, 0, seed, _NEAR_SIGMAS).points
        anywhere = np.random.default_rng((seed, number)).uniform(-1, 1, (points - len(near), 3))
        places[i] = UNIT_TO_PAPER * np.concatenate([near, anywhere])
        inside[i] = shape.unit_distance(places[i].astype(np.float32) / UNIT_TO_PAPER) < 0
        voxels[i] = np.packbits(shape.unit_occupancy(VOXELS).ravel())
    return voxels, places, inside


def _dataset(voxels: NDArray[Any], points: NDArray[Any], inside: NDArray[Any]) -> PretrainingDataset:
    return PretrainingDataset(*(torch.from_numpy(one) for one in (voxels, points, inside)))


def _unpacked(packed: Tensor) -> Tensor:
    """(B, 8 n) bits of bytes (B, n), the highest first, as `numpy.packbits` puts them."""
    shift = torch.arange(7, -1, -1, dtype=torch.uint8, device=packed.device)
    return ((packed[..., None] >> shift) & 1).flatten(1)
