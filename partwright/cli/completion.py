"""`partwright completion`: a script by which a shell completes commands, options and files."""

from __future__ import annotations

import argparse

SHELLS = ("bash", "zsh", "fish", "tcsh", "powershell")


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "completion",
        help="print a script for completion in a shell",
        description='Prints a script that completes commands, options and files. For this shell: eval "$('
        'partwright completion bash)"; for every new one, the same line in ~/.bashrc.',
    )
    command.add_argument("shell", choices=SHELLS, metavar="SHELL", help=", ".join(SHELLS))
    command.set_defaults(run="completion")
