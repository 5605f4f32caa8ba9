"""`partwright batch`: every shape of a folder fitted, begun, resumed, looked at, tried again."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from partwright.cli.fit import add_method
from partwright.cli.parser import Parser
from partwright.cli.reading import add_reading


def add(commands: argparse._SubParsersAction[Parser]) -> None:
    command = commands.add_parser(
        "batch",
        help="fit every shape of a folder",
        description="Fits every shape of a folder, each by a worker process that is killed past its limits. "
        "The same command resumes. `partwright batch FOLDER -o OUT` is short for `partwright batch run`.",
    )
    command.implied = "run"
    subcommands = command.add_subparsers(title="commands", metavar="COMMAND", required=True)
    _add_run(subcommands)
    _add_status(subcommands)
    _add_retry(subcommands)


def _add_run(subcommands: Any) -> None:
    run = subcommands.add_parser(
        "run",
        help="fit what has no result yet",
        description="Fits every shape below FOLDER that has no result yet. Writes OUT/items/, one folder a "
        "shape named by the file's content, manifest.jsonl, index.html, index.csv and, with pyarrow, "
        "index.parquet.",
    )
    run.add_argument("folder", metavar="FOLDER", type=Path, help="the folder with the shapes")
    run.add_argument("-o", "--output", metavar="OUT", type=Path, required=True, help="where to write")
    group = run.add_argument_group("input")
    add_reading(group, "length unit of shapes that have none")
    add_method(run.add_argument_group("method and budget"))
    group = run.add_argument_group("running")
    group.add_argument("--seed", metavar="S", type=int, default=0, help="of every fit (default: %(default)s)")
    group.add_argument(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="auto",
        help="what computes (default: %(default)s)",
    )
    _add_running(group)
    run.add_argument(
        "--shard", metavar="I/N", default="1/1", help="only the I-th of N equal shares, by content"
    )
    run.set_defaults(run="batch", failed=False)


def _add_status(subcommands: Any) -> None:
    status = subcommands.add_parser(
        "status",
        help="how far a batch is",
        description="How far a batch is, and what failed. Changes nothing.",
    )
    status.add_argument("output", metavar="OUT", type=Path, help="the output folder of a batch")
    status.set_defaults(run="batch_status")


def _add_retry(subcommands: Any) -> None:
    retry = subcommands.add_parser(
        "retry",
        help="try again what failed",
        description="Goes on with a batch, as it was begun, and tries again what failed.",
    )
    retry.add_argument("output", metavar="OUT", type=Path, help="the output folder of a batch")
    retry.add_argument(
        "--failed", action="store_true", help="those that failed, alone: nothing that was not begun yet"
    )
    _add_running(retry.add_argument_group("running"))
    retry.add_argument(
        "--shard", metavar="I/N", default="1/1", help="only the I-th of N equal shares, by content"
    )
    retry.set_defaults(run="batch_retry")


def _add_running(group: argparse._ActionsContainer) -> None:
    option = group.add_argument
    option("--at-once", metavar="N", type=int, default=0, help="worker processes (default: one per core)")
    option(
        "--ray",
        metavar="ADDRESS",
        help="by the nodes of a Ray cluster that share the disk; auto: the one this machine is part of",
    )
    option("--limit", metavar="N", type=int, help="begin at most N shapes this time")
    option(
        "--time-limit",
        metavar="S",
        type=float,
        default=900.0,
        help="seconds for a shape (default: %(default)g)",
    )
    option("--memory-limit", metavar="GB", type=float, default=8.0, help="for a shape (default: %(default)g)")
