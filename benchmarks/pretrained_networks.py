"""How well pre-trained networks of CAPRI-Net know CAD parts that none was trained on.

    python benchmarks/pretrained_networks.py [ABOUT=FILE ...]

The network that ships, and others that `python -m partwright.capri` wrote, ABOUT being what the table says of
one. Stage 0, as trained: a point is inside where the left union is above 0.5 and the right one is not. IoU
over points of each part, half of them near its surface, and over those anywhere in the box alone.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
import torch
from fit import machine

from partwright.atomic_io import write_bytes
from partwright.capri import stages
from partwright.capri.network import CapriNet, distances, load_network
from partwright.capri.paper import SHIPPED
from partwright.capri.pretraining_dataset import PretrainingDataset, make_pretraining_dataset
from partwright.metrics.iou import occupancy_iou

_PARTS, _POINTS, _SEED = 48, 8192, 99  # of a seed that nothing is trained on
_AT_ONCE = 4


@torch.no_grad()
def scores(network: CapriNet, parts: PretrainingDataset) -> tuple[float, float, float]:
    """Eq. 10, and the mean IoU over all points and over those anywhere."""
    losses, ious = [], []
    for first in range(0, len(parts), _AT_ONCE):
        rows = slice(first, first + _AT_ONCE)
        voxels, points, inside = parts.rows(rows)
        found = stages.sides(
            "weighted_union",
            distances(network.coefficients(network.encoder(voxels)), points),
            network.selection,
            network.weights,
        )
        losses.append(float(stages.weighted_loss(found, inside)))
        said, true = (found.left > stages.BETA) & (found.right <= stages.BETA), inside > 0
        half = said.shape[1] // 2
        for s, t in zip(said.numpy(), true.numpy(), strict=True):
            ious.append([occupancy_iou(s, t), occupancy_iou(s[half:], t[half:])])
    every, anywhere = np.mean(ious, axis=0)
    return float(np.mean(losses)), every, anywhere


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("networks", nargs="*", metavar="ABOUT=FILE")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path(__file__).parent / "results" / "pretrained_networks.md"
    )
    options = parser.parse_args()
    torch.set_num_threads(1)
    given = [text.rpartition("=") for text in options.networks]
    files = [("the one that ships", SHIPPED), *((about, Path(file)) for about, _, file in given)]
    parts = make_pretraining_dataset(_PARTS, _POINTS, _SEED)
    lines = [
        "# Pre-trained networks on CAD parts that they have not seen",
        "",
        f"`python benchmarks/pretrained_networks.py ABOUT=FILE ...` on {machine()}: {_PARTS} parts of seed "
        f"{_SEED}, {_POINTS:,} points each, half of them near the surface.",
        "",
        "| network | primitives | convexes | loss (eq. 10) | IoU, all points | IoU, anywhere |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    for about, file in files:
        network = load_network(file)
        loss, every, anywhere = scores(network, parts)
        size = f"{network.sizes.primitives:,} | {network.sizes.convexes}"
        lines.append(f"| {about} | {size} | {loss:.3f} | {every:.3f} | {anywhere:.3f} |")
        print(lines[-1], flush=True)
    write_bytes(options.output, ("\n".join(lines) + "\n").encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
