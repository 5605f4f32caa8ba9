"""How far the parameters of parts may go, and how far in one step."""

from __future__ import annotations

from partwright.fields import kernel

SHORTEST = 0.004
"""Unit lengths: a side shorter than this is thinner than any wall that the samples can see."""
LEAST_BLEND = 1e-3
"""Unit lengths."""
LIMITS = kernel.Limits(
    lower=(-2.0,) * 3 + (-9.0,) * 3 + (SHORTEST,) * 3 + (0.0,) * 5 + (LEAST_BLEND,),
    upper=(2.0,) * 3 + (9.0,) * 3 + (2.5,) * 3 + (1.0, 1.0, 2.0, 1.0, 1.0, 0.3),
    step=(0.1,) * 3 + (0.3,) * 3 + (0.2,) * 3 + (0.3, 0.1, 0.3, 0.3, 0.3, 0.05),
)
