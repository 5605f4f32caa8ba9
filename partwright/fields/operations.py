"""Set operations on signed distances, for numpy arrays and torch tensors alike.

All are pointwise, broadcast, and differentiable where their arguments are tensors.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from partwright.fields.base import Array

# Below this radius the smooth union is the plain one.
SHARP = 1e-9


def union(a: Array, b: Array) -> Array:
    """Distance to A or B: min(a, b)."""
    return library(a).minimum(a, b)


def intersection(a: Array, b: Array) -> Array:
    """Distance to A and B: max(a, b); a lower bound outside."""
    return library(a).maximum(a, b)


def difference(a: Array, b: Array) -> Array:
    """Distance to A without B: max(a, -b); a lower bound outside."""
    return library(a).maximum(a, -b)


def smooth_union(a: Array, b: Array, k: float | Array) -> Array:
    """The polynomial smooth minimum with blend radius k >= 0; k <= 1e-9 is the plain minimum.

    min(a, b) - max(k - |a - b|, 0)^2 / (4 k), which equals mix(b, a, w) - k w (1 - w) with
    w = clamp(1/2 + (b - a) / (2 k), 0, 1) but keeps its gradient accurate for small k.
    """
    xp = library(a)
    if isinstance(k, float) and xp is np:  # the same values, by half of the passes
        least: Any = np.minimum(a, b)
        if k > SHARP:
            least -= np.maximum(_like(a, k) - abs(a - b), 0) ** 2 / (4 * _like(a, k))
        return least
    radius = _like(a, k)
    blended = radius > SHARP
    safe = xp.where(blended, radius, xp.ones_like(radius))
    shared = xp.maximum(safe - abs(a - b), xp.zeros_like(a))
    fillet = shared * shared / (4 * safe)
    return xp.minimum(a, b) - xp.where(blended, fillet, xp.zeros_like(fillet))


def smooth_intersection(a: Array, b: Array, k: float | Array) -> Array:
    """The smooth union of the complements, turned inside out."""
    return -smooth_union(-a, -b, k)


def smooth_difference(a: Array, b: Array, k: float | Array) -> Array:
    """A and the complement of B, blended."""
    return -smooth_union(-a, b, k)


def is_tensor(value: Any) -> bool:
    """Whether value is a torch tensor, without importing torch."""
    torch = sys.modules.get("torch")
    return torch is not None and isinstance(value, torch.Tensor)


def library(value: Any) -> Any:
    """The module, torch or numpy, whose functions take the value."""
    return sys.modules["torch"] if is_tensor(value) else np


def _like(reference: Any, value: Any) -> Any:
    if is_tensor(reference):
        return sys.modules["torch"].as_tensor(value, dtype=reference.dtype, device=reference.device)
    return np.asarray(value, dtype=np.asarray(reference).dtype)
