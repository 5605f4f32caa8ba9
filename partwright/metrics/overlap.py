"""How much of an assembly is covered twice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.meshing import occupancy_grid
from partwright.metrics.frames import in_own_frame
from partwright.metrics.metric import Metric

RESOLUTION = 128
_AT_ONCE = 1 << 25  # distances of one part at one point


def overlap(assembly: Assembly, resolution: int = RESOLUTION) -> float:
    """`overlap`: volume in two or more added parts, unblended, over volume in one or more; subtracted parts
    not counted.

    Copies of a repeated part count as parts. An intersection counts as one part (its leaves are meant to
    overlap). Volumes are counted at the centres of 128 cells along the longest side of the added parts'
    bounds; 0 where they hold no cell.
    """
    pieces = tuple(added_parts(assembly))
    if len(pieces) < 2:
        return 0.0
    added = in_own_frame(Assembly(pieces))

    def count(points: np.ndarray) -> np.ndarray:
        """(N,) in how many pieces points (N, 3) lie."""
        if all(isinstance(piece, Part) and piece.field.superfrustum() for piece in added.children):
            return (added.part_distances(points) < 0).sum(axis=0)
        result = np.zeros(len(points), np.int64)
        for piece in added.children:
            low, high = piece.bounds()
            near = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
            result[near] += piece.distance(points[near]) < 0
        return result

    # As a union without blends: the distances of thousands of parts to all points would fill the memory.
    union = Assembly(tuple(replace(piece, blend=0.0) for piece in added.children))
    inside = occupancy_grid(union.distance, resolution)
    centres = ((np.argwhere(inside) + 0.5) * (2.0 / resolution) - 1.0).astype(np.float32)
    if not len(centres):
        return 0.0
    at_once = max(1, _AT_ONCE // max(1, len(added.children)))
    twice = sum(int((count(centres[i : i + at_once]) >= 2).sum()) for i in range(0, len(centres), at_once))
    return twice / len(centres)


def added_parts(node: Assembly | Part) -> list[Assembly | Part]:
    """The parts (each copy of a repeated one), and intersections as wholes, that add to the solid."""
    if isinstance(node, Part):
        return list(node.copies)
    if node.operation == "intersection":
        return [node]
    children = node.children if node.operation == "union" else node.children[:1]
    return [part for child in children for part in added_parts(child)]


OVERLAP = Metric(lambda pair: overlap(pair.assembly), "lower")
