"""What `partwright parts train-encoder` does."""

from __future__ import annotations

import argparse

from partwright.cli.commands.companions import train_beside
from partwright.cli.progress import Count
from partwright.datasets.prepared import PreparedFamily
from partwright.methods import Cancellation
from partwright.partsdf.encoder import KIND, Encoder
from partwright.partsdf.encoder_training import EncoderStep, train_encoder
from partwright.partsdf.model import Model


def run(arguments: argparse.Namespace) -> int:
    last: list[EncoderStep] = []

    def train(model: Model, count: Count, cancel: Cancellation) -> Encoder:
        def told(step: EncoderStep) -> None:
            last[:] = [step]
            count.show(step.number, step.of, f"latents {step.latents:.3f}  poses {step.poses:.3f}")

        return train_encoder(
            model,
            PreparedFamily(arguments.family),
            steps=arguments.steps,
            seed=arguments.seed,
            told=told,
            cancel=cancel,
        )

    def about(_: Model) -> str:
        return f": {1 - last[0].latents:.0%} of what latents vary by are told;" if last else ";"

    return train_beside(arguments, KIND, train, about)
