"""Axis-aligned boxes around parts and assemblies: as tight as their fields know, safe for blended edges.

Assemblies of quadrics are bounded by `enclosure`; where they do not end, their boxes are infinite.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.enclosure import enclosing_box
from partwright.assembly.similarity import Similarity, rotation_matrix

if TYPE_CHECKING:
    from partwright.assembly.tree import Node, Part

_AXES = np.vstack([-np.eye(3), np.eye(3)])
_AT_ONCE = 4096  # copies of a part
_PAIRS = 32  # parts, copies and groups of a union that are looked at in pairs


def bounding_box(node: Node, level: float = 0.0) -> np.ndarray:
    """(2, 3) lowest and highest corner of where the node's distance is below `level` (>= 0)."""
    if node.is_part:
        return _united((node,), level) if node.instances else _box_of_part(node, level)
    if any(part.field.quadric() is not None for part in node.parts):
        return enclosing_box(node, level)
    if node.operation == "union":
        return _united(node.children, level)
    first, *rest = node.children
    result = bounding_box(first, level)
    if node.operation == "intersection":
        for child in rest:
            result = _shared(result, bounding_box(child, level))
    return np.array([np.minimum(result[0], result[1]), result[1]])


def _united(children: Sequence[Node], level: float) -> np.ndarray:
    """Of children that melt into what lies before them, one after the other.

    The smooth minimum of a and b with a blend of k lies below both where these differ by less than k, by at
    most k/4. So it is below a level L where a or b is, and beyond these only where one is below L + k/4
    and the other below L + k: within what both boxes share at those levels. Pairs are looked at among a few
    members; of more, each may reach to L + k. What a group adds to is seen at the highest of the levels
    alone: asked at each, groups in groups would take pairs of pairs.
    """
    own = [_boxes_of(child, level) for child in children]
    boxes = np.concatenate(own)
    blends = np.repeat([child.blend for child in children], [len(of) for of in own])
    blends[0] = 0.0
    if not blends.any():
        return _joined(boxes)
    if len(boxes) > _PAIRS:
        melted = [_boxes_of(child, level + child.blend) for child in children]
        return _joined(np.concatenate([boxes, np.concatenate(melted)[blends > 0]]))
    members = [copy for child in children for copy in (child.copies if child.is_part else (child,))]
    lowered = np.cumsum(blends) / 4  # by how much the union of all up to each may lie below its members
    highest = level + float(blends.max() + lowered[-1])
    groups: dict[int, np.ndarray] = {}

    def below(index: int, level: float) -> np.ndarray:
        if members[index].is_part:
            return bounding_box(members[index], level)
        if index not in groups:
            groups[index] = bounding_box(members[index], highest)
        return groups[index]

    result = boxes[0]
    for last in range(1, len(members)):
        result = _joined([result, boxes[last]])
        if not (blend := float(blends[last])):
            continue
        reach = bounding_box(members[last], level + blend)
        if _holds(result, reach):
            continue
        near = _shared(below(last, level + blend / 4), reach)
        for one in range(last):
            drop = float(lowered[last - 1] - (lowered[one - 1] if one else 0.0))
            far = _shared(below(one, level + blend + drop), reach)
            if _is_empty(far) or _holds(result, far):
                continue
            close = _shared(below(one, level + blend / 4 + drop), reach)
            shared = [box for box in (close, _shared(far, near)) if not _is_empty(box)]
            result = _joined([result, *shared])
    return result


def _boxes_of(node: Node, level: float) -> np.ndarray:
    """(N, 2, 3) of a group, or of a part and its copies."""
    return _boxes(node, level) if node.is_part else bounding_box(node, level)[None]


def _joined(boxes: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    return np.array([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])


def _shared(box: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.array([np.maximum(box[0], other[0]), np.minimum(box[1], other[1])])


def _holds(box: np.ndarray, other: np.ndarray) -> bool:
    return bool((other[0] >= box[0]).all() and (other[1] <= box[1]).all())


def _is_empty(box: np.ndarray) -> bool:
    return bool((box[0] > box[1]).any())


def _boxes(part: Part, level: float) -> np.ndarray:
    """(N, 2, 3) of the part and of its copies, whose fields are one: they are asked together."""
    if level and part.field.quadric() is not None:
        return np.stack([_box_of_part(copy, level) for copy in part.copies])
    return moved_boxes(part, (Similarity(), *part.instances), level)


def moved_boxes(part: Part, moves: Sequence[Similarity], level: float = 0.0) -> np.ndarray:
    """(N, 2, 3) of where a part, without its copies, is after each of N >= 1 moves that scale nothing."""
    turns = np.stack([rotation_matrix(move.rotation) for move in moves])
    axes = (_AXES @ turns) @ rotation_matrix(part.rotation)
    chunks = np.array_split(axes, -(-len(axes) // _AT_ONCE))
    reach = np.concatenate([part.field.support(chunk.reshape(-1, 3), level) for chunk in chunks])
    places = turns @ np.array(part.translation) + np.array([move.translation for move in moves])
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
