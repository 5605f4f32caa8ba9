"""What `partwright batch run` does."""

from __future__ import annotations

import argparse
import math
import re

from partwright.batch.directory import Plan, Share, fit_folder
from partwright.batch.index import summary, write_index
from partwright.batch.manifest import DONE, Entry
from partwright.batch.pool import Limits
from partwright.cli.commands.fit import given_settings
from partwright.cli.interrupts import INTERRUPTED, stopping
from partwright.cli.progress import Count
from partwright.cli.terminal import note, say
from partwright.errors import SettingError
from partwright.methods import Cancellation


def run(arguments: argparse.Namespace) -> int:
    options = {"quality": arguments.quality, "seed": arguments.seed, "device": arguments.device}
    plan = Plan(
        arguments.folder,
        arguments.method,
        options | given_settings(arguments),
        arguments.unit,
        arguments.up,
        arguments.thickness,
    )
    return go_on(plan, arguments)


def go_on(plan: Plan, arguments: argparse.Namespace, again: bool = False, only_failed: bool = False) -> int:
    """Runs the plan's share, and says what came of it."""
    share = share_of(arguments, again, only_failed)
    limits = limits_of(arguments)
    cancel = Cancellation()
    ended = 0
    with Count("fitted") as count, stopping(cancel.request):

        def told(entry: Entry, found: int) -> None:
            nonlocal ended
            ended += 1
            count.show(ended, max(found, ended), entry.file)
            if entry.status != DONE:
                note(f"{entry.file}: {entry.reason}")

        whole = fit_folder(
            plan, arguments.output, share, arguments.at_once, limits, told, cancel, arguments.ray
        )
    found = write_index(arguments.output)
    say(f"{summary(found)}; look at {arguments.output / 'index.html'}")
    if not whole:
        note("interrupted; the same command goes on")
        return INTERRUPTED
    return 0


def share_of(arguments: argparse.Namespace, again: bool = False, only_failed: bool = False) -> Share:
    """Raises SettingError where --shard or --limit cannot be used."""
    numbers = re.fullmatch(r"(\d{1,9})/(\d{1,9})", arguments.shard)
    if numbers is None:
        raise SettingError(f"--shard {arguments.shard}: expected I/N, such as 3/8")
    return Share(int(numbers[1]), int(numbers[2]), arguments.limit, again, only_failed)


def limits_of(arguments: argparse.Namespace) -> Limits:
    """Raises SettingError where a limit is no positive number."""
    for name, value in (("--time-limit", arguments.time_limit), ("--memory-limit", arguments.memory_limit)):
        if not (math.isfinite(value) and value > 0):
            raise SettingError(f"{name} {value:g}: expected a number above 0")
    return Limits(arguments.time_limit, int(1e9 * arguments.memory_limit))
