"""Independent pieces of work side by side, in threads of this process that share its cores.

Half of what a search does is none of the compiled kernel's, which has threads of its own: there several
tries at a time are what uses the cores. Results and failures are those of one after another.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from dataclasses import dataclass
from threading import Lock
from typing import Any, Generic, TypeVar

Result = TypeVar("Result")
Other = TypeVar("Other")
Job = Callable[[], Result]

_MOST = 64  # threads, whatever the number of cores
_AHEAD = 4  # jobs whose results may turn out not to be wanted


def thread_count(threads: int) -> int:
    """How many are meant: 0 is one a core."""
    return threads or os.cpu_count() or 1


@dataclass(frozen=True)
class _Limit:
    share: int


class _Jobs(Generic[Result]):
    """Jobs that threads take one after another, and what came of them."""

    def __init__(self, jobs: Sequence[Job[Result]], threads: int) -> None:
        self.jobs, self.threads = jobs, threads
        self.left = len(jobs)  # that have not ended
        self.results: dict[int, Result] = {}
        self.failures: dict[int, BaseException] = {}
        self._next, self._lock = 1, Lock()

    def take(self) -> None:
        """Does jobs until none is left, or one has failed."""
        while True:
            with self._lock:
                index = self._next
                if index == len(self.jobs) or self.failures:
                    return
                self._next += 1
            self.do(index)

    def do(self, index: int) -> None:
        try:
            self.results[index] = copy_context().run(self._one, self.jobs[index])
        except BaseException as failure:
            self.failures[index] = failure
        with self._lock:
            self.left -= 1

    def _one(self, job: Job[Result]) -> Result:
        _sharing.set(self)
        return job()

    @property
    def share(self) -> int:
        """Of the threads, that each job which is under way may use now."""
        return max(1, -(-self.threads // max(self.left, 1)))


_sharing: ContextVar[_Jobs[Any] | _Limit | None] = ContextVar("what the caller is one of", default=None)
_pool: ThreadPoolExecutor | None = None
_pool_lock = Lock()


def share_of(threads: int) -> int:
    """Threads (0: one a core) that a call may use here: of several jobs at once each has a share."""
    sharing = _sharing.get()
    return threads if sharing is None else min(thread_count(threads), sharing.share)


@contextmanager
def limited(threads: int) -> Iterator[None]:
    """No call in this context uses more threads (0: one a core), whatever it asks for."""
    before = _sharing.set(_Limit(thread_count(share_of(threads))))
    try:
        yield
    finally:
        _sharing.reset(before)


def at_once(jobs: Iterable[Job[Result]], threads: int) -> list[Result]:
    """What the jobs return, in their order. On one thread they run one after another.

    A job may have jobs of its own: who waits for them does what no other thread is at. The first one is done
    in this thread.

    threads: at most, 0 for one a core.
    """
    jobs = list(jobs)
    threads = min(thread_count(share_of(threads)), _MOST)
    helpers = min(threads, len(jobs)) - 1
    if helpers <= 0:
        return [job() for job in jobs]
    shared = _Jobs(jobs, threads)
    others: list[Future[None]] = [_threads().submit(copy_context().run, shared.take) for _ in range(helpers)]
    shared.do(0)
    shared.take()
    for other in others:
        if not other.cancel():
            other.result()
    if shared.failures:
        raise shared.failures[min(shared.failures)]
    return [shared.results[index] for index in range(len(jobs))]


def both(one: Job[Result], other: Job[Other], threads: int) -> tuple[Result, Other]:
    """What the two return, as `at_once` does."""
    jobs: list[Job[Any]] = [one, other]
    first, second = at_once(jobs, threads)
    return first, second


def in_turn(jobs: Iterable[Job[Result]], threads: int) -> Iterator[Result]:
    """What the jobs return, one after another, for who may need no more after any: other threads work ahead.

    threads: at most, 0 for one a core.
    """
    jobs = list(jobs)
    ahead = min(thread_count(share_of(threads)), _AHEAD)
    for first in range(0, len(jobs), ahead):
        yield from at_once(jobs[first : first + ahead], threads)


def _threads() -> ThreadPoolExecutor:
    global _pool
    with _pool_lock:
        if _pool is None:
            _pool = ThreadPoolExecutor(_MOST, thread_name_prefix="at once")
        return _pool


def _forget() -> None:
    """In a forked process, which has none of the threads."""
    global _pool, _pool_lock
    _pool, _pool_lock = None, Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget)
