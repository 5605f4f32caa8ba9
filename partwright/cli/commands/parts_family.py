"""What `partwright parts family` does."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from partwright.cli.interrupts import INTERRUPTED, raising
from partwright.cli.progress import Count
from partwright.cli.terminal import counted, note, say, warn
from partwright.durations import duration
from partwright.partsdf.own_family import CHECK, PICTURE, Plan, learn_family
from partwright.partsdf.training import EpochReport

_TOLD = 8  # findings; all are in the table


def run(arguments: argparse.Namespace) -> int:
    folder = arguments.output

    def planned(plan: Plan) -> None:
        odd = [f"{f.shape or 'the family'}, {f.severity}: {f.text}" for f in plan.findings]
        warn(odd[:_TOLD])
        more = f", {len(odd) - _TOLD} more in {folder / CHECK}" if len(odd) > _TOLD else ""
        say(f"{counted(len(plan.family), 'shape')} of {', '.join(plan.family.parts)}; "
            f"{counted(len(odd), 'finding') if odd else 'nothing stands out'}{more}")  # fmt: skip
        steps = f"{plan.steps} steps" if plan.steps == plan.total else f"{plan.steps} of {plan.total} steps"
        say(f"{steps} will take about {duration(plan.seconds)}; watch {folder / PICTURE}")

    with raising():
        try:
            with Count("preparing") as count, Count("learning") as epochs:

                def told(report: EpochReport) -> None:
                    what = f"error {report.part:.4f}"
                    epochs.show(report.epoch, report.epochs, what)

                trained = learn_family(
                    arguments.source,
                    folder,
                    steps=arguments.steps,
                    samples=arguments.samples,
                    seed=arguments.seed,
                    threads=arguments.threads,
                    up=arguments.up,
                    workers=arguments.workers,
                    prepared=lambda step: count.show(step.done, step.total, step.shape),
                    planned=planned,
                    progress=told,
                )
        except KeyboardInterrupt:
            note(f"interrupted; what is done is kept in {folder}, and the same command goes on from there")
            return INTERRUPTED
    learned = f"{trained.model.name}: learned from {counted(len(trained.model.shapes), 'shape')}"
    say(f"{learned}, written to {trained.path}{_held_out(trained.scores)}")
    if trained.outcome == "interrupted":
        warn(["interrupted: the model is as good as it had become, and the same command goes on from here"])
        return INTERRUPTED
    return 0


def _held_out(scores: Mapping[str, float]) -> str:
    """How well shapes are found that it has not seen; nothing where that was not measured."""
    if not scores:
        return ""
    whole, parts = (100 * scores[name] for name in ("val_iou", "val_part_iou"))
    return (
        f"; shapes that it has not seen are found, their parts being known, at an IoU near the surface of "
        f"{whole:.0f} %, and over parts of {parts:.0f}"
    )
