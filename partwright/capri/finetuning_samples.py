"""Points with occupancy that supervise fine-tuning, from voxels (section 4.2), points (4.3) or a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.capri import oriented_points
from partwright.capri.network import UNIT_TO_PAPER, VOXELS
from partwright.shapes import Shape

_SAMPLE_COUNT = 32_768  # voxel centres (section 4.2)
_NEIGHBOURHOOD_VOXELS = (
    5  # voxels along each side of the cube that is looked at for a change, as the authors' program
)
_CLOUD_POINTS = 8_192  # points (section 4.3)
_POINTS_PER_NORMAL = 8  # points along each normal
_NORMAL_SIGMA = 1 / 64  # and their standard deviation, in the paper's coordinates
_NEAR_SIGMAS = (0.02, 0.006)  # unit lengths: of our own samples


@dataclass(frozen=True)
class FinetuningSamples:
    """Points (n, 3) in the paper's coordinates and occupancy (n,): 1 inside."""

    points: NDArray[np.float32]
    inside: NDArray[np.float32]


def draw_finetuning_samples(kind: str, shape: Shape, seed: int) -> FinetuningSamples:
    """Of a kind: "voxels" and "points" as in the paper; "samples", ours, has the surface's exact side, so
    that detail thinner than a voxel counts."""
    makers = {"voxels": from_voxels, "points": from_points, "samples": from_surface}
    return makers[kind](shape, seed)


def from_voxels(shape: Shape, seed: int) -> FinetuningSamples:
    """Voxel centres of the 64^3 grid: those in whose 5^3 neighbourhood occupancy varies, then any others."""
    from scipy.ndimage import maximum_filter, minimum_filter

    occupied = shape.unit_occupancy(VOXELS)
    near = (
        maximum_filter(occupied, _NEIGHBOURHOOD_VOXELS) != minimum_filter(occupied, _NEIGHBOURHOOD_VOXELS)
    ).ravel()
    rng = np.random.default_rng((seed, 4))
    chosen = rng.permutation(np.flatnonzero(near))[:_SAMPLE_COUNT]
    others = rng.choice(np.flatnonzero(~near), _SAMPLE_COUNT - len(chosen), replace=False)
    chosen = np.concatenate([chosen, others])
    centres = (np.stack(np.unravel_index(chosen, occupied.shape), axis=1) + 0.5) * (2 / VOXELS) - 1
    return FinetuningSamples(
        (UNIT_TO_PAPER * centres).astype(np.float32), occupied.ravel()[chosen].astype(np.float32)
    )


def from_points(shape: Shape, seed: int) -> FinetuningSamples:
    """8 points along the normal of each of 8,192 surface points, Gaussian of 1/64: inside where behind."""
    surface = oriented_points.sample_surface(shape, _CLOUD_POINTS, seed)
    rng = np.random.default_rng((seed, 4))
    offset = rng.normal(0, _NORMAL_SIGMA, (_CLOUD_POINTS, _POINTS_PER_NORMAL, 1))
    points = UNIT_TO_PAPER * surface.points[:, None] + offset * surface.normals[:, None]
    return FinetuningSamples(
        points.reshape(-1, 3).astype(np.float32), (offset.ravel() < 0).astype(np.float32)
    )


def from_surface(shape: Shape, seed: int) -> FinetuningSamples:
    """Three quarters near the surface, the rest anywhere in the box, with the shape's own side."""
    drawn = shape.samples(3 * _SAMPLE_COUNT // 4, _SAMPLE_COUNT // 4, seed, _NEAR_SIGMAS)
    return FinetuningSamples(UNIT_TO_PAPER * drawn.points, (drawn.distance < 0).astype(np.float32))
