"""How a network beside a model is trained from a command, and written."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, TypeVar

from partwright.atomic_io import check_files
from partwright.cli.interrupts import INTERRUPTED, stopping
from partwright.cli.progress import Count
from partwright.cli.terminal import say, warn
from partwright.methods import Cancellation
from partwright.partsdf.companions import place_for
from partwright.partsdf.model import Model, load_model


class Companion(Protocol):
    """A trained network."""

    def save(self, path: str | Path) -> None:
        """Write it; raises OutputError."""


C = TypeVar("C", bound=Companion)


def how(arguments: argparse.Namespace) -> dict[str, Any]:
    """What `add_training` asks for, for the functions that train."""
    asked = {name: getattr(arguments, name) for name in ("steps", "seed", "device", "batch")}
    return {name: value for name, value in asked.items() if value is not None}


def train_beside(
    arguments: argparse.Namespace,
    kind: str,
    train: Callable[[Model, Count, Cancellation], C],
    about: Callable[[Model], str],
) -> int:
    """Load, train, write. about: what is said of the trained one."""
    model = load_model(arguments.model)
    output = place_for(model, kind, arguments.output)
    check_files([output])
    cancel = Cancellation()
    with Count("training") as count, stopping(cancel.request):
        made = train(model, count, cancel)
    made.save(output)
    say(f"{model.name}'s {kind}{about(model)} written to {output}")
    if cancel.requested:
        warn([f"interrupted: {output} has learned as far as it had come"])
        return INTERRUPTED
    return 0
