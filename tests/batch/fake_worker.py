"""A worker that speaks the protocol and fits nothing: what a file's name says happens to it."""

from __future__ import annotations

import json
import os
import pickle
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from partwright.batch.worker import MADE, serve
from partwright.errors import EmptyShapeError
from partwright.methods import Cancellation

_SCORES = {"iou": 0.9, "bi_surface_iou": 0.8, "chamfer": 1e-4, "max_deviation_share": 0.01}


def answer(job: dict, say: Callable, cancel: Cancellation) -> dict:
    pickled = "pickled" in job
    path = Path(pickle.loads(Path(job["pickled"]).read_bytes())[0]) if pickled else Path(job["path"])
    with open(os.environ["FAKE_LOG"], "a") as log:
        log.write(f"{path.name}\n")
    if path.stem.startswith("hang"):
        time.sleep(600)
    if path.stem.startswith("segfault"):
        print("about to fall", file=sys.stderr, flush=True)
        os.kill(os.getpid(), signal.SIGSEGV)
    if path.stem.startswith("once") and Path(os.environ["FAKE_LOG"]).read_text().count(path.name) == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    if path.stem.startswith("big"):
        hoard = bytearray(b"x") * 200_000_000
        time.sleep(60)
        del hoard
    while path.stem.startswith("steps") and not cancel.requested:
        time.sleep(0.05)
        step = {"stage": "s", "round": 1, "rounds": 2, "parts": 3, "iou": 0.5, "fraction": 0.1}
        say({"progress": step})
    if path.stem.startswith("broken"):
        return {"error": "UnreadableFileError: no shape"}
    time.sleep(float(os.environ.get("FAKE_SECONDS", "0")))
    if pickled:
        made = EmptyShapeError(path.name)
        Path(job["pickled"]).with_suffix(MADE).write_bytes(pickle.dumps(made))
        return {"result": {}}
    folder = Path(job["folder"])
    folder.mkdir(parents=True)
    report = {"outcome": "converged", "parts": 2, "scores": _SCORES, "warnings": []}
    (folder / "assembly.json").write_bytes(path.read_bytes())
    (folder / "report.json").write_text(json.dumps(report))
    return {"result": report}


if __name__ == "__main__":
    import partwright.batch.worker as worker

    worker.answer = answer
    serve(sys.stdin, sys.stdout)
