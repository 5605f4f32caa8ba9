"""Linear algebra on one thread, for as long as a fit runs.

Its matrices have some hundreds of rows, for which BLAS starts threads that wait for each other in a busy
loop: beside other work a solve of 285 rows takes forty times as long with two of them as with one. Which bits
come out may depend on their number, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from threading import Lock


class _Limit:
    """A limit of the whole process, that several fits may hold at once: the last lifts it."""

    def __init__(self) -> None:
        self._lock, self._holders, self._limiter = Lock(), 0, ExitStack()

    def take(self) -> None:
        from threadpoolctl import threadpool_limits

        with self._lock:
            if self._holders == 0:
                self._limiter.enter_context(threadpool_limits(limits=1, user_api="blas"))
            self._holders += 1

    def give_back(self) -> None:
        with self._lock:
            self._holders -= 1
            if self._holders == 0:
                self._limiter.close()


_LIMIT = _Limit()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within, BLAS runs on one thread everywhere in the process; afterwards on as many as before."""
    _LIMIT.take()
    try:
        yield
    finally:
        _LIMIT.give_back()
