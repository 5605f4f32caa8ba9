"""Memory that a process has freed stays with it for what comes next."""

from __future__ import annotations

import ctypes
import subprocess
import sys

import pytest

FAULTS = """
import resource, sys
import numpy as np
from partwright.__main__ import keep_memory
if sys.argv[1] == "kept":
    keep_memory()
def some():
    return [np.ones(1 << 19) for _ in range(4)]
for _ in range(3):
    some()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    some()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(
    sys.platform != "linux" or not hasattr(ctypes.CDLL(None), "mallopt"), reason="of glibc's allocator"
)
def test_freed_arrays_are_not_given_back_to_the_system_and_taken_again() -> None:
    kept, not_kept = (
        int(subprocess.run([sys.executable, "-c", FAULTS, how], capture_output=True, check=True).stdout)
        for how in ("kept", "not")
    )
    assert kept < not_kept / 4
