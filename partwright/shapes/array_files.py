"""Files of bare numbers: NPY, NPZ, XYZ and binvox. Sizes are checked before anything of that size is made."""

from __future__ import annotations

import io
import math
import tokenize
import warnings
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from partwright.errors import EmptyShapeError, UnreadableFileError
from partwright.input_files import check_file

_LARGEST = 1 << 30  # bytes of one array
# What numpy and zipfile raise on bytes that are not what the suffix says.
_READ_ERRORS = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    SyntaxError,  # an NPY header is parsed as a Python literal
    tokenize.TokenError,
    RecursionError,
    MemoryError,
    zipfile.BadZipFile,
    zlib.error,
)
_BINVOX_HEADER = 1000  # bytes


def check_shape_file(path: Path) -> None:
    """Raise UnreadableFileError as `check_file` does, EmptyShapeError for a file without a byte."""
    if check_file(path) == 0:
        raise EmptyShapeError(f"{path}: the file is empty (0 bytes); export the shape again")


def read_npy(path: Path) -> NDArray[Any]:
    """The array of an NPY file. Raises UnreadableFileError when it is none, too large, or holds objects."""
    check_shape_file(path)
    try:
        with path.open("rb") as file:
            return _read_array(file, path.name, path.stat().st_size)
    except _READ_ERRORS as error:
        raise _unreadable(path, "NPY", error) from error


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays of an NPZ file by name. Raises UnreadableFileError as `read_npy` does."""
    check_shape_file(path)
    arrays = {}
    try:
        with zipfile.ZipFile(path) as archive:
            total = sum(entry.file_size for entry in archive.infolist())
            if total > _LARGEST:
                raise ValueError(f"it would unpack to {total} bytes; at most {_LARGEST} are read")
            for entry in archive.infolist():
                with archive.open(entry) as file:
                    arrays[entry.filename.removesuffix(".npy")] = _read_array(
                        file, entry.filename, entry.file_size
                    )
    except (
        *_READ_ERRORS,
        RuntimeError,
    ) as error:  # encrypted, or (NotImplementedError) packed in a way unknown
        raise _unreadable(path, "NPZ", error) from error
    return arrays


def _read_array(file: IO[bytes], name: str, stored: int) -> NDArray[Any]:
    """An array whose header claims no more than its file holds and than is sensible."""
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        shape, fortran, dtype = np.lib.format.read_array_header_1_0(file)
    elif version == (2, 0):
        shape, fortran, dtype = np.lib.format.read_array_header_2_0(file)
    else:
        raise ValueError(f"{name} has the unknown format version {version}")
    if dtype.hasobject or dtype.kind not in "biuf":
        raise ValueError(f"{name} holds {dtype}; booleans or numbers were expected")
    size = math.prod(shape) * dtype.itemsize
    if size > min(stored, _LARGEST):
        raise ValueError(
            f"{name} claims {size} bytes of data; it holds at most {stored} and {_LARGEST} are read"
        )
    data = file.read(size)
    if len(data) < size:
        raise ValueError(f"{name} ends after {len(data)} of {size} bytes")
    return np.frombuffer(data, dtype).reshape(shape, order="F" if fortran else "C")


def read_xyz(path: Path) -> NDArray[np.float64]:
    """The numbers of a text file, a point a line: (N, columns). Whitespace, commas or semicolons part them.

    A first line with one number (a count) and everything behind a # are skipped.
    Raises UnreadableFileError when a line is of another kind, EmptyShapeError without any.
    """
    check_shape_file(path)
    if path.stat().st_size > _LARGEST:
        raise UnreadableFileError(f"{path}: is larger than {_LARGEST >> 20} MiB; thin the points out")
    try:
        text = path.read_text(encoding="utf-8-sig").translate({ord(","): " ", ord(";"): " "})
        first, _, rest = text.partition("\n")
        lines = io.StringIO(rest if len(first.split()) == 1 else text)
        with warnings.catch_warnings(action="ignore"):  # about files without data, which are named below
            rows = np.loadtxt(lines, dtype=np.float64, comments="#", ndmin=2)
    except (ValueError, OSError) as error:
        raise UnreadableFileError(
            f"{path}: cannot be read as XYZ ({error}); expected x y z or x y z nx ny nz in every line"
        ) from error
    if rows.size == 0:
        raise EmptyShapeError(f"{path}: holds no points; export them again")
    return rows


def read_binvox(path: Path) -> tuple[NDArray[np.bool_], NDArray[np.float64], float]:
    """Occupancy (nx, ny, nz) of a binvox file, the centre of its first voxel (3,), and the voxels' size.

    Raises UnreadableFileError for a header that makes no sense, and for data that do not fill the grid.
    """
    check_shape_file(path)
    try:
        with path.open("rb") as file:
            sides, place, scale = _binvox_header(file)
            data = np.frombuffer(file.read(2 * math.prod(sides)), dtype=np.uint8)
    except _READ_ERRORS as error:
        raise _unreadable(path, "binvox", error) from error
    value, count = data[: len(data) // 2 * 2].reshape(-1, 2).T
    filled, expected = int(count.sum(dtype=np.int64)), math.prod(sides)
    if filled != expected:
        raise UnreadableFileError(
            f"{path}: its runs fill {filled} of {expected} voxels; the file is truncated. Export it again"
        )
    occupied = np.repeat(value != 0, count).reshape(sides).transpose(0, 2, 1)  # y runs fastest in the file
    size = scale / max(sides)
    return occupied, place + size / 2, size


def _binvox_header(file: IO[bytes]) -> tuple[tuple[int, int, int], NDArray[np.float64], float]:
    """Sides in the file's order (x, z, y), the grid's corner (3,), and the length of its longest side."""
    if not file.readline(_BINVOX_HEADER).startswith(b"#binvox"):
        raise ValueError("it does not begin with #binvox")
    sides, place, scale = (0, 0, 0), np.zeros(3), 1.0
    while (words := file.readline(_BINVOX_HEADER).decode("ascii").split()) != ["data"]:
        if not words:
            raise ValueError("its header has no line 'data'")
        if words[0] == "dim":
            x, z, y = (int(w) for w in words[1:])
            sides = (x, z, y)
        elif words[0] == "translate":
            place = np.array([float(w) for w in words[1:]])
        elif words[0] == "scale":
            (scale,) = (float(w) for w in words[1:])
    if min(sides) < 1 or math.prod(sides) > _LARGEST // 8:
        raise ValueError(f"its sides are {sides}; expected 1 or more and at most {_LARGEST // 8} voxels")
    if place.shape != (3,) or not np.isfinite(place).all() or not 0 < scale < math.inf:
        raise ValueError(f"translate {place} and scale {scale} are no place and size")
    return sides, place, scale


def _unreadable(path: Path, form: str, error: BaseException) -> UnreadableFileError:
    return UnreadableFileError(
        f"{path}: cannot be read as {form} ({error}); the file is truncated or not what its suffix says. "
        "Save it again"
    )
