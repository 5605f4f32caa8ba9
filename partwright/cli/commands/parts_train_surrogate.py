"""What `partwright parts train-surrogate` does."""

from __future__ import annotations

import argparse

import numpy as np

from partwright.cli.interrupts import INTERRUPTED, stopping
from partwright.cli.progress import Count
from partwright.cli.terminal import counted, say, warn
from partwright.goals.flow.dataset import read_all
from partwright.goals.flow.learning import scores, train
from partwright.methods import Cancellation

_SIXTH = 6


def run(arguments: argparse.Namespace) -> int:
    samples = list(read_all(arguments.flows))
    held = len(samples) // _SIXTH if arguments.held_out is None else arguments.held_out
    order = np.random.default_rng(arguments.seed).permutation(len(samples))
    tested, learned = [samples[i] for i in order[:held]], [samples[i] for i in order[held:]]
    cancel = Cancellation()
    with Count("training") as count, stopping(cancel.request):
        model = train(
            learned,
            rounds=arguments.rounds,
            seed=arguments.seed,
            mirror=arguments.mirror or "",
            told=lambda one: count.show(one.number, one.of, f"loss {one.loss:.4f}"),
            cancel=cancel,
        )
    model.save(arguments.output)
    if len(tested) > 1:
        mean = float(np.mean([one.drag_area for one in learned]))
        found = scores(model, tested, mean)
        say(
            f"{counted(found.bodies, 'shape')} held out: rank correlation {found.rank:.3f}, "
            f"R2 {found.r2:.3f}, mean error {found.error:.1%} (of the training's mean {found.floor:.1%})"
        )
    say(f"learned from {counted(len(learned), 'shape')}: {arguments.output}")
    if cancel.requested:
        warn([f"interrupted: {arguments.output} has learned as far as it had come"])
        return INTERRUPTED
    return 0
