"""Files that are read: looked at before anything opens them."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from partwright.errors import UnreadableFileError


def check_file(path: Path) -> int:
    """The size of a file in bytes.

    Pipes, sockets and devices are refused: to open one may wait for ever, and to read it may never end.

    Raises:
        UnreadableFileError: it is missing, no file, or may not be read.
    """
    try:
        status = path.stat()
    except FileNotFoundError as error:
        raise UnreadableFileError(f"{path}: no such file; check the path") from error
    except (OSError, ValueError) as error:  # links in a circle, a name too long, or with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise UnreadableFileError(f"{path}: cannot be read ({reason}); check the path") from error
    if stat.S_ISDIR(status.st_mode):
        raise UnreadableFileError(f"{path}: is a folder; name a file in it")
    if not stat.S_ISREG(status.st_mode):
        raise UnreadableFileError(f"{path}: is a pipe, socket or device; save what it gives to a file first")
    if not os.access(path, os.R_OK):
        raise UnreadableFileError(f"{path}: may not be read; check its permissions")
    return status.st_size
