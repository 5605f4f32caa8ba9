"""What `partwright batch retry` does."""

from __future__ import annotations

import argparse

from partwright.batch.directory import Plan
from partwright.cli.commands.batch import go_on


def run(arguments: argparse.Namespace) -> int:
    return go_on(Plan.load(arguments.output), arguments, again=True, only_failed=arguments.failed)
