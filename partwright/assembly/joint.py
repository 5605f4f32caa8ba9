"""Leaves that depend on one another are told of one another whenever an assembly is made."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any, TypeGuard

from partwright.fields.joint import JointField, Member

if TYPE_CHECKING:
    from partwright.assembly.tree import Node, Part


def joined(children: tuple[Node, ...]) -> tuple[Node, ...]:
    """The children, each joint field among the others of its shape.

    A second field of the same role begins another shape, to which those after it belong.
    """
    latest: dict[object, dict[str, int]] = {}  # the last shape of each key: its roles, and whose they are
    shapes: list[dict[str, int]] = []
    for i, child in enumerate(children):
        if is_joint(child):
            shape = latest.get(child.field.shape_key)
            if shape is None or child.field.role in shape:
                shape = latest[child.field.shape_key] = {}
                shapes.append(shape)
            shape[child.field.role] = i
    result = list(children)
    for shape in shapes:
        parts = [part for i in shape.values() if is_joint(part := children[i])]
        shared: dict[Any, Any] = {}
        for i, part in zip(shape.values(), parts, strict=True):
            result[i] = _among(part, parts, shared)
    return tuple(result)


def is_joint(node: Node) -> TypeGuard[JointPart]:
    """Whether the node is a part whose field is decoded together with others."""
    return node.is_part and isinstance(node.field, JointField)


def _among(part: JointPart, parts: list[JointPart], shared: dict[Any, Any]) -> Part:
    back = part.pose.inverse()
    seen = [(other.field, back @ other.pose) for other in parts]
    members = tuple(Member(field, pose.translation, pose.rotation) for field, pose in seen)
    if members == part.field.members:  # what it remembers of the shape still holds
        return part
    return dataclasses.replace(part, field=part.field.among(members, shared))


if TYPE_CHECKING:

    class JointPart(Part):
        field: JointField
