"""Nodes that formats of meshes take as one thing: quadrics, which rarely end, and what intersects them."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.fields import Box, Quadric
from partwright.meshing import has_exact_mesh, mesh_csg

if TYPE_CHECKING:
    import trimesh


def is_whole(node: Node) -> bool:
    """A quadric, or an intersection of leaves with quadrics among them that has an exact mesh."""
    if isinstance(node, Part):
        return isinstance(node.field, Quadric)
    quadrics = any(isinstance(part.field, Quadric) for part in node.parts)
    return quadrics and node.operation == "intersection" and has_exact_mesh(node)


def whole_mesh(node: Node, assembly: Assembly) -> trimesh.Trimesh:
    """The closed mesh of such a node in the assembly's frame; cut off at its bounds where it does not end.

    Raises:
        NoSurfaceError: nothing of it lies there.
    """
    lower, upper = assembly.bounds()
    if not np.isfinite(node.bounds()).all() and np.isfinite([lower, upper]).all():
        x, y, z = ((lower + upper) / 2).tolist()
        box = Part(Box(tuple((upper - lower).tolist())), (x, y, z))
        node = Assembly((box, node), "intersection")
    return mesh_csg(node)


def free_name(wanted: str, taken: set[str]) -> str:
    """The name, or it with the first free number behind it, which is then taken."""
    name = next(n for i in count(1) if (n := wanted if i == 1 else f"{wanted}_{i:02d}") not in taken)
    taken.add(name)
    return name
