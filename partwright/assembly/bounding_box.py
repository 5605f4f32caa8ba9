"""Axis-aligned boxes around parts and assemblies: as tight as their fields know, safe for blended edges.

Assemblies of quadrics are bounded by `enclosure`; where they do not end, their boxes are infinite.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.enclosure import enclosing_box
from partwright.assembly.similarity import rotation_matrix

if TYPE_CHECKING:
    from partwright.assembly.tree import Node, Part

_AXES = np.vstack([-np.eye(3), np.eye(3)])


def bounding_box(node: Node, level: float = 0.0) -> np.ndarray:
    """(2, 3) lowest and highest corner of where the node's distance is below `level` (>= 0)."""
    if node.is_part and not node.instances:
        return _box_of_part(node, level)
    if not node.is_part and any(part.field.quadric() is not None for part in node.parts):
        return enclosing_box(node, level)
    first, *rest = node.operands
    result = bounding_box(first, level)
    for child in rest:
        if node.operation == "union":
            result = _union(result, child, level)
        elif node.operation == "intersection":
            box = bounding_box(child, level)
            result = np.array([np.maximum(result[0], box[0]), np.minimum(result[1], box[1])])
    return np.array([np.minimum(result[0], result[1]), result[1]])


def _union(box: np.ndarray, child: Node, level: float) -> np.ndarray:
    """The smooth minimum lies at most a quarter of the blend below either argument: both grow by that."""
    other = bounding_box(child, level + child.blend / 4)
    grown = box + np.array([[-1.0], [1.0]]) * child.blend / 4
    return np.array([np.minimum(grown[0], other[0]), np.maximum(grown[1], other[1])])


def _box_of_part(part: Part, level: float) -> np.ndarray:
    if level and part.field.quadric() is not None:  # its support is known at level 0 alone
        return enclosing_box(part, level)
    reach = part.field.support(_AXES @ rotation_matrix(part.rotation), level).reshape(2, 3)
    if np.isneginf(reach).any():  # nothing is inside
        reach = np.zeros((2, 3))
    return np.array(part.translation) + np.array([-reach[0], reach[1]])
