"""Workers on the nodes of a Ray cluster: each job is a task, done by a worker process within limits.

Tasks rather than Ray Data, which has no limit for one item. The folder with the shapes and the one that is
written to lie on a disk that all nodes share, at the same path, and all nodes have Partwright.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from partwright.batch.pool import Answer, Limits, Worker
from partwright.errors import MissingDependencyError, OutputError
from partwright.methods import Cancellation

_TRIES = 3  # of an item whose node dies
_POLL = 0.2  # seconds between looks at a task
_here: Worker | None = None
"""Of this process, which Ray uses for one task after another."""


class Cluster:
    """A connection to Ray, which ends with the block."""

    def __init__(self, address: str, threads: int = 1) -> None:
        """Raises MissingDependencyError without Ray, and OutputError where no cluster answers."""
        try:
            import ray
        except ImportError as error:
            raise MissingDependencyError('--ray needs Ray: pip install "partwright[ray]"') from error
        self._ray = ray
        try:
            ray.init(address=address, log_to_driver=False, logging_level="ERROR")
        except (ConnectionError, ValueError, RuntimeError, OSError) as error:
            raise OutputError(f"--ray {address}: no cluster answers there ({error})") from error
        # An item whose task dies is given out again here, where it is counted.
        self._task = ray.remote(num_cpus=threads, max_retries=0)(done_here)

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        self._ray.shutdown()

    @property
    def cores(self) -> int:
        """Of all nodes."""
        return max(1, int(self._ray.cluster_resources().get("CPU", 1)))

    def worker(self, limits: Limits, cancel: Cancellation, given_up: threading.Event) -> RayWorker:
        """One of the pool's."""
        return RayWorker(self._ray, self._task, limits, cancel, given_up)


class RayWorker:
    """Does one job after another, wherever there is room; to the pool it is like a `Worker`."""

    def __init__(
        self, ray: Any, task: Any, limits: Limits, cancel: Cancellation, given_up: threading.Event
    ) -> None:
        self._ray, self._task, self._limits = ray, task, limits
        self._cancel, self._given_up = cancel, given_up

    def do(self, job: dict[str, Any], told: Callable[[dict[str, Any]], None]) -> Answer | None:
        """The answer; None where all was stopped meanwhile. What a lost node was at goes to another."""
        reason = ""
        for _ in range(_TRIES):
            running = self._task.remote(job, self._limits)
            while not self._ray.wait([running], timeout=_POLL)[0]:
                if self._cancel.requested or self._given_up.is_set():
                    self._ray.cancel(running, force=True)
                    return None
            try:
                answer: Answer = self._ray.get(running)
                return answer
            except self._ray.exceptions.RayError as error:
                reason = " ".join(str(error).split())[:400]
        return Answer("crashed", f"its node was lost {_TRIES} times: {reason}", {}, 0.0, 0)

    def close(self) -> None:
        """Nothing is open here: a task that is given up is cancelled."""


def done_here(job: dict[str, Any], limits: Limits) -> Answer | None:
    """A task: the job by a worker process of this node, which stays for the next one."""
    global _here
    if _here is None:
        _here = Worker(limits, Cancellation(), False, threading.Event())
    _here.limits = limits
    return _here.do(job, lambda step: None)
