"""Keys of a part's metadata that pictures and lists know."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count, takewhile

GUESSED = "guessed"  # of a part that the input does not show: why it is there
# Of a part that stands for a screw thread: its name; what else is said of it goes on from there.
THREAD = "thread"


def thread_key(number: int) -> str:
    """Of the first, second, ... thread of a part, as a stud has at either end."""
    return THREAD if number == 1 else f"{THREAD}_{number}"


def thread_names(metadata: Mapping[str, object]) -> list[str]:
    """Of the threads of a part, in order."""
    keys = takewhile(metadata.__contains__, map(thread_key, count(1)))
    return [str(metadata[key]) for key in keys]
