"""`partwright`: reads the arguments, runs the command, and turns errors into one line and an exit code."""

from __future__ import annotations

import argparse
import os
import sys
import warnings
from collections.abc import Sequence
from typing import Any

from partwright import __version__
from partwright.cli import clean, describe, evaluate, export, fit, parts, segment
from partwright.errors import PartwrightError

COMMANDS = (fit, clean, evaluate, describe, export, segment, parts)
INTERRUPTED = 130


def parser() -> argparse.ArgumentParser:
    result = argparse.ArgumentParser(
        prog="partwright", description="Turns a 3D shape into an editable assembly of parts."
    )
    result.add_argument("--version", action="version", version=f"partwright {__version__}")
    commands = result.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for command in COMMANDS:
        command.add(commands)
    return result


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; returns the exit code: 0, 2 for errors, 130 after Ctrl-C."""
    arguments = parser().parse_args(argv)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _show_warning
            return arguments.run(arguments)
    except PartwrightError as error:
        print(f"partwright: error: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("partwright: interrupted; nothing was written", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone; so has what Python would flush at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _show_warning(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"partwright: warning: {message}", file=sys.stderr)
