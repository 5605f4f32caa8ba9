"""Orders that processes of their own carry out: begun anew, and deaf to Ctrl-C, which who began them hears.
They end with it, however it ends.

A script that has orders carried out so, by more than one process, needs `if __name__ == "__main__":`.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.util import Finalize
from typing import Any, TypeVar

from partwright.errors import SettingError

Order = TypeVar("Order")
Made = TypeVar("Made")

_work: list[Callable[[Any], Any]] = []  # of a process


def one_a_processor(workers: int | None) -> int:
    """How many workers are meant: as many as are given, or None for as many as there are processors.

    Raises SettingError for none.
    """
    if workers is not None and workers < 1:
        raise SettingError(f"workers: expected a whole number of at least 1, got {workers}")
    return workers or os.cpu_count() or 1


def carried_out(
    work: Callable[[Order], Made], orders: Sequence[Order], workers: int, at_once: int = 1
) -> Generator[Made, None, None]:
    """What `work` makes of each order, as the orders stand; here, where one worker is enough.

    work: is sent to each process once, with all that is bound to it. at_once: orders that a process takes.
    Close the iterator to end early.

    Raises SettingError where a process is ended from outside, as for want of memory.
    """
    workers = min(workers, -(-len(orders) // at_once))
    if workers <= 1:
        yield from map(work, orders)
        return
    _begin_tracker()
    with ProcessPoolExecutor(workers, get_context("spawn"), _remember, (work,)) as pool:
        try:
            with _deaf():  # while they begin: they are as deaf as the thread that begins them
                made = pool.map(_remembered, orders, chunksize=at_once)
            yield from made
        except BrokenProcessPool as error:
            raise SettingError(
                f"one of {workers} processes was ended, perhaps for want of memory; take fewer workers"
            ) from error
        finally:
            pool.shutdown(cancel_futures=True)


def _begin_tracker() -> None:
    """multiprocessing's process that clears away what others leave, where there is one, told not to warn of
    it: to end at once is how Ctrl-C ends a command."""
    if os.name != "posix":
        return
    quiet = "ignore:resource_tracker:UserWarning"
    sys.warnoptions.append(quiet)  # it begins with these
    try:
        resource_tracker.ensure_running()
    finally:
        sys.warnoptions.remove(quiet)


def end_with_parent() -> None:
    """From now on this process, which another one began, ends with it, in the middle of its work if need be:
    who hears Ctrl-C ends at once and cannot ask."""
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True, name="parent").start()


def _remember(work: Callable[[Any], Any]) -> None:
    end_with_parent()
    _work[:] = [work]
    # What compiled code made is to go before that does.
    Finalize(None, _work.clear, exitpriority=0)


def _remembered(order: Any) -> Any:
    return _work[0](order)


@contextmanager
def _deaf() -> Iterator[None]:
    """Ctrl-C waits; nothing where a system has no such masks."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
