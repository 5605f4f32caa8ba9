"""Nodes that formats of meshes take as one thing: quadrics, which rarely end, and what is cut by others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.assembly.tree import Operation
from partwright.errors import NoSurfaceError
from partwright.fields import Box
from partwright.meshing import has_exact_mesh, lean_assembly, mesh_assembly, mesh_csg

if TYPE_CHECKING:
    import trimesh

_CELLS = 64  # along the longest side of what has no exact mesh


def is_atomic(node: Node) -> bool:
    """A quadric, or an intersection of leaves with quadrics among them that has an exact mesh."""
    quadrics = any(part.field.quadric() is not None for part in node.parts)
    return quadrics and (node.is_part or (node.operation == "intersection" and has_exact_mesh(node)))


def is_operation(node: Node, operation: Operation) -> bool:
    """Whether the node is an assembly of that operation."""
    return isinstance(node, Assembly) and node.operation == operation


def check_ends(assembly: Assembly) -> None:
    """Raises NoSurfaceError for an assembly without end, of which no scene could show all that there is."""
    box = assembly.bounds()
    if not np.isfinite(box).all():
        axes = ", ".join(axis for axis, low, high in zip("xyz", *box, strict=True) if not high - low < np.inf)
        raise NoSurfaceError(f"the assembly does not end along {axes}; intersect it with what bounds it")


def atomic_mesh(node: Node, assembly: Assembly, lean: bool = True) -> trimesh.Trimesh:
    """The closed mesh of such a node in the assembly's frame; cut off at its bounds where it does not end.

    lean: with no more triangles than it needs.

    Raises:
        NoSurfaceError: nothing of it lies there.
    """
    lower, upper = assembly.bounds()
    if not np.isfinite(node.bounds()).all() and np.isfinite([lower, upper]).all():
        node = Assembly((box_between(lower, upper), node), "intersection")
    if has_exact_mesh(node):
        return mesh_csg(node)
    return lean_assembly(node, _CELLS) if lean else mesh_assembly(node, _CELLS)


def box_between(lower: np.ndarray, upper: np.ndarray) -> Part:
    """The box of these corners (3,)."""
    return Part(Box(tuple((upper - lower).tolist())), tuple(((lower + upper) / 2).tolist()))
