"""Differences and intersections as convex solids, for engines that collide nothing else.

The tree says where the holes are, so no search over cutting planes is needed: what is left of a convex solid
around a convex hole are the slices that planes touching the hole cut off it, one after the other. The hole
itself stays free: whatever fits through it still does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.atomic_nodes import box_between
from partwright.approximation.convex import segments, wedges
from partwright.assembly import Assembly, Node, Part
from partwright.errors import NoSurfaceError
from partwright.fields import Quadric
from partwright.fields.quadric_forms import SAME
from partwright.meshing import mesh_assembly, mesh_part
from partwright.meshing.csg import has_exact_mesh, solid_of

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

_CHORDS = 1.02  # a convex solid's hull over its volume, where faces are curved
_ROOM = 0.25  # of a hole's width: how far at most a corner of what is cut free may lie from the hole
_KEPT = 0.7  # of the volume around a hole: with less, slices go nearer to it
_FINEST = 0.01  # of a hole's width: nearer they never go
_FILLED = 0.1  # of the volume: holes above it are never filled
_SLIVER = 1e-4  # of the volume: slices below it are left out
_ROUNDING = 1e-6  # of the size: how far a corner may lie beyond a face of its hull
_CHORD = 0.05  # of `allowed`: what curved faces may lose, so that hulls have few corners
_CELLS = 48  # along what has no exact mesh


def convex_pieces(node: Node, allowed: float) -> list[trimesh.Trimesh]:
    """Convex meshes that together are the node; small holes no wider than `allowed` (a length) are filled.

    Raises:
        NoSurfaceError: it has no volume.
    """
    import trimesh

    found = [solid.to_mesh64() for solid in _convex_solids(node, allowed)]
    if not found:
        raise NoSurfaceError(f"{node.name or 'a difference'}: nothing is left of it")
    return [
        trimesh.Trimesh(np.asarray(mesh.vert_properties)[:, :3], mesh.tri_verts, process=False)
        for mesh in found
    ]


def separated(node: Node) -> Iterator[Node]:
    """Nodes whose union is the node: a difference of a union is the union of its children's differences, each
    with what cuts into it; a child that nothing cuts into is itself again."""
    if not isinstance(node, Assembly) or node.operation == "intersection":
        yield node
    elif node.operation == "union":
        for child in node.operands:
            yield from separated(child)
    else:
        first, *cutters = node.operands
        for child in separated(first):
            cutting = [cutter for cutter in cutters if _common(child, cutter, None) is not None]
            yield Assembly((child, *cutting), "difference", child.name) if cutting else child


def _convex_solids(node: Node, allowed: float, room: Part | None = None) -> list[Manifold]:
    """Convex solids that together are the node, or what of it lies in a room: a node within a difference may
    be endless."""
    solid = _common(room, node, _CHORD * allowed) if room else _solid(node, _CHORD * allowed)
    if solid is None:
        return []
    hull = solid.hull()
    cut = isinstance(node, Assembly) and node.operation == "difference"
    if hull.volume() <= (1 if cut else _CHORDS) * solid.volume() + _ROUNDING * hull.volume():
        return [hull]
    if node.is_part and node.field.quadric() is not None:
        return [one.hull() for one in solid.decompose()]
    if isinstance(node, Part) and not node.instances:
        return [_manifold(mesh) for one in segments(node, allowed) for mesh in wedges(one, allowed, _CELLS)]
    if isinstance(node, Part) or node.operation == "union":
        return [one for child in node.operands for one in _convex_solids(child, allowed, room)]
    if node.operation == "intersection":
        node = _without_concave(node)
        if node.operation == "intersection":
            return [one.hull() for one in solid.decompose()]
    first, *cutters = node.operands
    box = box_between(*np.reshape(solid.bounding_box(), (2, 3)))
    pieces = _convex_solids(first, allowed, box)
    for cutter in cutters:
        for hole in _convex_solids(cutter, allowed, box):
            pieces = [left for piece in pieces for left in _without(piece, hole, allowed)]
    return pieces


def _without_concave(node: Assembly) -> Assembly:
    """An intersection with the outsides of convex quadrics, as the rest minus those quadrics."""
    rest: list[Node] = []
    taken: list[Node] = []
    for child in node.children:
        quadric = child.field.quadric() if child.is_part and not child.instances else None
        if child.is_part and quadric is not None and _is_concave(quadric):
            taken.append(replace(child, field=quadric.complement()))
        else:
            rest.append(child)
    if not taken or not rest:
        return node
    return Assembly((Assembly(tuple(rest), "intersection"), *taken), "difference")


def _is_concave(quadric: Quadric) -> bool:
    """Whether it is the outside of something convex and curved."""
    bend = np.linalg.eigvalsh(quadric.matrices()[0])
    size = np.abs(quadric.coefficients).max()
    return bool(bend.max() <= SAME * size and bend.min() < -SAME * size)


def _without(solid: Manifold, hole: Manifold, allowed: float) -> list[Manifold]:
    """The slices of a convex solid around a convex hole."""
    common, least = (solid ^ hole).hull(), _SLIVER * solid.volume()
    if common.volume() <= least:
        return [solid]
    normals, offsets = _planes(common)
    width = float((offsets - (_corners(common) @ normals.T).min(axis=0)).min())
    if width <= allowed and common.volume() <= _FILLED * solid.volume():
        return [solid]
    left = (solid - common).volume()
    room, slices, rest = min(allowed, _ROOM * width), [], solid
    while left > least:
        beyond = _corners(rest) @ normals.T - offsets
        far = beyond[beyond.max(axis=1, initial=-np.inf) > room]
        if len(far):
            face = int(far.clip(min=0).sum(axis=0).argmax())  # what cuts most of the far corners off
            outer, rest = rest.split_by_plane(tuple(normals[face]), float(offsets[face]))
            slices.append(outer)
        elif sum(one.volume() for one in slices) < _KEPT * left and room > _FINEST * width:
            room, slices, rest = room / 2, [], solid
        else:
            break
    return [one for one in slices if one.volume() > least]


def _common(a: Node, b: Node, tolerance: float | None) -> Manifold | None:
    """What two nodes have in common, one of them perhaps endless; None where that is nothing."""
    try:
        both = Assembly((a, b), "intersection")
        solid = solid_of(both, tolerance) if has_exact_mesh(both) else _solid(a, None) ^ _solid(b, None)
    except NoSurfaceError:
        return None
    return None if solid.is_empty() or solid.volume() <= 0 else solid


def _solid(node: Node, tolerance: float | None) -> Manifold:
    if has_exact_mesh(node):
        return solid_of(node, tolerance)
    return _manifold(mesh_part(node, _CELLS) if isinstance(node, Part) else mesh_assembly(node, _CELLS))


def _manifold(mesh: trimesh.Trimesh) -> Manifold:
    from manifold3d import Manifold, Mesh64

    vertices, faces = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.uint64)
    return Manifold(Mesh64(vertices, faces))


def _corners(solid: Manifold) -> np.ndarray:
    return np.asarray(solid.to_mesh64().vert_properties)[:, :3]


def _planes(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Outward unit normals (F, 3) and offsets (F,) of a convex solid's faces, but for slivers: theirs are
    rounding."""
    mesh = solid.to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3]
    a, b, c = corners[np.asarray(mesh.tri_verts, dtype=np.int64).T]
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    normals, a = normals[length > 0] / length[length > 0, None], a[length > 0]
    offsets = (normals * a).sum(axis=1)
    beyond = (corners @ normals.T).max(axis=0) - offsets
    touching = beyond <= _ROUNDING * np.ptp(corners, axis=0).max()
    return normals[touching], offsets[touching]
