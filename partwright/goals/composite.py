"""The distance of a whole assembly as a differentiable function of places and of all its parameters."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import torch
from torch import Tensor

from partwright.assembly import Part
from partwright.assembly.joint import is_joint
from partwright.assembly.similarity import Similarity, rotation_matrix
from partwright.assembly.tree import Node
from partwright.fields import smooth_difference, smooth_intersection, smooth_union
from partwright.fields.joint import JointField
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
        self._groups = self._grouped()

    def distance(self, points: Tensor, theta: Tensor) -> Tensor:
        """(N,) float64 at points (N, 3) float64 for theta (D,) float64 that equals the parameters' values.

        Differentiable once by both.
        """
        base = self._expanded.part_distances(points.detach().numpy())
        values = torch.tensor(base, dtype=torch.float64)
        active = self._active(values)
        columns: list[Tensor] = []
        for group in self._groups:
            where = active[group].any(dim=0).nonzero().squeeze(1)
            near = self._alone(group, points[where], theta)
            columns += [values[k].index_put((where,), one) for k, one in zip(group, near, strict=True)]
        return self._folded(iter(columns), theta)

    def part(self, index: int, points: Tensor, theta: Tensor) -> Tensor:
        """(N,) of one part alone, the nearest of its copies; theta and points as in `distance`."""
        columns = [
            column
            for group in self._groups
            if any(self._leaves[k][0] == index for k in group)
            for k, column in zip(group, self._alone(group, points, theta), strict=True)
            if self._leaves[k][0] == index
        ]
        return torch.stack(columns).amin(dim=0)

    def _alone(self, group: list[int], points: Tensor, theta: Tensor) -> Sequence[Tensor]:
        """(N,) of each leaf of a group."""
        if self._key(group[0]) is None:
            return [self._leaf(*self._leaves[group[0]], points, theta)]
        leaves = []
        for k in group:
            index, _ = self._leaves[k]
            part, own = self.assembly.parts[index], theta[self.parameters.slices[index]]
            leaves.append((part, own[: len(own) - (part.blend > SHARP)]))
        return decoded(leaves, points).unbind(0)

    def _key(self, leaf: int) -> object:
        """What a leaf shares with those that are decoded beside it; None for one by itself."""
        index, move = self._leaves[leaf]
        part = self.assembly.parts[index]
        return part.field.shape_key if is_joint(part) and move == Similarity() else None

    def _grouped(self) -> list[list[int]]:
        """Leaves in runs that are evaluated in one go: the parts of one learned shape, or one by itself."""
        groups: list[list[int]] = []
        roles: set[str] = set()
        for k, (index, _) in enumerate(self._leaves):
            field, key = self.assembly.parts[index].field, self._key(k)
            if not isinstance(field, JointField) or key is None:
                groups.append([k])
            elif groups and self._key(groups[-1][0]) == key and field.role not in roles:
                groups[-1].append(k)
                roles.add(field.role)
            else:
                groups.append([k])
                roles = {field.role}
        return groups

    def _active(self, values: Tensor) -> Tensor:
        """(K, N) bool: copies on whose distance the whole's depends, or may."""
        apart = values.clone().requires_grad_()
        whole = self._folded(iter(apart.unbind(0)), torch.tensor(self.parameters.values))
        (slope,) = torch.autograd.grad(whole.sum(), apart)
        return (slope.abs() > 0) | (values.abs() < _TIE * self.parameters.longest)

    def _leaf(self, index: int, move: Similarity, points: Tensor, theta: Tensor) -> Tensor:
        part = self.assembly.parts[index]
        own = theta[self.parameters.slices[index]]
        back = move.inverse()
        turn, place = points.new_tensor(rotation_matrix(back.rotation)), points.new_tensor(back.translation)
        local = (points @ turn.T + place - own[:3]) @ points.new_tensor(rotation_matrix(part.rotation))
        local = local - torch.linalg.cross(own[3:6].expand_as(local), local)
        form = own[6 : len(own) - (part.blend > SHARP)]
        return self.parameters.forms[index].distance(local, form)

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
