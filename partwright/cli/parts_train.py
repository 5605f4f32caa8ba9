"""`partwright parts train`: a model of a prepared family."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from partwright.partsdf.training import EpochReport

_EPILOG = """\
CONFIG is a TOML file; configs/ has some, docs/parts.md says what they may hold.
Ctrl-C keeps what is done; the same command goes on from there, to the same result.
"""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "train",
        help="train a model of a prepared family",
        description="Trains a part-based model (PartSDF) and writes model.safetensors, "
        "checkpoint.safetensors, log.csv, pictures of validation shapes, and a log for TensorBoard.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    command.add_argument("config", metavar="CONFIG", type=Path, help="settings (.toml)")
    command.add_argument("-o", "--output", metavar="DIR", type=Path, required=True, help="where to write")
    option = command.add_argument
    option("--family", metavar="FOLDER", help="the prepared family, instead of the one that CONFIG names")
    option("--half", action="store_true", help="also write model-half.safetensors, rounded to half precision")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    from dataclasses import replace

    from partwright.cli.interrupts import raising
    from partwright.cli.terminal import say, warn
    from partwright.partsdf.config import read_config
    from partwright.partsdf.training import train

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
        return 130
    return 0


def _show(report: EpochReport) -> None:
    import sys

    print(
        f"partwright: epoch {report.epoch}/{report.epochs}  whole {report.whole:.5f}  "
        f"part {report.part:.5f}  overlap {report.inter:.5f}  {report.seconds:.0f} s",
        file=sys.stderr,
        flush=True,
    )
