"""CADFit as a program of its own: what it makes of a mesh, for benchmarks/rivals.py.

CADFit (Nehme et al. 2026) is under CC BY-NC 4.0, for research, with a patent filed: it is run, and nothing of
it is here. A checkout and a Python of its own with its requirements are needed; its trained filter of loops,
whose weights come from a hub, is off by default and stays so.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
from dataclasses import dataclass
from pathlib import Path

import trimesh

_RESULT = "best_greedy_parallel_iterative.py"
_FACES = """
import sys
lines = [line for line in open(sys.argv[1]) if "export" not in line.lower() and not line.startswith("print")]
names = {}
exec("".join(lines), names)
whole = names["final_result"] if "final_result" in names else names["result"]
solids = whole.vals()
print(sum(len(solid.Faces()) for solid in solids), all(solid.isValid() for solid in solids))
"""


@dataclass(frozen=True)
class Cadfit:
    """faces: of the solid that its program makes; None where there is none. iou: its own measure. seconds: of
    the processor, all of its processes."""

    faces: int | None
    valid: bool
    iou: float | None
    seconds: float

    @property
    def cells(self) -> list[str]:
        """Faces, valid, IoU and seconds, as a table shows them."""
        if self.faces is None or self.iou is None:
            return ["none", "no", "", f"{self.seconds:.0f}"]
        return [str(self.faces), "yes" if self.valid else "no", f"{self.iou:.4f}", f"{self.seconds:.0f}"]


def cadfit(mesh: trimesh.Trimesh, folder: Path, program: Path, python: Path, limit: float) -> Cadfit:
    """One part, by one process at a time. program: a checkout. limit: wall seconds."""
    given, out = folder / "cadfit", folder / "cadfit_out"
    given.mkdir()
    mesh.export(given / "part.stl")
    before = _processor()
    command = [python, program / "run_pipeline.py", given, "--output-folder", out]
    once = os.environ | {"CADFIT_INNER_WORKERS": "1", "OMP_NUM_THREADS": "1"}
    quiet = subprocess.DEVNULL
    with subprocess.Popen(
        command, cwd=folder, env=once, stdout=quiet, stderr=quiet, start_new_session=True
    ) as run:
        try:
            run.wait(limit)
        except subprocess.TimeoutExpired:
            os.killpg(run.pid, signal.SIGKILL)
    seconds = _processor() - before
    script, scores = out / "part" / _RESULT, out / "part" / "final_iou.json"
    if not script.exists() or not scores.exists():
        return Cadfit(None, False, None, seconds)
    told = subprocess.run(
        [python, "-c", _FACES, script], cwd=folder, capture_output=True, text=True, check=False
    )
    if told.returncode:
        return Cadfit(None, False, None, seconds)
    faces, valid = told.stdout.split()[-2:]
    return Cadfit(int(faces), valid == "True", json.loads(scores.read_text())["final_iou"], seconds)


def _processor() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
