"""How much a file may build: what it names again and again is small in the file and large in memory."""

from __future__ import annotations

from pathlib import Path

from partwright.errors import UnreadableFileError

_MOST_PIECES = 20_000
_MOST_TRIANGLES = 20_000_000  # of all of them together


def check_extent(path: Path, pieces: int, triangles: int) -> None:
    """Refuse a file whose objects, named again and again, make up more than memory holds.

    Raises:
        UnreadableFileError: it has too many pieces, or triangles in all of them together.
    """
    if pieces > _MOST_PIECES or triangles > _MOST_TRIANGLES:
        raise UnreadableFileError(
            f"{path}: builds {pieces:.6g} objects of {triangles:.6g} triangles in all; at most "
            f"{_MOST_PIECES} of {_MOST_TRIANGLES} are accepted. Export less of it, or simplified"
        )
