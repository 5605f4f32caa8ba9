"""Points with occupancy that supervise fine-tuning, from voxels (section 4.2), points (4.3) or a surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.capri import surface as surfaces
from partwright.capri.network import HALF, VOXELS
from partwright.shapes import Shape

_COUNT = 32_768  # voxel centres (section 4.2)
_NEIGHBOURS = 5  # voxels along each side of the cube that is looked at for a change, as the authors' program
_CLOUD = 8_192  # points (section 4.3)
_ALONG = 8  # points along each normal
_SPREAD = 1 / 64  # and their standard deviation, in the paper's coordinates
_SIGMA = (0.02, 0.006)  # unit lengths: of our own samples


@dataclass(frozen=True)
class Supervision:
    """Points (n, 3) in the paper's coordinates and occupancy (n,): 1 inside."""

    points: NDArray[np.float32]
    inside: NDArray[np.float32]


def supervision(kind: str, shape: Shape, seed: int) -> Supervision:
    """Of a kind: "voxels" and "points" as in the paper; "samples", ours, has the surface's exact side, so
    that detail thinner than a voxel counts."""
    makers = {"voxels": from_voxels, "points": from_points, "samples": from_surface}
    return makers[kind](shape, seed)


def from_voxels(shape: Shape, seed: int) -> Supervision:
    """Voxel centres of the 64^3 grid: those in whose 5^3 neighbourhood occupancy varies, then any others."""
    from scipy.ndimage import maximum_filter, minimum_filter

    occupied = shape.unit_occupancy(VOXELS)
    near = (maximum_filter(occupied, _NEIGHBOURS) != minimum_filter(occupied, _NEIGHBOURS)).ravel()
    rng = np.random.default_rng((seed, 4))
    chosen = rng.permutation(np.flatnonzero(near))[:_COUNT]
    others = rng.choice(np.flatnonzero(~near), _COUNT - len(chosen), replace=False)
    chosen = np.concatenate([chosen, others])
    centres = (np.stack(np.unravel_index(chosen, occupied.shape), axis=1) + 0.5) * (2 / VOXELS) - 1
    return Supervision((HALF * centres).astype(np.float32), occupied.ravel()[chosen].astype(np.float32))


def from_points(shape: Shape, seed: int) -> Supervision:
    """8 points along the normal of each of 8,192 surface points, Gaussian of 1/64: inside where behind."""
    surface = surfaces.sample(shape, _CLOUD, seed)
    rng = np.random.default_rng((seed, 4))
    offset = rng.normal(0, _SPREAD, (_CLOUD, _ALONG, 1))
    points = HALF * surface.points[:, None] + offset * surface.normals[:, None]
    return Supervision(points.reshape(-1, 3).astype(np.float32), (offset.ravel() < 0).astype(np.float32))


def from_surface(shape: Shape, seed: int) -> Supervision:
    """Three quarters near the surface, the rest anywhere in the box, with the shape's own side."""
    drawn = shape.samples(3 * _COUNT // 4, _COUNT // 4, seed, _SIGMA)
    return Supervision(HALF * drawn.points, (drawn.distance < 0).astype(np.float32))
