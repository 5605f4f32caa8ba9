"""Files that are complete or absent: written under a temporary name in the same folder, then renamed."""

from __future__ import annotations

import os
import shutil
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from partwright.errors import OutputError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A temporary path that becomes `path` when the block ends, and is removed where it fails.

    It keeps the suffix, so that writers which go by it can be handed the temporary path.

    Raises:
        OutputError: the folder is missing or not writable, or the disk is full.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        if path.is_dir():
            raise OutputError(f"cannot write {path}: a folder of that name is in the way")
        os.replace(temporary, path)
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"cannot write {path}: {reason}; choose another place with -o") from error
    finally:
        with suppress(OSError):  # not there, renamed, or in no folder at all: said above
            temporary.unlink()


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
def finishing() -> Iterator[None]:
    """Ctrl-C in the block is left unheard: what scoring and writing finish took longer than they do.

    Only the main thread hears Ctrl-C, so elsewhere this does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def check_folder(folder: str | Path) -> None:
    """Whether results can be written into `folder`, which may not exist yet: ask before the work, not after.

    Raises:
        OutputError: a file is in the way, or the nearest existing folder is not writable.
    """
    folder = Path(folder)
    nearest = next(p for p in (folder.absolute(), *folder.absolute().parents) if p.exists())
    if not nearest.is_dir():
        raise OutputError(f"cannot write into {folder}: {nearest} is a file; choose another place with -o")
    if not os.access(nearest, os.W_OK):
        raise OutputError(
            f"cannot write into {folder}: {nearest} is not writable; choose another place with -o"
        )


@contextmanager
def replacing_files(folder: str | Path) -> Iterator[Path]:
    """A temporary folder whose files move into `folder`, which is made if need be, when the block ends well.

    Other files of `folder` stay. Nothing is moved where the block fails.

    Raises:
        OutputError: as `check_folder`, or the disk is full.
    """
    folder = Path(folder)
    check_folder(folder)
    staging = folder.absolute().with_name(f".{folder.absolute().name}.{os.getpid()}.part")
    try:
        staging.mkdir(parents=True)
        yield staging
        if folder.exists():
            for path in sorted(staging.iterdir()):
                os.replace(path, folder / path.name)
        else:
            os.rename(staging, folder)
    except OSError as error:
        reason = error.strerror or error
        raise OutputError(f"cannot write into {folder}: {reason}; choose another place with -o") from error
    finally:
        shutil.rmtree(staging, ignore_errors=True)
