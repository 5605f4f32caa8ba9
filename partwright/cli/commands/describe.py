"""What `partwright describe` does."""

from __future__ import annotations

import argparse

from partwright.assembly import load_assembly
from partwright.cli.terminal import say


def run(arguments: argparse.Namespace) -> int:
    for line in load_assembly(arguments.assembly).describe(max(1, min(arguments.digits, 17))).split("\n"):
        say(line)
    return 0
