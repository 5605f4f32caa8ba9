"""Convexes that touch made to overlap, so that their union is one solid.

Where two convexes meet in one face, a boolean of their meshes may keep a sheet between them, as thin as the
rounding of their corners. A face with the shape's inside beyond it is internal: it moves out a little.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import CsgTree
from partwright.capri.samples import OccupancySamples

_OVERLAP_DEPTH = 0.002  # unit frame: by how much an internal face moves out
_PROBE_DEPTH = 0.01  # how far beyond a face samples tell whether it is internal
_MAX_EXPOSED_SHARE = 0.3  # of them that may be of the other side: corners, details that the tree leaves out


def overlapped(tree: CsgTree, samples: OccupancySamples) -> CsgTree:
    """The tree with the internal faces of its convexes moved out."""
    values = rows.values(tree.rows, samples.points)
    covered = [[(values[:, list(c)] <= 0).all(axis=1) for c in layer] for layer in tree.layers]
    table, complement = list(tree.rows), list(tree.complement)
    layers = []
    for at, layer in enumerate(tree.layers):
        later = [mask for above in covered[at + 1 :] for mask in above]
        free = ~np.any(later, axis=0) if later else np.ones(len(values), dtype=bool)
        harmed = free & (samples.inside != (at % 2 == 0))
        copies = tree.copies[at] if tree.copies else (None,) * len(layer)
        origin = [i if copy is None else copy.of for i, copy in enumerate(copies)]
        internal = [_internal(values[:, convex], harmed) for convex in layer]
        convexes = []
        for i, convex in enumerate(layer):
            moved = list(convex)
            # Copies stay copies: better a face that stands out by so little than a crack within the solid.
            alike = [internal[j] for j in range(len(layer)) if origin[j] == origin[i]]
            for face in np.flatnonzero(np.any(alike, axis=0)):
                moved[face] = len(table)
                table.append(tree.rows[convex[face]] - _OVERLAP_DEPTH * np.eye(10)[rows.CONSTANT])
                complement.append(tree.complement[convex[face]])
            convexes.append(tuple(moved))
        layers.append(tuple(convexes))
    return CsgTree(np.stack(table), np.array(complement), tuple(layers), tree.copies)


def _internal(values: NDArray[np.float64], harmed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(k,) whether the samples just beyond a face of a convex with these values (N, k) are on its side."""
    left_out = values > 0
    single = left_out.sum(axis=1) == 1
    beyond = left_out & single[:, None] & (values < _PROBE_DEPTH)
    count = beyond.sum(axis=0)
    return np.asarray((count > 0) & ((beyond & harmed[:, None]).sum(axis=0) <= _MAX_EXPOSED_SHARE * count))
