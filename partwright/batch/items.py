"""The shapes of a folder, one after another: which files they are, and a name by what is in them."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from partwright.errors import SettingError
from partwright.shapes import SUFFIXES

_CHUNK = 1 << 20  # bytes
_DIGITS = 24  # of SHA-256 that name an item: two of 100,000 files meet by chance once in 10^19 folders


@dataclass(frozen=True)
class Item:
    """A file of the folder."""

    file: str
    """Path below the folder, with forward slashes."""
    name: str
    """Of its content: two equal files are one item."""
    trouble: str = ""
    """Why it cannot be opened; its name is then of its path."""


def items_of(folder: Path, without: Path | None = None) -> Iterator[Item]:
    """Every file below the folder that can be read as a shape, in the order of their paths, but for those of
    a folder `without`.

    Links to folders are not followed. Files are read one at a time, when they are asked for.

    Raises:
        SettingError: there is no such folder.
    """
    if not folder.is_dir():
        raise SettingError(f"{folder}: expected a folder with shapes")
    for place, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if without is not None:
            folders[:] = [name for name in folders if Path(place, name).resolve() != without.resolve()]
        for name in sorted(files):
            path = Path(place, name)
            if path.suffix.lower() in SUFFIXES and path.is_file() and not name.startswith("."):
                yield _item(path, path.relative_to(folder).as_posix())


def content_name(path: Path) -> str:
    """Hexadecimal digits of the file's SHA-256; of a .gltf, of the buffers that it names, too.

    Raises OSError where it cannot be read.
    """
    digest = hashlib.sha256()
    for one in (path, *_buffers(path)):
        with one.open("rb") as file:
            while chunk := file.read(_CHUNK):
                digest.update(chunk)
    return digest.hexdigest()[:_DIGITS]


def _item(path: Path, file: str) -> Item:
    try:
        return Item(file, content_name(path))
    except OSError as error:
        named = hashlib.sha256(file.encode(errors="surrogateescape")).hexdigest()[:_DIGITS]
        return Item(file, named, f"cannot be opened: {error.strerror or error}")


def _buffers(path: Path) -> list[Path]:
    if path.suffix.lower() != ".gltf":
        return []
    try:
        buffers = json.loads(path.read_bytes()).get("buffers", [])
        names = [buffer.get("uri", "") for buffer in buffers]
        return [path.parent / name for name in names if name and (path.parent / name).is_file()]
    except (ValueError, AttributeError, TypeError):
        return []  # reading it will say what is wrong
