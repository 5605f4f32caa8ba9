"""STEP files by a process of their own: what ends OpenCASCADE, or keeps it for ever, is a named error."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

from partwright.errors import MissingDependencyError, PartwrightError, UnreadableFileError
from partwright.shapes.array_files import check_shape_file
from partwright.shapes.source import Source

STEP_SUFFIXES = (".step", ".stp")
_SECONDS, _SECONDS_A_BYTE = 60, 60e-6  # a large file takes some 10 seconds a megabyte
_MEMORY, _MEMORY_A_BYTE = (
    3 << 29,
    300,
)  # bytes of data beside the program itself; a large file takes about 100
_CHILD = "from partwright.shapes.step_process import answer; answer()"


def read_step(path: Path) -> Source:
    """Read a STEP file; each solid, or sheet where there is none, is a piece named after its product.

    Raises:
        MissingDependencyError: OpenCASCADE is not installed.
        UnreadableFileError: the file is missing, no STEP file, or more than OpenCASCADE can stand.
        EmptyShapeError: it holds no faces.
    """
    check_shape_file(path)
    if find_spec("OCP") is None:
        raise MissingDependencyError(
            f"{path}: STEP needs OpenCASCADE; install it with: pip install 'partwright[cad]'"
        )
    size = path.stat().st_size
    memory = int(_MEMORY + _MEMORY_A_BYTE * size)
    try:
        ended = subprocess.run(
            [sys.executable, "-c", _CHILD, str(path), str(memory)],
            capture_output=True,
            timeout=_SECONDS + _SECONDS_A_BYTE * size,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
    except subprocess.TimeoutExpired as error:
        raise UnreadableFileError(
            f"{path}: OpenCASCADE came to no end with it; the file is damaged. Export it again"
        ) from error
    try:
        answered = pickle.loads(ended.stdout)
    except (EOFError, pickle.UnpicklingError) as error:
        raise UnreadableFileError(
            f"{path}: OpenCASCADE broke down over it; references in the file are wrong, or it takes more "
            f"than {memory >> 20} MB. Export it again, or as STL"
        ) from error
    if isinstance(answered, PartwrightError):
        raise answered
    assert isinstance(answered, Source)
    return answered


def answer() -> None:
    """What the child does: a Source or a named error, pickled, on standard output."""
    from partwright.shapes.step import source_of_step

    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)  # what OpenCASCADE prints itself
        _limit_memory(int(sys.argv[2]))
        try:
            result: Source | PartwrightError = source_of_step(Path(sys.argv[1]))
        except PartwrightError as error:
            result = error
        pickle.dump(result, output)


def _limit_memory(count: int) -> None:
    """Bytes of data that this process may have, where the system can be told so."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_DATA, (count, count))
