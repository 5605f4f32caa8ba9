"""Places where a tree is far off the shape though its samples hardly tell: slivers that stick out, small
holes that are closed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.capri.csg_tree import CsgTree
from partwright.meshing import mesh_assembly
from partwright.shapes import Shape
from partwright.shapes.sampling import sample_with_normals

_POINTS = 20_000  # on each of both surfaces
_BESIDE = 0.003  # unit frame: how far from a surface the sides of its points are told
_REACH = 2.0  # times how far off the furthest point of a place is: what belongs to the place


@dataclass(frozen=True)
class Place:
    """Points (N, 3) of the unit frame that a tree has on the wrong side, whether they are inside the shape
    (N,), and how far off the tree is there."""

    points: NDArray[np.float64]
    inside: NDArray[np.bool_]
    off: float


def strays(tree: CsgTree, shape: Shape, limit: float, seed: int) -> list[Place]:
    """Places that are further than `limit` (unit frame) off, the furthest first.

    Points lie within the tree's surface where that is outside of the shape, and on both sides of the shape's
    surface where the tree's is far away.
    """
    from scipy.spatial import cKDTree

    mesh = mesh_assembly(tree.assembly())
    if not len(mesh.faces):
        return []
    ours, our_normal = sample_with_normals(np.asarray(mesh.vertices), np.asarray(mesh.faces), _POINTS, seed)
    theirs, their_normal = sample_with_normals(
        shape.frame.to_unit(shape.vertices), shape.faces, _POINTS, seed
    )
    above = shape.unit_distance(ours)
    missed = cKDTree(ours).query(theirs, workers=-1)[0]
    far, lost = above > limit, missed > limit
    points = np.concatenate(
        [
            ours[far] - _BESIDE * our_normal[far],
            theirs[lost] - _BESIDE * their_normal[lost],
            theirs[lost] + _BESIDE * their_normal[lost],
        ]
    )
    off = np.concatenate([above[far], missed[lost], missed[lost]])
    if not len(points):
        return []
    inside = shape.unit_distance(points) < 0
    wrong = tree.occupancy(points) != inside
    return _places(points[wrong], inside[wrong], off[wrong])


def _places(points: NDArray[np.float64], inside: NDArray[np.bool_], off: NDArray[np.float64]) -> list[Place]:
    """Points (N, 3) parted into places: the furthest off, and what is near to it, again and again."""
    places = []
    while len(points):
        first = int(np.argmax(off))
        near = np.linalg.norm(points - points[first], axis=1) <= _REACH * off[first]
        places.append(Place(points[near], inside[near], float(off[first])))
        points, inside, off = points[~near], inside[~near], off[~near]
    return places
