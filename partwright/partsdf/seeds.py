"""Seeds of PyTorch's generators, of which those on the CPU keep but 32 bits."""

from __future__ import annotations

_BITS = 0xFFFFFFFF
_SPREAD = 0x9E3779B1  # odd, so that no two seeds of 32 bits come to the same


def mixed(seed: int, number: int) -> int:
    """A seed of 32 bits for each number (a step, a sample) of each seed; of seed 0 the number itself."""
    return (number ^ (seed * _SPREAD)) & _BITS
