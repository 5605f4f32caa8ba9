"""Nodes that formats of meshes take as one thing: quadrics, which rarely end, and what intersects them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.fields import Box
from partwright.meshing import has_exact_mesh, mesh_csg

if TYPE_CHECKING:
    import trimesh


def is_atomic(node: Node) -> bool:
    """A quadric, or an intersection of leaves with quadrics among them that has an exact mesh."""
    quadrics = any(part.field.quadric() is not None for part in node.parts)
    return quadrics and (node.is_part or (node.operation == "intersection" and has_exact_mesh(node)))


def atomic_mesh(node: Node, assembly: Assembly) -> trimesh.Trimesh:
    """The closed mesh of such a node in the assembly's frame; cut off at its bounds where it does not end.

    Raises:
        NoSurfaceError: nothing of it lies there.
    """
    lower, upper = assembly.bounds()
    if not np.isfinite(node.bounds()).all() and np.isfinite([lower, upper]).all():
        node = Assembly((box_between(lower, upper), node), "intersection")
    return mesh_csg(node)


def box_between(lower: np.ndarray, upper: np.ndarray) -> Part:
    """The box of these corners (3,)."""
    return Part(Box(tuple((upper - lower).tolist())), tuple(((lower + upper) / 2).tolist()))
