"""An assembly's tree over the distances of its copies, for evaluating it again when few of them change."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part
from partwright.assembly.tree import Node, Operation
from partwright.fields import smooth_difference, smooth_intersection, smooth_union
from partwright.fields.operations import SHARP

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class Fold:
    """A node of the tree."""

    operation: Operation
    """By which its children are folded, first to last."""
    children: tuple[int | Fold, ...]
    """Copies by their index, and further nodes."""
    blend: float = 0.0
    """With what came before it, own units."""

    @classmethod
    def of(cls, assembly: Assembly) -> Fold:
        """Copies are counted leaf by leaf, depth first."""
        return _fold(assembly, [0])

    def __call__(self, distances: Floats, blends: NDArray[np.float64]) -> Floats:
        """Distance (N,) of the whole by the copies' own (C, N) and the blends (C,) with which they join."""
        result: Floats | None = None
        for child in self.children:
            if isinstance(child, Fold):
                value, blend = child(distances, blends), child.blend
            else:
                value, blend = distances[child], float(blends[child])
            result = value if result is None else _join(self.operation, result, value, blend)
        assert result is not None
        return result


def _fold(node: Assembly, counter: list[int]) -> Fold:
    children: list[int | Fold] = []
    for child in node.children:
        if isinstance(child, Assembly):
            children.append(_fold(child, counter))
            continue
        copies = tuple(range(counter[0], counter[0] + len(child.copies)))
        counter[0] += len(copies)
        if node.operation == "union" or len(copies) == 1:
            children += copies
        else:
            children.append(Fold("union", copies, child.blend))
    return Fold(node.operation, tuple(children), node.blend)


def _join(operation: Operation, a: Floats, b: Floats, blend: float) -> Floats:
    if blend <= SHARP:
        if operation == "union":
            return np.minimum(a, b)
        return np.maximum(a, b if operation == "intersection" else -b)
    smooth = {"union": smooth_union, "intersection": smooth_intersection, "difference": smooth_difference}
    return smooth[operation](a, b, blend)


def siblings(assembly: Assembly) -> list[tuple[int, ...]]:
    """Leaves (by index) that one operation treats alike: all of a union, and what a difference takes away."""
    groups: list[tuple[int, ...]] = []
    order = {id(part): i for i, part in enumerate(assembly.parts)}

    def visit(node: Node, first: bool) -> None:
        if isinstance(node, Part):
            return
        alike = node.children if node.operation == "union" else node.children[1:]
        if node.operation != "intersection":
            groups.append(tuple(order[id(child)] for child in alike if isinstance(child, Part)))
        for i, child in enumerate(node.children):
            visit(child, i == 0)

    visit(assembly, True)
    return [group for group in groups if len(group) > 1]
