"""What `partwright parts train-encoder` does."""

from __future__ import annotations

import argparse

from partwright.cli.commands.companions import how, train_beside
from partwright.cli.progress import Count
from partwright.datasets.prepared import PreparedFamily
from partwright.methods import Cancellation
from partwright.partsdf import encoder, image_encoder
from partwright.partsdf.encoder import Encoder, EncoderSettings
from partwright.partsdf.encoder_training import EncoderStep, train_encoder
from partwright.partsdf.image_encoder import ImageEncoder, ImageSettings
from partwright.partsdf.image_encoder_training import ImageStep, train_image_encoder
from partwright.partsdf.model import Model
from partwright.processes import one_a_processor


def run(arguments: argparse.Namespace) -> int:
    last: list[EncoderStep | ImageStep] = []

    def train(model: Model, count: Count, cancel: Cancellation) -> Encoder | ImageEncoder:

        def told(step: EncoderStep | ImageStep) -> None:
            last[:] = [step]
            count.show(step.number, step.of, f"latents {step.latents:.3f}  poses {step.poses:.3f}")

        family, width = PreparedFamily(arguments.family), arguments.width
        if arguments.sees == "points":
            settings = EncoderSettings(width=width)
            return train_encoder(model, family, settings=settings, told=told, cancel=cancel, **how(arguments))

        def drawn(done: int, of: int) -> None:
            count.show(done, of, "views drawn")

        workers = one_a_processor(arguments.workers)
        return train_image_encoder(
            model, family, settings=ImageSettings.of_width(width), views=arguments.views, workers=workers,
            drawn=drawn, told=told, cancel=cancel, **how(arguments),
        )  # fmt: skip

    def about(_: Model) -> str:
        return f": {1 - last[0].latents:.0%} of what latents vary by are told;" if last else ";"

    kind = encoder.KIND if arguments.sees == "points" else image_encoder.KIND
    return train_beside(arguments, kind, train, about)
