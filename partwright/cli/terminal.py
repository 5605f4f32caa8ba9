"""What is printed: names come from files, so nothing in them may reach the terminal as a command to it."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TextIO

_LONGEST = 2000  # characters of one line


def printable(text: object) -> str:
    """`text` on one line, with all that a terminal would obey or could not show written as an escape."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in str(text))


def counted(number: int, noun: str) -> str:
    """`1 part`, `2 parts`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def say(text: object, to: TextIO | None = None) -> None:
    """One line on stdout, or `to`."""
    print(printable(text), file=to or sys.stdout, flush=True)


def note(text: str) -> None:
    """One line on stderr that says where it comes from, of a length that can be read."""
    line = printable(text)
    if len(line) > _LONGEST:
        line = f"{line[: _LONGEST // 2]} ... {line[-_LONGEST // 2 :]}"
    print(f"partwright: {line}", file=sys.stderr, flush=True)


def warn(messages: Iterable[str]) -> None:
    for message in messages:
        note(f"warning: {message}")
