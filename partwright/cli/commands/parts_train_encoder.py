"""What `partwright parts train-encoder` does."""

from __future__ import annotations

import argparse

from partwright.atomic_io import check_files
from partwright.cli.interrupts import INTERRUPTED, stopping
from partwright.cli.progress import Count
from partwright.cli.terminal import say, warn
from partwright.datasets.prepared import PreparedFamily
from partwright.methods import Cancellation
from partwright.partsdf.companions import place_for
from partwright.partsdf.encoder import KIND
from partwright.partsdf.encoder_training import EncoderStep, train_encoder
from partwright.partsdf.model import load_model


def run(arguments: argparse.Namespace) -> int:
    model = load_model(arguments.model)
    output = place_for(model, KIND, arguments.output)
    check_files([output])
    cancel = Cancellation()
    last: list[EncoderStep] = []
    with Count("training") as count, stopping(cancel.request):

        def told(step: EncoderStep) -> None:
            last[:] = [step]
            count.show(step.number, step.of, f"latents {step.latents:.3f}  poses {step.poses:.3f}")

        encoder = train_encoder(
            model,
            PreparedFamily(arguments.family),
            steps=arguments.steps,
            seed=arguments.seed,
            told=told,
            cancel=cancel,
        )
    encoder.save(output)
    told_last = f": {1 - last[0].latents:.0%} of what latents vary by are told" if last else ""
    say(f"{model.name}'s encoder{told_last}; written to {output}")
    if cancel.requested:
        warn([f"interrupted: {output} has learned as far as it had come"])
        return INTERRUPTED
    return 0
