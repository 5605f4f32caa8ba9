"""What `partwright parts train-generator` does."""

from __future__ import annotations

import argparse

from partwright.atomic_io import check_files
from partwright.cli.interrupts import INTERRUPTED, stopping
from partwright.cli.progress import Count
from partwright.cli.terminal import counted, say, warn
from partwright.methods import Cancellation
from partwright.partsdf.companions import place_for
from partwright.partsdf.generator import KIND
from partwright.partsdf.generator_training import GeneratorStep, train_generator
from partwright.partsdf.model import load_model


def run(arguments: argparse.Namespace) -> int:
    model = load_model(arguments.model)
    output = place_for(model, KIND, arguments.output)
    check_files([output])
    cancel = Cancellation()
    with Count("training") as count, stopping(cancel.request):

        def told(step: GeneratorStep) -> None:
            count.show(step.number, step.of, f"poses {step.layouts:.3f}  latents {step.forms:.3f}")

        generator = train_generator(
            model, steps=arguments.steps, seed=arguments.seed, told=told, cancel=cancel
        )
    generator.save(output)
    say(f"{model.name}'s generator, of {counted(len(model.shapes), 'shape')}: written to {output}")
    if cancel.requested:
        warn([f"interrupted: {output} has learned as far as it had come"])
        return INTERRUPTED
    return 0
