"""Fine-tuning to one shape by the paper's schedule (sections 3.3, 4.1): three stages of gradient descent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from partwright.capri import stages
from partwright.capri.network import HALF, VOXELS, CapriNet, distances, rows_of
from partwright.capri.surface import Surface
from partwright.shapes import Shape

POINTS = 32_768  # that supervise (section 4.2)
BATCH = 8_192  # of them an iteration, drawn anew
LEARNING_RATE = 1e-4
BETAS = (0.5, 0.999)
ALONG = 8  # points along each normal (point clouds)
ALONG_SIGMA = 1 / 64  # and their spread, in the paper's coordinates


@dataclass(frozen=True)
class Supervision:
    """Points (n, 3) in the paper's coordinates and occupancy (n,): 1 inside."""

    points: NDArray[np.float32]
    inside: NDArray[np.float32]


def voxel_supervision(shape: Shape, seed: int) -> Supervision:
    """Voxel centres of a 64^3 grid: first those whose neighbourhood is not all alike, then any others."""
    from scipy.ndimage import maximum_filter, minimum_filter

    occupied = shape.unit_occupancy(VOXELS)
    near = maximum_filter(occupied, 5) != minimum_filter(occupied, 5)
    rng = np.random.default_rng((seed, 4))
    first, rest = (np.flatnonzero(mask) for mask in (near.ravel(), ~near.ravel()))
    chosen = rng.permutation(first)[:POINTS]
    chosen = np.r_[chosen, rng.choice(rest, POINTS - len(chosen), replace=False)]
    centres = (np.stack(np.unravel_index(chosen, occupied.shape), axis=1) + 0.5) * (2 / VOXELS) - 1
    return Supervision((HALF * centres).astype(np.float32), occupied.ravel()[chosen].astype(np.float32))


def point_supervision(surface: Surface, seed: int) -> Supervision:
    """8 points along the normal of each surface point, at Gaussian offsets of 1/64: inside where negative."""
    rng = np.random.default_rng((seed, 4))
    which = rng.choice(len(surface.points), POINTS // ALONG, replace=len(surface.points) < POINTS // ALONG)
    offset = rng.normal(0, ALONG_SIGMA, (len(which), ALONG, 1))
    points = HALF * surface.points[which, None] + offset * surface.normals[which, None]
    return Supervision(points.reshape(-1, 3).astype(np.float32), (offset.ravel() < 0).astype(np.float32))


@dataclass(frozen=True)
class Tuned:
    """Rows (p, 10) in the unit frame and the convexes of both sides, as lists of rows' indices."""

    rows: NDArray[np.float64]
    layers: list[list[tuple[int, ...]]]


class Tuning:
    """One shape's copy of the network: its code, MLP, T and W; the encoder is left out (section 3)."""

    def __init__(self, network: CapriNet, code: Tensor, supervision: Supervision, seed: int) -> None:
        self.network = network
        device = code.device
        self.code = nn.Parameter(code.detach().clone())
        self.points = torch.from_numpy(supervision.points).to(device)
        self.inside = torch.from_numpy(supervision.inside).to(device)
        self.generator = torch.Generator().manual_seed(seed)

    def run(self, stage: stages.Stage, iterations: int, tell: Callable[[int], None] | None = None) -> float:
        """So many steps of one stage; returns the last loss. The last stage keeps T, as it is binary."""
        net = self.network
        moving: list[Tensor] = [self.code, *net.primitives.parameters()]
        if stage != "binary_selection":
            moving.append(net.selection)
        if stage == "weighted_union":
            moving.append(net.weights)
        optimiser = torch.optim.Adam(moving, LEARNING_RATE, BETAS)
        value = float("nan")
        for i in range(iterations):
            which = torch.randint(len(self.points), (BATCH,), generator=self.generator).to(self.code.device)
            optimiser.zero_grad()
            loss = self.loss(stage, self.points[which][None], self.inside[which][None])
            loss.backward()
            optimiser.step()
            value = float(loss.detach())
            if tell is not None:
                tell(i + 1)
        return value

    def loss(self, stage: stages.Stage, points: Tensor, inside: Tensor) -> Tensor:
        """Of a batch (1, n, 3), (1, n)."""
        net = self.network
        distance = distances(net.coefficients(self.code), points)
        found = stages.sides(stage, distance, net.selection, net.weights)
        return stages.loss(stage, found, inside, net.selection, net.weights)

    def result(self) -> Tuned:
        """The tree as T_hard has it."""
        net = self.network
        rows = rows_of(net.coefficients(self.code)[0])
        chosen = stages.binary(net.selection.detach()).cpu().numpy() > 0
        convexes = [tuple(np.flatnonzero(column).tolist()) for column in chosen.T]
        half = len(convexes) // 2
        return Tuned(rows, [[c for c in side if c] for side in (convexes[:half], convexes[half:])])


def encode(network: CapriNet, shape: Shape) -> Tensor:
    """Code (1, code) of a shape's 64^3 voxels."""
    device = network.selection.device
    voxels = torch.from_numpy(shape.unit_occupancy(VOXELS).astype(np.float32)).to(device)
    with torch.no_grad():
        code: Tensor = network.encoder(voxels[None, None])
    return code
