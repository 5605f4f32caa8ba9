"""How long a generator may take, and whether somebody wants it to end."""

from __future__ import annotations

import time

from partwright.errors import CancelledError, GeneratorError
from partwright.methods import Cancellation

POLL = 0.05  # seconds between two looks


class Deadline:
    """Begins when it is made."""

    def __init__(self, seconds: float, cancel: Cancellation) -> None:
        self.seconds, self._cancel = seconds, cancel
        self._end = time.monotonic() + seconds

    def check(self, name: str) -> None:
        """Whether to go on waiting for the generator of this name.

        Raises:
            CancelledError: it was cancelled.
            GeneratorError: the time is over.
        """
        if self._cancel.requested:
            raise CancelledError(f"cancelled while {name} was at work")
        if time.monotonic() > self._end:
            raise GeneratorError(
                f"{name} was not done after {self.seconds:g} s and was ended; "
                "give it longer with --via-timeout, or look at what it does by itself"
            )
