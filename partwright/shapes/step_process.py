"""STEP files by a process of their own: what ends OpenCASCADE, or keeps it for ever, is a named error."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import zipfile
from dataclasses import fields
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from partwright import errors
from partwright.errors import MissingDependencyError, PartwrightError, UnreadableFileError
from partwright.shapes.array_files import check_shape_file
from partwright.shapes.source import Piece, Source

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
        answered = _unpacked(ended.stdout)
    except (EOFError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise UnreadableFileError(
            f"{path}: OpenCASCADE broke down over it; references in the file are wrong, or it takes more "
            f"than {memory >> 20} MB. Export it again, or as STL"
        ) from error
    if isinstance(answered, PartwrightError):
        raise answered
    return answered


def answer() -> None:
    """What the child does: a Source or a named error on standard output."""
    from partwright.shapes.step import source_of_step

    with os.fdopen(os.dup(1), "wb") as output:
        os.dup2(2, 1)  # what OpenCASCADE prints itself
        _limit_memory(int(sys.argv[2]))
        try:
            result: Source | PartwrightError = source_of_step(Path(sys.argv[1]))
        except PartwrightError as error:
            result = error
        output.write(_packed(result))


def _packed(result: Source | PartwrightError) -> bytes:
    """Arrays and JSON, nothing that the reader would run: the child has read a stranger's file."""
    arrays: dict[str, np.ndarray] = {}
    if isinstance(result, PartwrightError):
        header: dict[str, Any] = {"error": type(result).__name__, "message": str(result)}
    else:
        header = {"names": [piece.name for piece in result.pieces], "rest": _rest(result)}
        for i, piece in enumerate(result.pieces):
            arrays |= {f"vertices_{i}": piece.vertices, f"faces_{i}": piece.faces}
    buffer = io.BytesIO()
    told = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez(buffer, header=told, **arrays)  # type: ignore[arg-type]
    return buffer.getvalue()


def _rest(source: Source) -> dict[str, Any]:
    return {entry.name: getattr(source, entry.name) for entry in fields(source) if entry.name != "pieces"}


def _unpacked(data: bytes) -> Source | PartwrightError:
    with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
        header = json.loads(arrays["header"].tobytes())
        if "error" in header:
            named: type[PartwrightError] = getattr(errors, header["error"])
            return named(header["message"])
        pieces = tuple(
            Piece(name, arrays[f"vertices_{i}"], arrays[f"faces_{i}"])
            for i, name in enumerate(header["names"])
        )
    rest = header["rest"]
    return Source(pieces=pieces, **rest | {"repairs": tuple(rest["repairs"])})


def _limit_memory(count: int) -> None:
    """Bytes of data that this process may have, where the system can be told so."""
    try:
        import resource
    except ImportError:  # Windows
        return
    resource.setrlimit(resource.RLIMIT_DATA, (count, count))
