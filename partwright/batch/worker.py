"""A worker process: jobs come in as lines of JSON, what became of them goes out the same way.

Started by `pool.Worker` as `python -m partwright.batch.worker`. It ends when its input does, so no worker
outlives the process that asked for it, however that one died.
"""

from __future__ import annotations

import json
import os
import pickle
import queue
import sys
import threading
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import IO, Any

from partwright.methods import Cancellation, Progress

STOP = "stop\n"
"""Instead of a job: end the running one with its best so far."""
MADE = ".made"
"""Suffix of the file with what came of pickled arguments."""


def serve(jobs: IO[str], answers: IO[str]) -> None:
    """Answers each job until the input ends; then the process ends, whatever it is at."""
    waiting: queue.Queue[str] = queue.Queue()
    cancel = Cancellation()

    def listen() -> None:
        for line in jobs:
            if line == STOP:
                cancel.request()
            else:
                waiting.put(line)
        os._exit(0)

    def say(what: dict[str, Any]) -> None:
        answers.write(json.dumps(what, default=float) + "\n")
        answers.flush()

    threading.Thread(target=listen, daemon=True).start()
    say({"ready": True})
    while True:
        say(answer(json.loads(waiting.get()), say, cancel))


def answer(
    job: dict[str, Any], say: Callable[[dict[str, Any]], None], cancel: Cancellation
) -> dict[str, Any]:
    """What a job comes to: of a file that becomes a folder, or of pickled arguments (`fit_many`)."""
    return _pickled(job, say, cancel) if "pickled" in job else _file(job)


def _file(job: dict[str, Any]) -> dict[str, Any]:
    """The job's result, saved in its folder; or the error, in a line."""
    from partwright.errors import PartwrightError
    from partwright.fitting import fit
    from partwright.shapes import load_shape

    try:
        shape = load_shape(job["path"], job["unit"], job["up"], job["thickness"])
        result = fit(shape, job["method"], **job["options"])
        result.save(Path(job["folder"]))
    except (PartwrightError, MemoryError) as error:
        return {"error": " ".join(f"{type(error).__name__}: {error}".split())}
    kept = ("outcome", "parts", "scores", "warnings")
    return {"result": {name: result.report[name] for name in kept}}


def _pickled(
    job: dict[str, Any], say: Callable[[dict[str, Any]], None], cancel: Cancellation
) -> dict[str, Any]:
    """The result, or the named error, into a file beside the arguments."""
    from partwright.errors import PartwrightError
    from partwright.fitting import Result, fit
    from partwright.shapes import Shape, load_shape

    path = Path(job["pickled"])
    shape, options = pickle.loads(path.read_bytes())
    told = (lambda step: say({"progress": numbers_of(step)})) if job["progress"] else None
    made: Result | PartwrightError
    try:
        known = isinstance(shape, Shape)
        result = fit(shape if known else load_shape(shape), progress=told, cancel=cancel, **options)
        result.surface._cache.clear()  # adjacencies and trees: several times the surface
        made = replace(result, shape=None) if known else result  # type: ignore[arg-type]
    except PartwrightError as error:
        made = error.with_traceback(None)
    path.with_suffix(MADE).write_bytes(pickle.dumps(made))
    return {"result": {}}


def numbers_of(step: Progress) -> dict[str, Any]:
    """All of it but the assembly, which is not made before somebody asks."""
    return {one.name: getattr(step, one.name) for one in fields(step) if one.name != "best"}


def main() -> None:
    """Libraries may print: answers have a channel of their own."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    import partwright.fitting  # noqa: F401  what takes long to begin counts for no item

    serve(sys.stdin, answers)


if __name__ == "__main__":
    main()
