"""What became of each item: one line of JSON an item, appended and never changed.

The last line of an item counts. A line that a killed process left unfinished is passed over.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from partwright.errors import OutputError

DONE = "done"
FAILED = ("failed", "time", "memory", "crashed")
"""Why an item has no result: an error that was named, a limit, or a worker that died."""


@dataclass(frozen=True)
class Entry:
    """One line."""

    item: str
    file: str
    status: str
    """`DONE`, or one of `FAILED`."""
    reason: str = ""
    """Of a failure, in a line."""
    seconds: float = 0.0
    peak_memory: int = 0
    """Bytes."""
    result: dict[str, Any] = field(default_factory=dict)
    """Parts, outcome, warnings and scores, as in report.json."""

    def line(self) -> str:
        return json.dumps(self.__dict__, separators=(",", ":")) + "\n"


class Manifest:
    """The open file, which one process at a time may append to."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def append(self, entry: Entry) -> None:
        """On disk when this returns."""
        self._file.write(entry.line().encode())
        self._file.flush()
        os.fsync(self._file.fileno())


@contextmanager
def appending(path: Path) -> Iterator[Manifest]:
    """The manifest at the path, made if need be, locked in the block.

    Raises:
        OutputError: another process has it, or it cannot be written.
    """
    try:
        file = path.open("ab")
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from error
    with file:
        _lock(file, path)
        if file.tell() and not _ends_whole(path):
            file.write(b"\n")
        yield Manifest(file)


def entries(path: Path) -> Iterator[Entry]:
    """All whole lines, first to last; none where there is no such file."""
    with suppress(FileNotFoundError), path.open("rb") as file:
        for line in file:
            with suppress(ValueError, TypeError):
                yield Entry(**json.loads(line))


def latest(folder: Path) -> dict[str, Entry]:
    """The last entry of each item, over all manifests of the folder."""
    found: dict[str, Entry] = {}
    for path in sorted(folder.glob("manifest*.jsonl")):
        for entry in entries(path):
            before = found.get(entry.item)
            if before is None or before.status != DONE or entry.status == DONE:
                found[entry.item] = entry
    return found


def _ends_whole(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"


def _lock(file: IO[bytes], path: Path) -> None:
    try:
        import fcntl
    except ImportError:  # Windows: two batches into one folder would repeat one another's work
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise OutputError(f"{path}: another batch is at work there; wait for it, or use --shard") from error
