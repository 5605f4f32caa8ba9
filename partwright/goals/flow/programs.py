"""OpenFOAM's programs: whether they are there, and one run with its log, its time limit and its failures."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from partwright.atomic_io import replacing
from partwright.errors import MissingDependencyError, OutputError, SimulationError, SimulationLimitError

MESHER, SNAPPER = ("blockMesh",), ("snappyHexMesh", "-overwrite")
SOLVER = ("simpleFoam",)
SAMPLER = ("postProcess", "-func", "sample", "-latestTime")
PROGRAMS = (MESHER, SNAPPER, SOLVER, SAMPLER)
_FULL = 1 << 20  # bytes: a disk with less left has stopped a program
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
        SimulationError: it failed, ran out of time or of disk; the message names the log.
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
                raise SimulationLimitError(f"{command[0]} did not end within the time limit", log) from error
            raise
    text = log.read_text(errors="replace")
    if code and shutil.disk_usage(folder).free < _FULL:
        raise SimulationLimitError(f"{command[0]} failed: the disk of {folder} is full", log)
    if code:
        crashed = "sigFpe::" in text  # of the stack; the log's head says that such errors are caught
        why = "it diverged" if crashed else f"it ended with {code}"
        raise SimulationError(f"{command[0]} failed ({why}) {_complaint(text)}".rstrip(), log)
    return text


def keep_log(error: SimulationError, place: Path | None) -> SimulationError:
    """The error of a case that is deleted: its log is copied to `place`, or is lost."""
    log = None
    if error.log is not None and place is not None:
        with suppress(OSError, OutputError):
            with replacing(place) as staging:
                shutil.copyfile(error.log, staging)
            log = place
    return type(error)(error.message, log)


def drop_log(place: Path | None) -> None:
    """Before another attempt: what an earlier one left at `place` is no log of it."""
    if place is not None:
        with suppress(OSError):
            place.unlink(missing_ok=True)


def _complaint(log: str) -> str:
    """What the program says of a fatal error, in one line; "" where it says nothing."""
    _, found, rest = log.partition("FOAM FATAL")
    lines = [line.strip() for line in rest.splitlines()[1:] if line.strip()] if found else []
    return " ".join(lines[:2])[:200]
