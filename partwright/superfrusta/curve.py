"""How assemblies of different sizes belong together: each part names its parent in the next smaller one."""

from __future__ import annotations

import dataclasses

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.shapes.grid import grid_indices

_PER_SIDE = 12


def with_parents(larger: Assembly, smaller: Assembly) -> Assembly:
    """`larger` with each part's `metadata["parent"]`: the part of `smaller` that owns most of its volume.

    A point belongs to the part that it lies deepest in, or nearest to.
    """
    names = [part.name for part in smaller.parts]
    for part in larger.parts:
        owners = smaller.nearest_parts(_points_in(part))
        parent = names[int(np.bincount(owners, minlength=len(names)).argmax())]
        known = dataclasses.replace(part, metadata={**part.metadata, "parent": parent})
        larger = larger.replace_part(part.name, known)
    return larger


def _points_in(part: Part) -> np.ndarray:
    """Points (n, 3) inside a part, or all of its box's where it is thinner than the lattice."""
    low, high = part.bounds()
    lattice = (grid_indices((_PER_SIDE,) * 3) + 0.5) / _PER_SIDE
    points = low + lattice * (high - low)
    inside = Assembly((part,)).distance(points) < 0
    return points[inside] if inside.any() else points
