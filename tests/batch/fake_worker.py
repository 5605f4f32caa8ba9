"""A worker that speaks the protocol and fits nothing: what a file's name says happens to it."""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from pathlib import Path

from partwright.batch.worker import serve

_SCORES = {"iou": 0.9, "bi_surface_iou": 0.8, "chamfer": 1e-4, "max_deviation_share": 0.01}


def answer(job: dict) -> dict:
    path, folder = Path(job["path"]), Path(job["folder"])
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
        hoard = bytearray(b"x") * 600_000_000
        time.sleep(60)
        del hoard
    if path.stem.startswith("broken"):
        return {"error": "UnreadableFileError: no shape"}
    time.sleep(float(os.environ.get("FAKE_SECONDS", "0")))
    folder.mkdir(parents=True)
    report = {"outcome": "converged", "parts": 2, "scores": _SCORES, "warnings": []}
    (folder / "assembly.json").write_bytes(path.read_bytes())
    (folder / "report.json").write_text(json.dumps(report))
    return {"result": report}


if __name__ == "__main__":
    import partwright.batch.worker as worker

    worker.answer = answer
    serve(sys.stdin, sys.stdout)
