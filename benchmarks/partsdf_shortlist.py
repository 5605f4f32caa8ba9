"""Exchanged parts of a start: what it costs to judge all but the likely ones at every fourth sample only."""

from __future__ import annotations

import argparse
import time

import torch
from partsdf_scores import command_line, write

from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import mean_error
from partwright.partsdf.starts import exchanged_parts, nearest_trained
from partwright.partsdf.targets import Target

EVERY = 10_000  # more than there are: none is left out


def shortlisting(arguments: argparse.Namespace) -> None:
    """Errors of starts before an exchange, after one among likely parts, and after one among all."""
    lines = [
        "# PartSDF: exchanged parts, shortlisted or not", "",
        f"{arguments.shapes} held-out shapes a family, without labels, each from the training shape that is "
        "nearest. Mean error of the distance, clamped, x1e4, at 8,192 samples; the same parts: the share of "
        "those that both ways choose; seconds of the processor an exchange.", "",
        command_line(), "",
        "| | start | likely | all | same parts % | s, likely | s, all |",
        "|---|---|---|---|---|---|---|",
    ]  # fmt: skip
    for name in arguments.names.split(","):
        family, model = PreparedFamily(arguments.families / name), load_model(name)
        rows = [row(model, family, i) for i in family.split("test")[: arguments.shapes]]
        start, few, every, same, spent, all_spent = (
            torch.tensor(rows, dtype=torch.float64).mean(dim=0).tolist()
        )
        lines.append(
            f"| {name} | {1e4 * start:.1f} | {1e4 * few:.1f} | {1e4 * every:.1f} | {100 * same:.0f} | "
            f"{spent:.2f} | {all_spent:.2f} |"
        )
        print(lines[-1], flush=True)
    write("shortlist", lines)


def row(model: Model, family: PreparedFamily, index: int) -> tuple[float, ...]:
    """Of one shape: the three errors, the share of the same parts, the two times."""
    shape = family.load(index)
    target = Target(torch.tensor(shape.points), torch.tensor(shape.sdf))
    ((_, start),) = nearest_trained(model, target)
    few, spent = timed(start, target)
    every, all_spent = timed(start, target, likely=EVERY)
    same = float((few.latents == every.latents).all(dim=1).float().mean())
    errors = (mean_error(one, target) for one in (start, few, every))
    return *errors, same, spent, all_spent


def timed(start: NeuralShape, target: Target, **how: int) -> tuple[NeuralShape, float]:
    begun = time.process_time()
    made = exchanged_parts(start, target, **how)
    return made, time.process_time() - begun
