"""A worker process: jobs come in as lines of JSON, what became of them goes out the same way.

Started by `pool.Worker` as `python -m partwright.batch.worker`. It ends when its input does, so no worker
outlives the process that asked for it, however that one died.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
from pathlib import Path
from typing import IO, Any


def serve(jobs: IO[str], answers: IO[str]) -> None:
    """Answers each job until the input ends; then the process ends, whatever it is at."""
    waiting: queue.Queue[str] = queue.Queue()

    def listen() -> None:
        for line in jobs:
            waiting.put(line)
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        answers.write(json.dumps(answer(json.loads(waiting.get()))) + "\n")
        answers.flush()


def answer(job: dict[str, Any]) -> dict[str, Any]:
    """The job's result, saved in its folder; or the error, in a line."""
    from partwright.errors import PartwrightError
    from partwright.fitting import fit
    from partwright.shapes import load_shape

    try:
        shape = load_shape(job["path"], unit=job["unit"], up=job["up"])
        result = fit(shape, job["method"], **job["options"])
        result.save(Path(job["folder"]))
    except (PartwrightError, MemoryError) as error:
        return {"error": " ".join(f"{type(error).__name__}: {error}".split())}
    kept = ("outcome", "parts", "scores", "warnings")
    return {"result": {name: result.report[name] for name in kept}}


def main() -> None:
    """Libraries may print: answers have a channel of their own."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    serve(sys.stdin, answers)


if __name__ == "__main__":
    main()
