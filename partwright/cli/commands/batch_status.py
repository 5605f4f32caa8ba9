"""What `partwright batch status` does."""

from __future__ import annotations

import argparse

from partwright.batch.directory import Plan
from partwright.batch.index import summary
from partwright.batch.items import items_of
from partwright.batch.manifest import DONE, latest
from partwright.cli.terminal import say

_SHOWN = 20  # failures


def run(arguments: argparse.Namespace) -> int:
    plan = Plan.load(arguments.output)
    found = latest(arguments.output)
    say(summary(found))
    if plan.source.is_dir():
        names = {item.name for item in items_of(plan.source, arguments.output)}
        say(f"{len(names - found.keys())} of {len(names)} shapes in {plan.source} not yet begun or in flight")
    else:
        say(f"{plan.source} is not there any more")
    failed = sorted((e for e in found.values() if e.status != DONE), key=lambda entry: entry.file)
    for entry in failed[:_SHOWN]:
        say(f"{entry.file}: {entry.status}: {entry.reason}")
    if len(failed) > _SHOWN:
        say(f"and {len(failed) - _SHOWN} more, all of them in index.csv")
    return 0
