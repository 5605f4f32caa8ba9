"""What `partwright parts train` does."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from partwright.cli.interrupts import INTERRUPTED, raising
from partwright.cli.terminal import say, warn
from partwright.partsdf.config import read_config
from partwright.partsdf.training import EpochReport, train


def run(arguments: argparse.Namespace) -> int:
    config = read_config(arguments.config)
    if arguments.family:
        config = replace(config, family=arguments.family)
    with raising():
        trained = train(config, arguments.output, progress=_show)
    if arguments.half:
        trained.model.save(arguments.output / "model-half.safetensors", half=True)
    say(f"{trained.model.name}: {len(trained.model.shapes)} shapes, written to {trained.path}")
    if trained.outcome == "interrupted":
        warn(["interrupted: the same command goes on from here"])
        return INTERRUPTED
    return 0


def _show(report: EpochReport) -> None:
    print(
        f"partwright: epoch {report.epoch}/{report.epochs}  whole {report.whole:.5f}  "
        f"part {report.part:.5f}  overlap {report.inter:.5f}  {report.seconds:.0f} s",
        file=sys.stderr,
        flush=True,
    )
