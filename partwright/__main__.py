"""The command line as a process: `partwright`, or `python -m partwright`."""

import gc
import os
import sys

_SELDOM = (100_000, 50, 50)
"""How often Python's collector looks for cycles: hardly any are made, and each look goes through all that the
imports have made, which was a thirtieth of a fit's work."""


_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3  # of glibc's malloc.h
_KEPT, _LARGEST = 1 << 29, 1 << 25
"""Bytes that stay with the process, and of a piece of them, at most."""


def keep_memory() -> None:
    """Keep freed memory for what comes next, where the C library is glibc.

    Arrays of megabytes come and go by the thousand, and each time the system clears their pages, which was a
    fortieth of a fit's work.
    """
    if sys.platform != "linux":
        return
    import ctypes

    allocator = getattr(ctypes.CDLL(None), "mallopt", None)  # musl has none
    if allocator is not None:
        allocator(_M_MMAP_THRESHOLD, _LARGEST)
        allocator(_M_TRIM_THRESHOLD, _KEPT)


def main() -> int:
    """Hear Ctrl-C before anything else is imported, then run the command line; returns the exit code.

    What comes before that is Python's own start, some hundredths of a second: a Ctrl-C there ends the
    process as it ends any that Python runs, with its traceback, and nothing has been done yet.
    """
    try:
        from partwright.cli.interrupts import listen

        listen()
    except KeyboardInterrupt:
        os._exit(130)
    gc.set_threshold(*_SELDOM)
    keep_memory()
    from partwright.cli.main import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
