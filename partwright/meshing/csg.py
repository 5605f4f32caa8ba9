"""Exact meshes of trees of quadrics and named solids: booleans of closed meshes (manifold3d).

Edges are sharp where surfaces meet. Flat faces are exact; curved ones are tessellated to a tolerance, with
their corners on the surface.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Part
from partwright.assembly.placed import placed_quadric
from partwright.assembly.similarity import rotation_matrix
from partwright.assembly.tree import Node
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import Field, normal_form
from partwright.meshing.manifolds import simplified, surface_of
from partwright.meshing.named_solids import is_named, named_solid
from partwright.meshing.quadric_solids import half_space, quadric_solid
from partwright.meshing.small_components import components
from partwright.meshing.welding import welded

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold

TOLERANCE = 2.5e-4  # of the longest side
_NUDGE = 5e-7  # of the longest side
_SLIT = 1e-4  # of the area, that more than what growing itself changes is no chance
MOST_PARTS = 10_000  # copies counted: these take a minute, and gigabytes where they are curved
_STEP = 3  # by which a node's nudge outdoes those within it
_ROOM = 0.02  # of the longest side, around the bounds


def check_count(node: Node) -> None:
    """Raises ParameterError for more parts than are joined into one surface, before any work."""
    count = sum(1 + len(part.instances) for part in node.parts)
    if count > MOST_PARTS:
        raise ParameterError(
            f"{count:,} parts, copies counted; at most {MOST_PARTS:,} are joined into one surface: "
            "take pieces of the assembly by themselves, or GLB, where copies that are not cut stay copies"
        )


def has_exact_mesh(node: Node) -> bool:
    """Whether all leaves are quadrics or named solids, and none of them is blended."""
    if node.is_part:
        return _is_exact(node.field) and not (node.instances and node.blend)
    blended = any(child.blend for child in node.children[1:])
    return not blended and all(has_exact_mesh(child) for child in node.children)


def _is_exact(field: Field) -> bool:
    return is_named(field) or field.quadric() is not None


def mesh_csg(node: Node, tolerance: float | None = None) -> trimesh.Trimesh:
    """The solid's surface, closed, with sharp edges, in own units and place.

    tolerance: how far a chord may lie from its curved surface, in own units; 1/4000 of the longest side if
    not given.

    Raises:
        NoSurfaceError: nothing is left, or the solid does not end.
        ParameterError: a leaf is neither a quadric nor a named solid, or is blended, or there are too many.
    """
    import trimesh

    return trimesh.Trimesh(*welded(*surface_of(solid_of(node, tolerance))), process=False)


def solid_of(node: Node, tolerance: float | None = None) -> Manifold:
    """As `mesh_csg`, the manifold3d solid; it knows its volume, area and genus."""
    if not has_exact_mesh(node):
        raise ParameterError("the exact mesh needs leaves that are quadrics or named solids, without blends")
    check_count(node)
    box = node.bounds()
    if not np.isfinite(box).all():
        axes = ", ".join(axis for axis, low, high in zip("xyz", *box, strict=True) if not high - low < np.inf)
        raise NoSurfaceError(f"the solid does not end along {axes}; intersect it with what bounds it")
    longest = float(np.ptp(box, axis=0).max())
    if longest <= 0:
        raise NoSurfaceError("nothing is left of the solid: its parts have no point in common")
    room = _ROOM * longest
    grown = box + np.array([[-room], [room]])
    solid = _Builder(grown, tolerance or TOLERANCE * longest).solid(node)
    lower, upper = np.reshape(solid.bounding_box(), (2, 3)) if not solid.is_empty() else grown
    if (lower < box[0] - room / 2).any() or (upper > box[1] + room / 2).any():
        solid = solid ^ _cuboid(grown)
    if solid.is_empty():
        raise NoSurfaceError("nothing is left of the solid: its parts have no point in common")
    return solid


class _Builder:
    """Solids that are right within a box, at one tolerance."""

    def __init__(self, box: np.ndarray, tolerance: float) -> None:
        self.box, self.tolerance = box, tolerance
        self._nudges: dict[int, int] = {}  # of each node, by its identity: how many are within one another

    def solid(self, node: Node) -> Manifold:
        if node.is_part and not node.instances:
            return self.leaf(node)
        if node.operation == "intersection":
            return self.intersection(node, node.operands)
        return self.joined(node, node.operands, node.operation == "difference")

    def joined(self, node: Node, children: tuple[Node, ...], subtract: bool) -> Manifold:
        """The union of solids, or the first minus the others.

        Faces that were meant to touch differ by rounding once they are turned, and leave a slit or a skin
        without width between them. It shows: with every solid (but the first of a difference) larger by
        a share of the box, the result has another topology, or where a slit is open to a side, less area, and
        that is the one that was meant. The share outdoes those by which solids within these were made larger,
        and no others: it shows in the volume.
        """
        from manifold3d import Manifold, OpType

        operation = OpType.Subtract if subtract else OpType.Add
        solids = [self.solid(child) for child in children]
        plain = Manifold.batch_boolean(solids, operation)
        within = self._nudges[id(node)] = max(self._nudges.get(id(child), 0) for child in children)
        if len(solids) < 2:
            return plain
        further = _NUDGE * _STEP**within * float(np.ptp(self.box, axis=0).max())
        larger = [self.larger(child, one, further) for child, one in zip(children, solids, strict=True)]
        clear = Manifold.batch_boolean([solids[0], *larger[1:]] if subtract else larger, operation)
        pairs = zip(larger, solids, strict=True)
        own = sum(abs(big.surface_area() - one.surface_area()) for big, one in pairs)
        slit = abs(plain.surface_area() - clear.surface_area()) > _SLIT * plain.surface_area() + 2 * own
        if not slit and _topology(plain) == _topology(clear):
            return plain
        self._nudges[id(node)] = within + 1
        return simplified(clear, 4 * further)

    def larger(self, node: Node, solid: Manifold, nudge: float) -> Manifold:
        """The solid of a node with every side further out by `nudge`: along a leaf's own axes."""
        if not node.is_part or node.instances or not is_named(node.field):
            return _larger(solid, nudge)
        return _placed(_larger(named_solid(node.field, self.tolerance), nudge), node)

    def intersection(self, node: Node, children: tuple[Node, ...]) -> Manifold:
        """The box cut by the planes one by one, which is exact and fast, then by the others."""
        from manifold3d import Manifold, OpType

        region, others = _cuboid(self.box), []
        for child in children:
            plane = _plane(child)
            if plane is None:
                others.append(self.solid(child))
            else:
                region = half_space(region, *plane)
        self._nudges[id(node)] = max((self._nudges.get(id(child), 0) for child in children), default=0)
        return Manifold.batch_boolean([region, *others], OpType.Intersect) if others else region

    def leaf(self, part: Part) -> Manifold:
        quadric = placed_quadric(part)
        if quadric is not None:
            return quadric_solid(quadric, self.box, self.tolerance)
        return _placed(named_solid(part.field, self.tolerance), part)


def _topology(solid: Manifold) -> tuple[int, int]:
    if solid.is_empty():
        return 0, 0
    mesh = solid.to_mesh()  # `decompose` would tell, in time that grows with the square of the answer
    return solid.genus(), components(np.asarray(mesh.tri_verts), len(mesh.vert_properties))[0]


def _larger(solid: Manifold, nudge: float) -> Manifold:
    """Stretched so that every side of its box lies further out by `nudge`."""
    if solid.is_empty():
        return solid
    lower, upper = np.reshape(solid.bounding_box(), (2, 3))
    middle, factor = (lower + upper) / 2, 1 + 2 * nudge / np.maximum(upper - lower, nudge)
    return solid.translate(tuple(-middle)).scale(tuple(factor)).translate(tuple(middle))


def _placed(solid: Manifold, part: Part) -> Manifold:
    return solid.transform(np.column_stack([rotation_matrix(part.rotation), part.translation]))


def _plane(node: Node) -> tuple[np.ndarray, np.ndarray] | None:
    """Normal and a point, both (3,), of a leaf that is a half-space."""
    quadric = placed_quadric(node) if node.is_part and not node.instances else None
    if quadric is None or not quadric.is_plane:
        return None
    form = normal_form(quadric)
    return form.axes[:, 2] * (-1.0 if form.complement else 1.0), form.centre


def _cuboid(box: np.ndarray) -> Manifold:
    from manifold3d import Manifold

    return Manifold.cube(tuple((box[1] - box[0]).tolist())).translate(tuple(box[0].tolist()))
