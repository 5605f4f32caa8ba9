"""Worker processes that are killed past a limit: a hang or a crash takes one item, never the batch."""

from __future__ import annotations

import json
import math
import queue
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import psutil

from partwright.batch.worker import STOP
from partwright.errors import SettingError
from partwright.methods import Cancellation

if TYPE_CHECKING:
    from partwright.batch.on_ray import Cluster, RayWorker

_POLL = 0.1  # seconds between looks at a worker
_START = 60.0  # seconds that a process has to begin, which count for no item
_LAST_WORDS = 400  # characters of what a worker that died had written

Key = TypeVar("Key")


@dataclass(frozen=True)
class Limits:
    """Of one item."""

    seconds: float = 900.0
    memory: int = 8_000_000_000
    """Bytes of resident memory, of the worker and its children."""

    def __post_init__(self) -> None:
        if not (0 < self.seconds < math.inf and self.memory > 0):
            raise SettingError(
                f"limits of {self.seconds} s and {self.memory} bytes: expected numbers above 0"
            )


@dataclass(frozen=True)
class Answer:
    """What a worker said, or why it could not: status "done", "failed", "time", "memory" or "crashed"."""

    status: str
    reason: str
    result: dict[str, Any]
    seconds: float
    peak_memory: int


class Worker:
    """A process that does one job after another, and is replaced when it had to be killed."""

    command = (sys.executable, "-m", "partwright.batch.worker")

    def __init__(self, limits: Limits, cancel: Cancellation, gently: bool, given_up: threading.Event) -> None:
        self.limits, self._cancel, self._gently, self._given_up = limits, cancel, gently, given_up
        self._process: subprocess.Popen[str] | None = None

    def do(self, job: dict[str, Any], told: Callable[[dict[str, Any]], None]) -> Answer | None:
        """The answer; None where all was stopped meanwhile. `told` of progress, if the job asks for it.

        A job whose worker dies gets a second one: it may have been the machine, and not the shape.
        """
        answer = self._tried(job, told)
        crashed = answer is not None and answer.status == "crashed"
        return self._tried(job, told) if crashed and not self._cancel.requested else answer

    def _tried(self, job: dict[str, Any], told: Callable[[dict[str, Any]], None]) -> Answer | None:
        new = self._process is None or self._process.poll() is not None
        process = self._process = self._running()
        begun, peak, asked = time.monotonic() + (_START if new else 0.0), 0, False
        self._say(json.dumps(job) + "\n")
        while True:
            line = self._line()
            spent, now = max(time.monotonic() - begun, 0.0), _memory(process.pid)
            peak = max(peak, now)
            if line:
                said = json.loads(line)
                if "ready" in said:
                    begun = time.monotonic()
                elif "progress" in said:
                    told(said["progress"])
                else:
                    failed = said.get("error", "")
                    return Answer("failed" if failed else "done", failed, said.get("result", {}), spent, peak)
            if self._given_up.is_set() or (self._cancel.requested and not self._gently):
                self.close()
                return None
            if self._cancel.requested and not asked:
                self._say(STOP)
                asked = True
            status, reason = self._trouble(process, spent, now)
            if status:
                self.close()
                return Answer(status, reason, {}, spent, peak)

    def _say(self, line: str) -> None:
        assert self._process is not None
        assert self._process.stdin is not None
        with suppress(OSError):  # it died: the next look says so
            self._process.stdin.write(line)
            self._process.stdin.flush()

    def close(self) -> None:
        """Ends the process and its children at once."""
        if self._process is None:
            return
        with suppress(psutil.NoSuchProcess):
            for child in psutil.Process(self._process.pid).children(recursive=True):
                with suppress(psutil.NoSuchProcess):
                    child.kill()
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            with suppress(OSError):
                stream.close()
        self._words.close()
        self._process = None

    def _running(self) -> subprocess.Popen[str]:
        if self._process is not None and self._process.poll() is None:
            return self._process
        self.close()
        self._words = tempfile.TemporaryFile("w+", errors="replace")  # noqa: SIM115
        process = subprocess.Popen(
            self.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._words,
            text=True,
            start_new_session=True,  # Ctrl-C on the terminal is for the parent
        )
        lines: queue.Queue[str] = queue.Queue()
        threading.Thread(target=_read, args=(process, lines), daemon=True).start()
        self._lines = lines
        return process

    def _line(self) -> str:
        try:
            return self._lines.get(timeout=_POLL)
        except queue.Empty:
            return ""

    def _trouble(self, process: subprocess.Popen[str], spent: float, memory: int) -> tuple[str, str]:
        code = process.poll()
        if code is not None and self._lines.empty():
            self._words.seek(0)
            words = " ".join(self._words.read().split())[-_LAST_WORDS:]
            how = f"signal {-code}" if code < 0 else f"exit code {code}"
            return "crashed", f"the worker died by {how}" + (f": {words}" if words else "")
        if spent > self.limits.seconds:
            return "time", f"took more than {self.limits.seconds:g} s"
        if memory > self.limits.memory:
            return "memory", f"took more than {self.limits.memory / 1e9:.3g} GB"
        return "", ""


class Pool(Generic[Key]):
    """`at_once` workers, and jobs that are asked for only when one is free, so that none pile up.

    A cancellation kills what is running; gently, it lets that end with its best so far. The workers are of
    this machine, or of a cluster.
    """

    def __init__(
        self,
        at_once: int,
        limits: Limits,
        cancel: Cancellation,
        gently: bool = False,
        cluster: Cluster | None = None,
    ) -> None:
        self._cancel, self._given_up = cancel, threading.Event()
        self._workers = [
            cluster.worker(limits, cancel, self._given_up)
            if cluster
            else Worker(limits, cancel, gently, self._given_up)
            for _ in range(at_once)
        ]

    def run(
        self,
        jobs: Iterator[tuple[Key, dict[str, Any]]],
        done: Callable[[Key, Answer], None],
        told: Callable[[Key, dict[str, Any]], None] = lambda key, step: None,
    ) -> None:
        """Does all jobs; `done` is called in this thread, in the order of their ends, `told` in others."""
        idle = list(self._workers)
        running: dict[Future[Answer | None], tuple[Key, Worker | RayWorker]] = {}
        try:
            with ThreadPoolExecutor(len(idle)) as threads:
                try:
                    for key, job in jobs:
                        if self._cancel.requested:
                            break
                        worker = idle.pop()
                        running[threads.submit(worker.do, job, partial(told, key))] = key, worker
                        while running and not idle:
                            self._collect(running, idle, done)
                    while running:
                        self._collect(running, idle, done)
                except BaseException:
                    self._given_up.set()  # or the threads would wait for their jobs to end
                    raise
        finally:
            for worker in self._workers:
                worker.close()

    def _collect(
        self,
        running: dict[Future[Answer | None], tuple[Key, Worker | RayWorker]],
        idle: list[Worker | RayWorker],
        done: Callable[[Key, Answer], None],
    ) -> None:
        ended, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in ended:
            key, worker = running.pop(future)
            idle.append(worker)
            answer = future.result()
            if answer is not None:
                done(key, answer)


def _read(process: subprocess.Popen[str], lines: queue.Queue[str]) -> None:
    assert process.stdout is not None
    with suppress(ValueError, OSError):  # closed meanwhile
        for line in process.stdout:
            lines.put(line)


def _memory(pid: int) -> int:
    """Resident bytes of a process and its children; 0 when it has gone."""
    total = 0
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            with suppress(psutil.Error):
                total += one.memory_info().rss
    return total
