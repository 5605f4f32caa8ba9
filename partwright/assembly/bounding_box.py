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
_AT_ONCE = 4096  # copies of a part


def bounding_box(node: Node, level: float = 0.0) -> np.ndarray:
    """(2, 3) lowest and highest corner of where the node's distance is below `level` (>= 0)."""
    if node.is_part:
        return _box_of_copies(node, level) if node.instances else _box_of_part(node, level)
    if any(part.field.quadric() is not None for part in node.parts):
        return enclosing_box(node, level)
    first, *rest = node.children
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
    if child.is_part and child.instances:
        other = _boxes(child, level + child.blend / 4)
    else:
        other = bounding_box(child, level + child.blend / 4)[None]
    return _folded(box, other, child.blend)


def _box_of_copies(part: Part, level: float) -> np.ndarray:
    return _folded(_box_of_part(part, level), _boxes(part, level + part.blend / 4)[1:], part.blend)


def _folded(box: np.ndarray, others: np.ndarray, blend: float) -> np.ndarray:
    """A box (2, 3) united with others (N, 2, 3) in their order: each blend lets all before it grow."""
    grows = np.arange(len(others), -1, -1.0)[:, None] * blend / 4
    boxes = np.concatenate([box[None], others])
    return np.array([(boxes[:, 0] - grows).min(axis=0), (boxes[:, 1] + grows).max(axis=0)])


def _boxes(part: Part, level: float) -> np.ndarray:
    """(N, 2, 3) of the part and of its copies, whose fields are one: they are asked together."""
    if level and part.field.quadric() is not None:
        return np.stack([_box_of_part(copy, level) for copy in part.copies])
    turns = np.stack([np.eye(3), *(rotation_matrix(move.rotation) for move in part.instances)])
    moves = np.array([(0.0, 0.0, 0.0), *(move.translation for move in part.instances)])
    axes = (_AXES @ turns) @ rotation_matrix(part.rotation)
    chunks = np.array_split(axes, -(-len(axes) // _AT_ONCE))
    reach = np.concatenate([part.field.support(chunk.reshape(-1, 3), level) for chunk in chunks])
    places = turns @ np.array(part.translation) + moves
    return _around(places, reach.reshape(-1, 2, 3))


def _box_of_part(part: Part, level: float) -> np.ndarray:
    if level and part.field.quadric() is not None:  # its support is known at level 0 alone
        return enclosing_box(part, level)
    reach = part.field.support(_AXES @ rotation_matrix(part.rotation), level)
    return _around(np.array([part.translation]), reach.reshape(1, 2, 3))[0]


def _around(places: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Boxes (N, 2, 3) that reach so far (N, 2, 3) down and up from places (N, 3)."""
    nothing = np.isneginf(reach).any(axis=(1, 2), keepdims=True)  # is inside
    reach = np.where(nothing, 0.0, reach)
    return places[:, None] + reach * np.array([[-1.0], [1.0]])
