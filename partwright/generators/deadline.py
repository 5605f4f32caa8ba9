"""How long a generator may take, and whether somebody wants it to end."""

from __future__ import annotations

import time
from collections.abc import Callable

from partwright.errors import CancelledError, GeneratorError
from partwright.methods import Cancellation

POLL = 0.05  # seconds between two looks


class Deadline:
    """Begins when it is made; `waited` is told the seconds since then at every look."""

    def __init__(
        self, seconds: float, cancel: Cancellation, waited: Callable[[float], None] | None = None
    ) -> None:
        self.seconds, self._cancel, self._waited = seconds, cancel, waited
        self._start = time.monotonic()

    def check(self, name: str) -> None:
        """Whether to go on waiting for the generator of this name.

        Raises:
            CancelledError: it was cancelled.
            GeneratorError: the time is over.
        """
        if self._cancel.requested:
            raise CancelledError(f"cancelled while {name} was at work")
        seconds = time.monotonic() - self._start
        if self._waited is not None:
            self._waited(seconds)
        if seconds > self.seconds:
            raise GeneratorError(
                f"{name} was not done after {self.seconds:g} s and was ended; "
                "give it longer with --via-timeout, or look at what it does by itself"
            )
