"""The signed distance of parts and assemblies in their own units.

The kernel works in float32. Sizes of 1e-6 or places a million units from the origin would leave it no digits,
so the assembly and the points are first brought to the size and place of the unit frame, in float64.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, groupby, takewhile
from operator import itemgetter
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from partwright.assembly.joint import is_joint
from partwright.assembly.rows import rows
from partwright.assembly.similarity import Similarity, rotation_matrix
from partwright.errors import ParameterError
from partwright.fields import kernel, smooth_difference, smooth_intersection, smooth_union
from partwright.fields.operations import is_tensor
from partwright.fields.pipe import Pipe
from partwright.fields.swept import Swept

if TYPE_CHECKING:
    from partwright.assembly.joint import JointPart
    from partwright.assembly.tree import Assembly, Node, Operation, Part

_UNIT_SIDE = 1.8
_KERNEL = "kernel"
# Longest sides, and up to here coordinates, that float32 holds as well as those of a unit frame.
_ALIKE = (0.9, 3.6)
_ROUNDING = 1e-14  # of the place: what is smaller has no size
_ROOM = 1e-5  # unit lengths, for the rounding of boxes and distances
_FOLD = {"union": smooth_union, "intersection": smooth_intersection, "difference": smooth_difference}


def unit_similarity(node: Node) -> Similarity:
    """The map that centres the box around all leaves at 0 and makes its longest side 1.8.

    Leaves without end do not count; where all are, the node's own box does, if it ends. Nodes that are nearly
    there, as all are that a method works on, stay as they are: that saves to move all points.
    """
    boxes = np.array([part.bounds() for part in node.parts])
    boxes = boxes[np.isfinite(boxes).all(axis=(1, 2))]
    if len(boxes) < len(node.parts):
        whole = node.bounds()
        boxes = np.array([*boxes, whole]) if np.isfinite(whole).all() else boxes
    if not len(boxes):
        return Similarity()
    lower, upper = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    longest = float((upper - lower).max())
    if _ALIKE[0] <= longest <= _ALIKE[1] and max(-lower.min(), upper.max()) <= _ALIKE[1]:
        return Similarity()
    scale = _UNIT_SIDE / longest if longest > _ROUNDING * float(np.abs(boxes).max()) else 1.0
    return Similarity(scale, translation=tuple(-scale * (lower + upper) / 2))


def distance(node: Node, points: Any) -> Any:
    """Signed distance (N,) of the node at points (N, 3); see `Assembly.distance`."""
    frame, unit_node = node._normalised
    if is_tensor(points):
        move = points.new_tensor(frame.translation)
        return _reference(unit_node, points * frame.scale + move) / frame.scale
    points = _checked(points)
    return _back(_evaluate(unit_node, _local(frame, points)), frame, points)


def part_distances(assembly: Assembly, points: np.ndarray) -> np.ndarray:
    """(M, N) signed distance of each leaf alone at points (N, 3)."""
    points = _checked(points)
    return _back(_leaves(assembly, points), assembly._normalised[0], points)


def nearest_parts(assembly: Assembly, points: np.ndarray) -> np.ndarray:
    """(N,) which leaf points (N, 3) lie deepest in or nearest to."""
    return np.asarray(_leaves(assembly, _checked(points)).argmin(axis=0))


def _leaves(assembly: Assembly, points: np.ndarray) -> np.ndarray:
    """(M, N) float32 distance of each leaf to its nearest copy, in the unit frame, at points in own units."""
    frame, unit_assembly = assembly._normalised
    copies = [part.copies for part in unit_assembly.parts]
    flat = tuple(chain.from_iterable(copies))
    values = np.stack([d for d, _ in _children(flat, _local(frame, points))])
    if len(values) == len(copies):
        return values
    return np.asarray(np.minimum.reduceat(values, np.cumsum([0, *map(len, copies[:-1])]), axis=0))


def _checked(points: Any) -> np.ndarray:
    points = np.asarray(points)
    if points.ndim != 2 or points.shape[1] != 3:
        raise ParameterError(f"points: expected shape (N, 3), got {points.shape}")
    return points


def _local(frame: Similarity, points: np.ndarray) -> np.ndarray:
    """Points (N, 3) in the frame, float32, by way of float64."""
    if frame == Similarity():
        return np.asarray(points, np.float32)
    result = np.empty(points.shape, np.float32)
    for i, offset in enumerate(frame.translation):  # by columns: rows of three are slow to loop over
        result[:, i] = frame.scale * points[:, i].astype(np.float64) + offset
    return result


def _back(values: np.ndarray, frame: Similarity, points: np.ndarray) -> np.ndarray:
    """To own units: in float64, which holds lengths that float32 would flush to zero."""
    kind = np.result_type(points.dtype, np.float32)
    own = values if frame.scale == 1.0 else values.astype(np.float64) / frame.scale
    return own.astype(kind, copy=False)


def _evaluate(node: Node, points: np.ndarray) -> np.ndarray:
    """(N,) float32 by the kernel; the leaves that begin a union are folded in a single call."""
    children = node.operands
    lead = _leading_leaves(children) if node.operation == "union" else []
    known: list[tuple[np.ndarray, float]] = [(kernel.evaluate(rows(lead), points), 0.0)] if lead else []
    rest = children[len(lead) :]
    boxed = [(i > 0 or bool(lead)) and _ends_in_a_box(node.operation, child) for i, child in enumerate(rest)]
    for ends, group in groupby(zip(boxed, rest, strict=True), itemgetter(0)):
        nodes = tuple(child for _, child in group)
        if ends:
            result, _ = known[0]
            for part in cast("tuple[Part, ...]", nodes):
                result = _folded_near(node.operation, result, part, points)
        else:
            result = _folded(node.operation, chain(known, _children(nodes, points)))
        known = [(result, 0.0)]
    return np.asarray(known[0][0])


def _ends_in_a_box(operation: Operation, node: Node) -> bool:
    """Whether a child leaves the result as it is wherever the box around it is far enough away: pipes and
    solids of a profile are nowhere nearer than their boxes, and take long enough for that to pay."""
    return operation != "intersection" and node.is_part and isinstance(node.field, Swept | Pipe)


def _folded_near(operation: Operation, result: np.ndarray, part: Part, points: np.ndarray) -> np.ndarray:
    """`_folded` of a result (N,) and a part with its copies, which is asked only where it can change it."""
    room = (result if operation == "union" else -result) + np.float32(part.blend + _ROOM)
    square, (low, high) = np.zeros(len(points), np.float32), part.bounds().astype(np.float32)
    for values, least, most in zip(points.T, low, high, strict=True):
        off = np.maximum(least - values, values - most)
        np.maximum(off, 0.0, out=off)
        square += off * off
    near = np.flatnonzero((square <= 0) | ((room > 0) & (square < room * room)))
    changed = result.copy()
    changed[near] = _FOLD[operation](result[near], _alone(part, points[near]), part.blend)
    return changed


def _alone(node: Node, points: np.ndarray) -> np.ndarray:
    """(N,) of a child for itself, with its copies."""
    if node.is_part and not node.instances:
        return np.asarray(_posed(node, points))
    return _evaluate(node, points)


def _reference(node: Node, points: Any) -> Any:
    """(N,) by the fields themselves, differentiable where the points are torch tensors."""
    if node.is_part and not node.instances:
        return _posed(node, points)
    return _folded(node.operation, ((_reference(c, points), c.blend) for c in node.operands))


def _folded(operation: Operation, values: Iterator[tuple[Any, float]]) -> Any:
    result, _ = next(values)
    for value, blend in values:
        result = _FOLD[operation](result, value, blend)
    return result


def _posed(part: Part, points: Any) -> Any:
    """The part's field at world points (N, 3) of either library."""
    rotation, translation = rotation_matrix(part.rotation), np.array(part.translation)
    if is_tensor(points):
        rotation, translation = points.new_tensor(rotation), points.new_tensor(translation)
    else:
        rotation, translation = rotation.astype(np.float32), translation.astype(np.float32)
    return part.field((points - translation) @ rotation)


def _leading_leaves(children: tuple[Node, ...]) -> list[Part]:
    return list(cast("Iterator[Part]", takewhile(_in_one_row, children)))


def _in_one_row(node: Node) -> bool:
    """Whether one row of the kernel stands for the node."""
    return node.is_part and not node.instances and node.field.superfrustum() is not None


def _batch(node: Node) -> object:
    """What neighbouring nodes have in common that are evaluated by one call; None for one by itself."""
    if _in_one_row(node):
        return _KERNEL
    if is_joint(node) and not node.instances:
        return node.field.shape_key
    return None


def _joint(parts: list[JointPart], points: np.ndarray) -> Iterator[tuple[np.ndarray, float]]:
    """Parts of one learned shape in one pass; the next shape begins with the first that is none of them."""
    fields = [part.field for part in parts]
    known = [member.field for member in fields[0].members]
    last = next((i for i, field in enumerate(fields) if i and field not in known), len(parts))
    local = (points - np.array(parts[0].translation, np.float32)) @ rotation_matrix(parts[0].rotation)
    values = fields[0].together(local.astype(np.float32), fields[:last])
    yield from zip(values, (part.blend for part in parts[:last]), strict=True)
    if last < len(parts):
        yield from _joint(parts[last:], points)


def _children(children: tuple[Node, ...], points: np.ndarray) -> Iterator[tuple[np.ndarray, float]]:
    """Each child's distance alone and its blend; neighbouring leaves share a call."""
    for batched, group in groupby(children, _batch):
        if batched == _KERNEL:
            leaves = cast("list[Part]", list(group))
            values = kernel.evaluate_parts(rows(leaves), points)
            yield from zip(values, (leaf.blend for leaf in leaves), strict=True)
        elif batched is not None:
            yield from _joint(cast("list[JointPart]", list(group)), points)
        else:
            for node in group:
                yield _alone(node, points), node.blend
