"""The distance of a whole assembly as a differentiable function of places and of all its parameters."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any

import torch
from torch import Tensor

from partwright.assembly import Part
from partwright.assembly.joint import is_joint
from partwright.assembly.similarity import Similarity, rotation_matrix
from partwright.assembly.tree import Node
from partwright.fields import smooth_difference, smooth_intersection, smooth_union
from partwright.fields.operations import SHARP
from partwright.goals.learned import decoded
from partwright.goals.parameters import Parameters

_FOLD = {"union": smooth_union, "intersection": smooth_intersection, "difference": smooth_difference}
_TIE = 1e-5  # of the longest side: surfaces this near take part, whatever the kernel's rounding says


class Composite:
    """An assembly with its parameters as tensors. One implementation for every kind of field.

    Each leaf is evaluated only where the whole depends on it; that is told by the compiled kernel.
    """

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.assembly = parameters.assembly
        self._expanded = self.assembly.expanded()
        # Each copy: which part it is of, and the move that makes it.
        self._leaves = list(_leaves(self.assembly, {p.name: i for i, p in enumerate(self.assembly.parts)}))

    def distance(self, points: Tensor, theta: Tensor) -> Tensor:
        """(N,) float64 at points (N, 3) float64 for theta (D,) float64 that equals the parameters' values.

        Differentiable once by both.
        """
        base = self._expanded.part_distances(points.detach().numpy())
        values = torch.tensor(base, dtype=torch.float64)
        active = self._active(values)
        columns: list[Tensor] = []
        for joint, group in groupby(enumerate(self._leaves), key=lambda item: self._joint(item[1])):
            some = list(group)
            if joint is not None:
                columns += self._decoded(some, active, values, points, theta)
                continue
            for k, (index, move) in some:
                where = active[k].nonzero().squeeze(1)
                near = self._leaf(index, move, points[where], theta)
                columns.append(values[k].index_put((where,), near))
        return self._folded(iter(columns), theta)

    def _active(self, values: Tensor) -> Tensor:
        """(K, N) bool: copies on whose distance the whole's depends, or may."""
        apart = values.clone().requires_grad_()
        whole = self._folded(iter(apart.unbind(0)), torch.tensor(self.parameters.values))
        (slope,) = torch.autograd.grad(whole.sum(), apart)
        near = (values.abs() < _TIE * self.parameters.longest) & (whole.detach().abs() < self._cell)
        return (slope.abs() > 0) | near

    @property
    def _cell(self) -> float:
        return 1e-2 * self.parameters.longest

    def _leaf(self, index: int, move: Similarity, points: Tensor, theta: Tensor) -> Tensor:
        part = self.assembly.parts[index]
        own = theta[self.parameters.slices[index]]
        back = move.inverse()
        turn, place = points.new_tensor(rotation_matrix(back.rotation)), points.new_tensor(back.translation)
        local = (points @ turn.T + place - own[:3]) @ points.new_tensor(rotation_matrix(part.rotation))
        local = local - torch.linalg.cross(own[3:6].expand_as(local), local)
        form = own[6 : len(own) - (part.blend > SHARP)]
        return self.parameters.forms[index].distance(local, form)

    def _joint(self, leaf: tuple[int, Similarity]) -> Any:
        part = self.assembly.parts[leaf[0]]
        return part.field.shape_key if is_joint(part) and leaf[1] == Similarity() else None

    def _decoded(
        self,
        some: list[tuple[int, tuple[int, Similarity]]],
        active: Tensor,
        values: Tensor,
        points: Tensor,
        theta: Tensor,
    ) -> list[Tensor]:
        """Columns of neighbouring leaves of one learned shape."""
        where = active[[k for k, _ in some]].any(dim=0).nonzero().squeeze(1)
        leaves = []
        for _, (index, _) in some:
            part, own = self.assembly.parts[index], theta[self.parameters.slices[index]]
            leaves.append((part, own[: len(own) - (part.blend > SHARP)]))
        near = decoded(leaves, points[where])
        return [values[k].index_put((where,), row) for (k, _), row in zip(some, near, strict=True)]

    def _folded(self, columns: Iterator[Tensor], theta: Tensor) -> Tensor:
        result, _ = self._node(self.assembly, columns, theta, iter(self._leaves))
        return result

    def _node(
        self, node: Node, columns: Iterator[Tensor], theta: Tensor, leaves: Iterator[tuple[int, Similarity]]
    ) -> tuple[Tensor, Any]:
        """Distance and blend of a node, its leaves' distances taken from `columns` in their order."""
        if node.is_part and not node.instances:
            index, _ = next(leaves)
            blend = theta[self.parameters.slices[index]][-1] if node.blend > SHARP else 0.0
            return next(columns), blend
        operands = [self._node(child, columns, theta, leaves) for child in node.operands]
        result = operands[0][0]
        for value, blend in operands[1:]:
            result = _FOLD[node.operation](result, value, blend)
        if node.is_part:
            return result, operands[0][1]
        return result, node.blend


def _leaves(node: Node, index: dict[str, int]) -> Iterator[tuple[int, Similarity]]:
    """Copies in the order in which the tree is folded."""
    for part in node.parts:
        own: Part = part
        yield index[own.name], Similarity()
        yield from ((index[own.name], move) for move in own.instances)
