"""What `partwright describe` does."""

from __future__ import annotations

import argparse

from partwright.assembly import load_assembly
from partwright.assembly.repeated_groups import parts_once
from partwright.cli.terminal import counted, say


def run(arguments: argparse.Namespace) -> int:
    assembly = load_assembly(arguments.assembly)
    for line in assembly.describe(max(1, min(arguments.digits, 17))).split("\n"):
        say(line)
    once, every = len(parts_once(assembly)), sum(len(part.copies) for part in assembly.parts)
    if every > once:
        say(f"{counted(once, 'part')}, {every} with every copy")
    return 0
