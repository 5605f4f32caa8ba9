"""Files that are complete or absent: staged under a hidden name in their own folder, then renamed.

Staging inside the folder keeps every rename on one file system, so a mount point can be written into, and a
folder whose parent is read-only. What a killed process left staged is cleared by the next one.
"""

from __future__ import annotations

import os
import platform
import re
import shutil
import signal
import stat
import threading
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path, PurePosixPath

from partwright.errors import OutputError

_STAGED = re.compile(r"\.partwright-([0-9a-f]{8})-(\d{1,9})-\d+\.part\b.*", re.DOTALL)
_MAX_SUFFIX = 40  # characters of a suffix that a temporary name keeps: longer ones are no format
_serial = count()
_moved = threading.Event()  # set by the first file that this process has written
_live: set[Path] = set()  # what this process has staged and not yet moved
# Held while staged files are made or moved, so that `abandon` finds either all of a result or none of it.
_moving = threading.RLock()


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary path that becomes `path` when the block ends, and is removed where it fails.

    It keeps the suffix, so that writers which go by it can be handed the temporary path.

    Raises:
        OutputError: the folder is missing or not writable, something is in the way, or the disk is full.
    """
    path = Path(path)
    with _named(f"cannot write {path}"), _staged(path.parent, path.suffix) as temporary:
        _check_free(path)
        yield temporary
        with _moving:
            os.replace(temporary, path)
            _moved.set()


def write_bytes(path: str | Path, data: bytes) -> None:
    """Replace the file at `path` by `data`, whole or not at all.

    Raises:
        OutputError: it cannot be written.
    """
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def report_path(path: str | Path) -> Path:
    """FILE.report.json, in which what is to be known of FILE lies."""
    return Path(path).with_name(Path(path).name + ".report.json")


@contextmanager
def replacing_files(folder: str | Path, stale: re.Pattern[str] | None = None) -> Iterator[Path]:
    """A temporary folder whose files move into `folder`, which is made if need be, when the block ends well;
    those in folders of its own into folders of the same names.

    Other files of `folder` stay, but for those whose whole name matches `stale`: files of an earlier result
    that this one does not have. Where the block or a move fails, everything is as it was.

    Raises:
        OutputError: as `check_folder`, or the disk is full.
    """
    folder = Path(folder)
    check_folder(folder)
    with _named(f"cannot write into {folder}"), _made(folder), _staged(folder) as staging:
        new, old = staging / "new", staging / "old"
        for each in (staging, new, old):
            each.mkdir()
        yield new
        with _moving:
            _exchange(folder, new, old, stale)
            _moved.set()


def check_folder(folder: str | Path, names: Iterable[str] = ()) -> None:
    """Whether files of these names can be written into `folder`, which may not exist yet, by really trying.

    Ask before the work, not after. Nothing is left behind, and what a killed process left is cleared.

    Raises:
        OutputError: a file is in the way of the folder or a folder in that of a file, or a folder cannot be
            made or written into.
    """
    folder = Path(folder)
    with _named(f"cannot write into {folder}"):
        nearest = next(p for p in (folder.absolute(), *folder.absolute().parents) if _status(p))
        if not nearest.is_dir():
            raise OutputError(
                f"cannot write into {folder}: {nearest} is a file; choose another place with -o"
            )
        with _made(folder):
            _check_inside(folder, names)


def check_files(paths: Iterable[str | Path]) -> None:
    """Whether these files can be written, whose folders exist, by really trying: before the work, not after.

    Raises:
        OutputError: a folder is missing or cannot be written into, or something is in the way of a file.
    """
    for path in map(Path, paths):
        with _named(f"cannot write {path}"):
            _check_inside(path.parent, [path.name])


def check_unread(outputs: Iterable[str | Path], inputs: Iterable[str | Path]) -> None:
    """That no output is one of the inputs, by whatever name, link or spelling.

    Raises:
        OutputError: writing would replace what was read.
    """
    inputs = list(inputs)
    for output in outputs:
        for given in inputs:
            with suppress(OSError):  # one of them is not there: then they are not the same
                if os.path.samefile(output, given):
                    raise OutputError(
                        f"writing {output} would replace {given}, which is read: choose another place with "
                        "-o, or add --overwrite"
                    )


def abandon() -> bool:
    """Remove all that is staged, for a process that ends at once; a move that has begun is finished first.

    Nothing can be staged or moved afterwards: threads that try wait until the process ends.

    Returns:
        Whether this process has written anything.
    """
    _moving.acquire()
    for path in list(_live):
        _remove(path)
    return _moved.is_set()


@contextmanager
def finishing() -> Iterator[None]:
    """Ctrl-C in the block raises nothing: what scoring and writing finish took longer than they do.

    Who has set a handler of their own keeps it. Only the main thread hears Ctrl-C, so elsewhere this does
    nothing.
    """
    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, lambda *_: None)  # not ignored: another thread may hear it
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def _named(what: str) -> Iterator[None]:
    """The system's errors as an OutputError that begins with `what`."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{what}: {error.strerror or error}; choose another place with -o") from error


@contextmanager
def _made(folder: Path) -> Iterator[None]:
    """`folder` and its parents exist in the block; those that were made and are still empty go after it."""
    missing = [p for p in (folder.absolute(), *folder.absolute().parents) if not _status(p)]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        yield
    finally:
        for path in missing:
            with suppress(OSError):  # holds the result, or was never made
                path.rmdir()


@contextmanager
def _staged(folder: Path, suffix: str = "") -> Iterator[Path]:
    """A name in `folder` that none has; what stands there when the block ends is removed."""
    suffix = suffix if len(suffix) <= _MAX_SUFFIX else ""
    path = folder.absolute() / f".partwright-{_host()}-{os.getpid()}-{next(_serial)}.part{suffix}"
    with _moving:
        _live.add(path)
    try:
        yield path
    finally:
        _remove(path)
        _live.discard(path)


def _exchange(folder: Path, new: Path, old: Path, stale: re.Pattern[str] | None) -> None:
    """The files of `new` into `folder`, stale ones out of it; `old` keeps what they replace meanwhile."""
    coming = sorted(path.relative_to(new).as_posix() for path in new.rglob("*") if not path.is_dir())
    going = [
        path.name
        for path in sorted(folder.iterdir())
        if stale and stale.fullmatch(path.name) and path.name not in coming and not path.is_dir()
    ]
    for name in coming:
        _check_free(folder / name)
    begun: list[str] = []
    made = [folder / name for name in sorted(map(str, _folders(coming))) if not _status(folder / name)]
    try:
        for name in (*coming, *going):
            for place in (folder, old):
                (place / name).parent.mkdir(parents=True, exist_ok=True)
            _keep(folder / name, old / name)
            begun.append(name)
            if name in coming:
                os.replace(new / name, folder / name)
            else:
                (folder / name).unlink()
    except BaseException:
        for name in reversed(begun):
            if _status(old / name):
                os.replace(old / name, folder / name)
            else:
                (folder / name).unlink(missing_ok=True)
        for path in reversed(made):
            with suppress(OSError):
                path.rmdir()
        raise


def _folders(names: Iterable[str]) -> set[PurePosixPath]:
    """Folders, below one that is there, in which these files lie."""
    return {parent for name in names for parent in PurePosixPath(name).parents if parent.parts}


def _keep(path: Path, kept: Path) -> None:
    """A second name for what stands at `path`, or a copy where the file system knows no second names."""
    if not _status(path):
        return
    try:
        os.link(path, kept, follow_symlinks=False)
    except OSError:
        shutil.copy2(path, kept, follow_symlinks=False)


def _check_inside(folder: Path, names: Iterable[str]) -> None:
    _clear(folder)
    for name in names:
        _check_free(folder / name)
    with _staged(folder) as trial:
        trial.mkdir()


def _check_free(path: Path) -> None:
    """Raises unless a file can take this name: nothing, a file or a link is there."""
    status = _status(path)
    if status is None or stat.S_ISREG(status.st_mode) or stat.S_ISLNK(status.st_mode):
        return
    kind = "a folder" if stat.S_ISDIR(status.st_mode) else "something that is no file"
    raise OutputError(f"cannot write {path}: {kind} of that name is in the way; choose another place with -o")


def _status(path: Path) -> os.stat_result | None:
    """Of the name itself, not of what it links to; None where there is none."""
    try:
        return os.lstat(path)
    except (FileNotFoundError, NotADirectoryError):
        return None


def _clear(folder: Path) -> None:
    """Remove what processes that are no more have left staged here."""
    for path in sorted(folder.absolute().iterdir()):
        match = _STAGED.fullmatch(path.name)
        if match and match[1] == _host() and not _alive(int(match[2]), path):
            _remove(path)


def _alive(pid: int, staged: Path) -> bool:
    """Whether the process that staged this still runs; where that cannot be told, it does."""
    if pid == os.getpid():  # in a container, the one before may have had the same number
        return staged in _live
    if os.name != "posix":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _host() -> str:
    """Eight digits for this machine: process numbers of another, on a shared disk, say nothing here."""
    return f"{zlib.crc32(platform.node().encode()):08x}"


def _remove(path: Path) -> None:
    try:
        path.unlink()
    except FileNotFoundError:  # as of every file that was moved: to walk it as a folder takes a millisecond
        pass
    except OSError:
        shutil.rmtree(path, ignore_errors=True)
