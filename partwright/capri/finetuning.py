"""Fine-tuning to one shape by the paper's schedule (sections 3.3, 4.1): three stages of gradient descent."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from partwright.capri import quadric_rows as rows
from partwright.capri import stages
from partwright.capri.csg_tree import CsgTree
from partwright.capri.finetuning_samples import FinetuningSamples
from partwright.capri.network import SMALL, VOXELS, CapriNet, distances, rows_of
from partwright.shapes import Shape

BATCH_POINTS = 8_192  # points an iteration, drawn anew
LEARNING_RATE, BETAS = 1e-4, (0.5, 0.999)
_SEED_SHARPNESS = 256.0  # what seeded rows are multiplied by: a quarter of a voxel off counts in full (eq. 4)
_EMPTY_QUADRIC = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)  # a quadric that holds no point
_NORMALISING_POINTS = 16  # points that report how steep a quadric is
_MAX_PLANE_BEND = 2e-3  # unit lengths that a quadric may bend over the box and still count as a plane


class Finetuning:
    """One shape's copy of the network: its code, MLP, T and W move; the encoder does not (section 3)."""

    def __init__(self, network: CapriNet, code: Tensor, samples: FinetuningSamples, seed: int) -> None:
        self.network, self.code = network, nn.Parameter(code.detach().clone())
        self.points = torch.from_numpy(samples.points).to(code.device)
        self.inside = torch.from_numpy(samples.inside).to(code.device)
        self.generator = torch.Generator().manual_seed(seed)

    def run(
        self,
        stage: stages.Stage,
        iterations: int,
        report: Callable[[float], None],
        pause: Callable[[], None] | None = None,
    ) -> None:
        """So many steps of one stage, with a pause before each; reports the share that is done.

        The last stage keeps T: it is binary.
        """
        net = self.network
        moving: list[Tensor] = [self.code, *net.primitives.parameters()]
        if stage != "binary_selection":
            moving.append(net.selection)
        if stage == "weighted_union":
            moving.append(net.weights)
        optimiser = torch.optim.Adam(moving, LEARNING_RATE, BETAS)
        for i in range(iterations):
            if pause is not None:
                pause()
            which = torch.randint(len(self.points), (BATCH_POINTS,), generator=self.generator).to(
                self.code.device
            )
            optimiser.zero_grad()
            self.loss(stage, self.points[which][None], self.inside[which][None]).backward()
            optimiser.step()
            if (i + 1) % 50 == 0 or i + 1 == iterations:
                report((i + 1) / iterations)

    def loss(self, stage: stages.Stage, points: Tensor, inside: Tensor) -> Tensor:
        """Of a batch (1, n, 3), (1, n)."""
        net = self.network
        distance = distances(net.coefficients(self.code), points)
        found = stages.sides(stage, distance, net.selection, net.weights, leaks=True)
        return stages.loss(stage, found, inside, net.selection, net.weights)

    def tree(self) -> CsgTree:
        """The tree of T_hard, in the unit frame. A convex of no primitives is left out."""
        net = self.network
        made = straightened(rows_of(net.coefficients(self.code)[0]))
        chosen = stages.binary(net.selection.detach()).cpu().numpy() > 0
        convexes = [tuple(np.flatnonzero(column).tolist()) for column in chosen.T]
        half = len(convexes) // 2
        layers = tuple(tuple(c for c in side if c) for side in (convexes[:half], convexes[half:]))
        return CsgTree(made, np.zeros(len(made), dtype=bool), layers)


def straightened(given: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rows (p, 10) scaled to |grad f| = 1 where they are nearest to 0 in the unit cube, as the rest of the
    fit has them; those that hardly bend within it become planes."""
    slope = np.linalg.norm(given[:, rows.LINEAR], axis=1)
    flat = given[:, rows.SQUARES].max(axis=1) < _MAX_PLANE_BEND * slope
    bent = given.copy()
    bent[flat, rows.SQUARES] = 0.0
    grid = np.stack(np.meshgrid(*[np.linspace(-0.9, 0.9, 10)] * 3), axis=-1).reshape(-1, 3)
    nearest = np.argsort(np.abs(rows.values(bent, grid)), axis=0)[:_NORMALISING_POINTS].T
    return np.stack([rows.normalised(row, grid[near]) for row, near in zip(bent, nearest, strict=True)])


def encoded(network: CapriNet, shape: Shape) -> Tensor:
    """Code (1, code) of a shape's 64^3 voxels."""
    voxels = torch.from_numpy(shape.unit_occupancy(VOXELS).astype(np.float32))
    with torch.no_grad():
        code: Tensor = network.encoder(voxels.to(network.selection.device)[None, None])
    return code


def seeded(tree: CsgTree, seed: int) -> tuple[CapriNet, Tensor]:
    """A network without training that starts as a tree, and its code: the tree's rows are its first
    primitives, T is the tree's, unused convexes hold nothing, W is 1. Needs `expressible` rows."""
    torch.manual_seed(seed)
    used = sorted({k for layer in tree.layers for convex in layer for k in convex})
    most = max(len(layer) for layer in tree.layers)
    network = CapriNet(
        replace(
            SMALL,
            primitives=max(SMALL.primitives, len(used) + 1),
            convexes=max(SMALL.convexes, 2 * most),
        )
    )
    code = torch.full((1, network.sizes.code), 0.5)
    network.seed(_SEED_SHARPNESS * np.concatenate([tree.rows[used], [_EMPTY_QUADRIC]]), code)
    half = network.sizes.convexes // 2
    with torch.no_grad():
        network.weights.fill_(1.0)
        network.selection.zero_()
        network.selection[len(used)] = 1.0
        for side, layer in enumerate(tree.layers):
            for i, convex in enumerate(layer):
                column = network.selection[:, side * half + i]
                column.zero_()
                column[[used.index(k) for k in convex]] = 1.0
    return network, code
