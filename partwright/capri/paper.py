"""The paper's route: the network, pre-trained or seeded with a tree, fine-tuned in three stages, pruned."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partwright.capri import stages
from partwright.capri.network import CapriNet, device_of, load_network, rows_of
from partwright.capri.pruning import pruned
from partwright.capri.settings import Settings
from partwright.capri.supervision import supervision
from partwright.capri.tree import Tree
from partwright.capri.tuning import Tuning, encoded, seeded, straightened
from partwright.shapes import Shape

SHIPPED = Path(__file__).parent / "models" / "cad_parts.safetensors"


def network_of(settings: Settings) -> CapriNet:
    """The pre-trained network: of the given file, or the one that ships."""
    return load_network(Path(settings.weights) if settings.weights else SHIPPED)


def predicted(shape: Shape, settings: Settings) -> NDArray[np.float64]:
    """Rows (p, 10) in the unit frame that the network predicts for a shape (section 3.1)."""
    network = network_of(settings)
    return straightened(rows_of(network.coefficients(encoded(network, shape))[0]))


def fine_tuned(
    shape: Shape,
    seeds: Tree | None,
    settings: Settings,
    points: NDArray[np.floating],
    keep: Callable[[Tree], None],
    tell: Callable[[str, float], None],
) -> None:
    """Runs the three stages, from a tree or (None) from the pre-trained network, and keeps the pruned tree.

    points (N, 3): unit frame; what pruning looks at. An interruption keeps what there is, and goes on.
    """
    import torch

    if settings.threads:
        torch.set_num_threads(settings.threads)
    device = device_of(settings.device)
    if seeds is None:
        network = network_of(settings)
        code = encoded(network, shape)
    else:
        network, code = seeded(seeds, settings.seed)
    given = supervision(settings.supervision, shape, settings.seed)
    tuning = Tuning(network.to(device), code.to(device), given, settings.seed)
    try:
        for i, stage in enumerate(stages.STAGES):
            told = partial(_tell, tell, stage.replace("_", " "), i)
            tuning.run(stage, settings.iterations, told)
    finally:
        keep(pruned(tuning.tree(), points))


def _tell(tell: Callable[[str, float], None], stage: str, before: int, done: float) -> None:
    tell(stage, (before + done) / len(stages.STAGES))
