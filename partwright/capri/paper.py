"""The paper's route: the network, pre-trained or seeded with a tree, fine-tuned in three stages, pruned."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partwright.capri import stages
from partwright.capri.csg_tree import CsgTree
from partwright.capri.finetuning import Finetuning, encoded, seeded, straightened
from partwright.capri.finetuning_samples import draw_finetuning_samples
from partwright.capri.network import CapriNet, load_network, rows_of
from partwright.capri.pruning import pruned
from partwright.capri.settings import Settings
from partwright.devices import device_of
from partwright.methods import Run
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
    seeds: CsgTree | None,
    settings: Settings,
    run: Run,
    points: NDArray[np.floating],
    accept: Callable[[CsgTree], None],
    report: Callable[[str, float], None],
    pause: Callable[[], None],
) -> None:
    """Runs the three stages, from a tree or (None) from the pre-trained network, and keeps the pruned tree.

    points (N, 3): unit frame; what pruning looks at. pause: called at each step; where it raises, what there
    is is kept.
    """
    import torch

    if run.threads:
        torch.set_num_threads(run.threads)
    device = device_of(run.device)
    if seeds is None:
        network = network_of(settings)
        code = encoded(network, shape)
    else:
        network, code = seeded(seeds, run.seed)
    samples = draw_finetuning_samples(settings.supervision, shape, run.seed)
    tuning = Finetuning(network.to(device), code.to(device), samples, run.seed)
    try:
        for i, stage in enumerate(stages.STAGES):
            stage_report = partial(_report_stage, report, stage.replace("_", " "), i)
            tuning.run(stage, settings.iterations, stage_report, pause)
    finally:
        accept(pruned(tuning.tree(), points))


def _report_stage(report: Callable[[str, float], None], stage: str, before: int, done: float) -> None:
    report(stage, (before + done) / len(stages.STAGES))
