"""Ctrl-C: heard at once by a thread of its own, whatever the main thread computes or imports.

An exception in the main thread is no way to end: libraries catch it while they are imported, and compiled
code does not see it until it returns. So nothing is raised. Outside of a run the process ends; in a run the
first Ctrl-C asks it to stop, and the second ends the process. Nothing that is half written stays.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

INTERRUPTED = 130
_ONE_PRESS = 0.25  # seconds within which signals are one: wrappers pass on what a terminal sent already
_stop: Callable[[], None] | None = None


def listen() -> None:
    """From now on this process hears Ctrl-C as the module says. Call it in the main thread, once.

    Where Ctrl-C is ignored, as in the background of a script, it stays so.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        return
    heard, tell = os.pipe()
    os.set_blocking(tell, False)
    signal.set_wakeup_fd(tell, warn_on_full_buffer=False)
    signal.signal(signal.SIGINT, _unheard)
    if hasattr(os, "register_at_fork"):
        os.register_at_fork(after_in_child=_forget)
    threading.Thread(target=_watch, args=(heard,), daemon=True, name="Ctrl-C").start()


@contextmanager
def stopping(stop: Callable[[], None]) -> Iterator[None]:
    """In the block the first Ctrl-C calls `stop`, from another thread, and says that it was heard."""
    global _stop
    _stop = stop
    try:
        yield
    finally:
        _stop = None


@contextmanager
def raising() -> Iterator[None]:
    """In the block Ctrl-C raises KeyboardInterrupt: for work that keeps what is done by catching it."""
    tell = signal.set_wakeup_fd(-1)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        signal.set_wakeup_fd(tell)


def _unheard(*_: object) -> None:
    """What the main thread does: nothing. A handler there must be, or no byte is written for the other."""


def _watch(heard: int) -> None:
    last = -_ONE_PRESS
    while data := os.read(heard, 64):
        if signal.SIGINT not in data or time.monotonic() - last < _ONE_PRESS:
            continue
        last = time.monotonic()
        _pressed()


def _pressed() -> None:
    global _stop
    stop, _stop = _stop, None
    if stop is None:
        _leave()
    else:
        _say("stopping after this step; Ctrl-C again to stop at once")
        stop()


def _leave() -> None:
    try:
        # Not imported, or not to its end: then nothing can have been written.
        abandon = getattr(sys.modules.get("partwright.atomic_io"), "abandon", None)
        written = abandon is not None and abandon()
        _say("interrupted" if written else "interrupted; nothing was written")
    finally:
        os._exit(INTERRUPTED)


def _say(text: str) -> None:
    """A line of its own, and a cursor that is seen: a bar may have hidden it."""
    fresh = "\r\x1b[2K\x1b[?25h" if os.isatty(2) else ""
    os.write(2, f"{fresh}partwright: {text}\n".encode())


def _forget() -> None:
    """In a forked process: its parent hears Ctrl-C, and it ends as any other."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
