"""Small products, each on one core.

PyTorch shares each of them out among all cores and waits, spinning, for the slowest: of products as small as
a part's, this saves a tenth on an idle machine, and takes ten times as long where a core has other work.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import torch

_here = threading.local()
_lock = threading.Lock()
_within = 0  # threads
_cores = 1


@contextmanager
def one_core_each() -> Iterator[int]:
    """The operations of this thread, and of those begun within, take one core each. Yields how many cores
    there are for what is done side by side. May be nested."""
    global _cores, _within
    if getattr(_here, "within", False):
        yield _cores
        return
    with _lock:  # the number that PyTorch gives to new threads is the whole process's
        if not _within:
            _cores = torch.get_num_threads()
        _within += 1
        cores = _cores
    _here.within = True
    torch.set_num_threads(1)
    try:
        yield cores
    finally:
        torch.set_num_threads(cores)
        _here.within = False
        with _lock:
            _within -= 1
