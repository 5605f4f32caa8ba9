"""`partwright parts train`: a model of a prepared family."""

from __future__ import annotations

import argparse
from pathlib import Path

_EPILOG = """\
CONFIG is a TOML file; configs/ has some, docs/parts-train.md says what they may hold.
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
    command.set_defaults(run="parts_train")
