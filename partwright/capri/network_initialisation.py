"""How pre-training starts: every convex as a box somewhere, with curved quadrics of its own (ours).

From the usual small random weights all values of all quadrics are next to 0, so that every point lies in
every convex, and gradient descent spends its first thousands of steps on getting the numbers up. What T
selects is shared by all shapes, so a convex does well to have a plane for each of its six sides at hand.
"""

from __future__ import annotations

from typing import cast

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from partwright.capri import quadric_rows as rows
from partwright.capri.network import CapriNet, coefficients_of

_SHARPNESS = 3.0  # a third off a quadric's surface counts in full (eq. 4): nearer points have a gradient
_MAX_UNSELECTED = 1e-3  # of the rest of T: it may be taken up
_UNION_WEIGHT = 0.2  # W at the start; L_W makes it 1
_REACH = 0.9  # unit lengths: half the longest side of any shape
_DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3)])


def initialise_boxes(network: CapriNet, seed: int) -> None:
    """Sets T, W and the primitives' biases. Convexes share out the primitives evenly: six planes each, then
    cylinders along the axes and a sphere or two; those of the right side are smaller."""
    rng = np.random.default_rng((seed, 5))
    count, convexes = network.sizes.primitives, network.sizes.convexes
    share = count // convexes
    made = [convex_rows(share, i >= convexes // 2, rng) for i in range(convexes)]
    last = cast(nn.Linear, network.primitives[2])
    with torch.no_grad():
        network.selection.uniform_(0, _MAX_UNSELECTED)
        network.weights.fill_(_UNION_WEIGHT)
        for i in range(convexes):
            network.selection[i * share : (i + 1) * share, i] = 1.0
        wanted = torch.from_numpy(coefficients_of(_SHARPNESS * np.concatenate(made))).to(last.bias)
        last.bias[: wanted.numel()] = wanted.flatten()


def convex_rows(count: int, small: bool, rng: np.random.Generator) -> NDArray[np.float64]:
    """Rows (count, 10) of one convex: a box, and quadrics that hold its middle."""
    centre = rng.uniform(-0.5, 0.5, 3)
    half = rng.uniform(0.08, 0.35 if small else 0.6, 3)
    sides = [rows.plane(n, float(n @ centre + np.abs(n) @ half)) for n in _DIRECTIONS]
    curved = []
    for k in range(6, count):
        radius = float(rng.uniform(0.6, 1.5) * half.max() + 0.05)
        axis = np.eye(3)[rng.integers(3)]
        curved.append(
            rows.sphere(centre, radius + 0.2) if k % 4 == 3 else rows.cylinder(centre, axis, radius)
        )
    return np.stack([*sides, *curved])[:count]
