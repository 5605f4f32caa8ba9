"""What `partwright parts train-generator` does."""

from __future__ import annotations

import argparse

from partwright.cli.commands.companions import how, train_beside
from partwright.cli.progress import Count
from partwright.cli.terminal import counted
from partwright.methods import Cancellation
from partwright.partsdf.generator import KIND, Generator
from partwright.partsdf.generator_training import GeneratorStep, train_generator
from partwright.partsdf.model import Model


def run(arguments: argparse.Namespace) -> int:
    def train(model: Model, count: Count, cancel: Cancellation) -> Generator:
        def told(step: GeneratorStep) -> None:
            count.show(step.number, step.of, f"poses {step.layouts:.3f}  latents {step.forms:.3f}")

        return train_generator(model, told=told, cancel=cancel, **how(arguments))

    return train_beside(arguments, KIND, train, lambda model: f", of {counted(len(model.shapes), 'shape')}:")
