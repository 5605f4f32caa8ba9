"""Jobs that know nothing of one another, side by side on the threads that a fit may use.

NumPy, SciPy and the kernel let other threads work on while they compute. So jobs that ask them for much share
the cores, also where each asks for little at a time, or computes by itself in between.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from os import cpu_count
from typing import TypeVar

Made = TypeVar("Made")

_LEAST = 2  # threads that a job may use: the last that is left would else be alone on one
_ANY = 1 << 16
_here = threading.local()


def granted(threads: int) -> int:
    """How many threads are meant, 0 for as many as there are processors; within a job no more than its share
    of them."""
    return min(threads or cpu_count() or 1, getattr(_here, "most", _ANY))


def at_once(jobs: Sequence[Callable[[], Made]], threads: int) -> list[Made]:
    """What the jobs return, as they stand; on one thread they are done one after another, here.

    Which run at a time must not matter to what they return. What the first of them raises, this does, when
    those that had begun have ended.
    """
    many = granted(threads)
    workers = min(many, len(jobs))
    if workers <= 1:
        return [job() for job in jobs]
    with ThreadPoolExecutor(workers, "job", _begin, (max(_LEAST, -(-many // workers)),)) as pool:
        try:
            return [future.result() for future in [pool.submit(job) for job in jobs]]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def ahead(jobs: Sequence[Callable[[], Made]], threads: int) -> Iterator[Made]:
    """What the jobs return, one after another, for as long as it is asked for: as many are done at once as
    there are threads, so that some may be done in vain."""
    step = granted(threads)
    for first in range(0, len(jobs), step):
        yield from at_once(jobs[first : first + step], threads)


def _begin(most: int) -> None:
    _here.most = most
