"""`partwright`: reads the arguments, runs the command, and turns errors into one line and an exit code."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from typing import Any

from partwright import __version__
from partwright.cli import (
    batch,
    clean,
    collide,
    completion,
    describe,
    edit,
    evaluate,
    export,
    fit,
    optimise,
    outputs,
    parts,
    segment,
    studio,
    texture,
)
from partwright.cli.interrupts import INTERRUPTED
from partwright.cli.parser import Parser
from partwright.cli.terminal import note
from partwright.errors import CancelledError, PartwrightError
from partwright.methods import check_seed

COMMANDS = (
    fit,
    clean,
    optimise,
    evaluate,
    describe,
    edit,
    export,
    collide,
    segment,
    parts,
    batch,
    texture,
    studio,
    completion,
)


def parser() -> Parser:
    result = Parser(prog="partwright", description="Turns a 3D shape into an editable assembly of parts.")
    result.add_argument("--version", action="version", version=f"partwright {__version__}")
    commands = result.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in COMMANDS:
        command.add(commands)
    return result


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0, 2 for errors, 130 after Ctrl-C."""
    commands = parser()
    if "_ARGCOMPLETE" in os.environ:  # set by the script of `partwright completion`
        import argcomplete

        argcomplete.autocomplete(commands)
    arguments = commands.parse_args(argv)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            outputs.check(arguments)
            if getattr(arguments, "seed", None) is not None:
                check_seed("--seed", arguments.seed)
            return _run(arguments)
    except (CancelledError, KeyboardInterrupt):
        note("interrupted; nothing was written")
        return INTERRUPTED
    except PartwrightError as error:
        note(f"error: {' '.join(str(error).split())}")
        return error.exit_code
    except BrokenPipeError:  # the reader of our output has gone; so has what Python would flush at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _run(arguments: argparse.Namespace) -> int:
    """Runs the command, whose module in `commands/` is imported only now, with all that it needs."""
    command = import_module(f"partwright.cli.commands.{arguments.run}")
    return int(command.run(arguments))


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    note(f"warning: {message}")
