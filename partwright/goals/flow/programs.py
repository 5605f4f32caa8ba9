"""OpenFOAM's programs: whether they are there, and one run with its log, its time limit and its failures."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Sequence
from pathlib import Path

from partwright.errors import MissingDependencyError, SimulationError

MESHER, SNAPPER = ("blockMesh",), ("snappyHexMesh", "-overwrite")
SOLVER = ("simpleFoam",)
SAMPLER = ("postProcess", "-func", "sample", "-latestTime")
PROGRAMS = (MESHER, SNAPPER, SOLVER, SAMPLER)
_HOME = "/usr/share/openfoam"  # of Debian's package, which sets no environment


def check_installed() -> None:
    """Raises MissingDependencyError unless OpenFOAM's programs are found."""
    missing = [command[0] for command in PROGRAMS if shutil.which(command[0]) is None]
    if missing:
        raise MissingDependencyError(
            f"OpenFOAM is needed to simulate a flow, and {', '.join(missing)} cannot be found: "
            "apt-get install openfoam (Debian, Ubuntu), or source the bashrc of your installation first"
        )


def run(command: Sequence[str], folder: Path, seconds: float) -> str:
    """Run a command in the case's folder; its log, which is also written there.

    Raises:
        SimulationError: it failed, or did not end within the time limit; the message names the log.
    """
    log = folder / f"log.{command[0]}"
    environment = {"WM_PROJECT_DIR": _HOME, **os.environ} if Path(_HOME).is_dir() else dict(os.environ)
    with log.open("wb") as out:
        process = subprocess.Popen(
            command, cwd=folder, stdout=out, stderr=subprocess.STDOUT, env=environment, start_new_session=True
        )
        try:
            code = process.wait(max(seconds, 0.1))
        except BaseException as error:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
            if isinstance(error, subprocess.TimeoutExpired):
                raise SimulationError(f"{command[0]} did not end within the time limit: see {log}") from error
            raise
    text = log.read_text(errors="replace")
    if code:
        crashed = "sigFpe::" in text  # of the stack; the log's head says that such errors are caught
        why = "it diverged" if crashed else f"it ended with {code}"
        raise SimulationError(f"{command[0]} failed ({why}): {_complaint(text)} See {log}")
    return text


def _complaint(log: str) -> str:
    """What the program says of a fatal error, in one line; "" where it says nothing."""
    _, found, rest = log.partition("FOAM FATAL")
    lines = [line.strip() for line in rest.splitlines()[1:] if line.strip()] if found else []
    return " ".join(lines[:2])[:200]
