"""Worker processes that are killed past a limit: a hang or a crash takes one item, never the batch."""

from __future__ import annotations

import json
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
from typing import Any, Generic, TypeVar

import psutil

from partwright.methods import Cancellation

_POLL = 0.1  # seconds between looks at a worker
_LAST_WORDS = 400  # characters of what a worker that died had written

Key = TypeVar("Key")


@dataclass(frozen=True)
class Limits:
    """Of one item."""

    seconds: float
    memory: int
    """Bytes of resident memory, of the worker and its children."""


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

    def __init__(self, limits: Limits, cancel: Cancellation) -> None:
        self._limits, self._cancel = limits, cancel
        self._process: subprocess.Popen[str] | None = None

    def do(self, job: dict[str, Any]) -> Answer | None:
        """The answer; None where all was stopped meanwhile.

        A job whose worker dies gets a second one: it may have been the machine, and not the shape.
        """
        answer = self._tried(job)
        return self._tried(job) if answer is not None and answer.status == "crashed" else answer

    def _tried(self, job: dict[str, Any]) -> Answer | None:
        process = self._process = self._running()
        assert process.stdin is not None
        begun, peak = time.monotonic(), 0
        with suppress(OSError):  # it died: the next look says so
            process.stdin.write(json.dumps(job) + "\n")
            process.stdin.flush()
        while True:
            line = self._line()
            spent, now = time.monotonic() - begun, _memory(process.pid)
            peak = max(peak, now)
            if line:
                said = json.loads(line)
                failed = said.get("error", "")
                return Answer("failed" if failed else "done", failed, said.get("result", {}), spent, peak)
            if self._cancel.requested:
                self.close()
                return None
            status, reason = self._trouble(process, spent, now)
            if status:
                self.close()
                return Answer(status, reason, {}, spent, peak)

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
        if spent > self._limits.seconds:
            return "time", f"took more than {self._limits.seconds:g} s"
        if memory > self._limits.memory:
            return "memory", f"took more than {self._limits.memory / 1e9:.3g} GB"
        return "", ""


class Pool(Generic[Key]):
    """`at_once` workers, and jobs that are asked for only when one is free, so that none pile up."""

    def __init__(self, at_once: int, limits: Limits, cancel: Cancellation) -> None:
        self._at_once, self._limits, self._cancel = at_once, limits, cancel

    def run(self, jobs: Iterator[tuple[Key, dict[str, Any]]], done: Callable[[Key, Answer], None]) -> None:
        """Does all jobs; `done` is called in this thread, in the order in which they end."""
        idle = [Worker(self._limits, self._cancel) for _ in range(self._at_once)]
        workers, running = list(idle), dict[Future[Answer | None], tuple[Key, Worker]]()
        try:
            with ThreadPoolExecutor(self._at_once) as threads:
                try:
                    for key, job in jobs:
                        worker = idle.pop()
                        running[threads.submit(worker.do, job)] = key, worker
                        while running and not idle:
                            self._collect(running, idle, done)
                        if self._cancel.requested:
                            break
                    while running:
                        self._collect(running, idle, done)
                except BaseException:
                    self._cancel.request()  # or the threads would wait for their jobs to end
                    raise
        finally:
            for worker in workers:
                worker.close()

    def _collect(
        self,
        running: dict[Future[Answer | None], tuple[Key, Worker]],
        idle: list[Worker],
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
