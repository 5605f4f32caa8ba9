"""A B-rep solid of flat facets, for what OpenCASCADE cannot build of analytic faces.

The mesh's own corners and edges are those of the solid, each there once, so that it closes by construction:
sewing loose triangles together does not where edges nearly touch. Triangles of one plane are one face.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_topology import side_by_side
from partwright.export.plane_patches import boundary_loops, patches, twins_of
from partwright.meshing.csg import solid_of
from partwright.meshing.manifolds import simplified, surface_of
from partwright.shapes.topology import components, signed_volumes

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shape, TopoDS_Solid, TopoDS_Vertex

    from partwright.assembly import Node

CHORD = 1 / 400  # of the longest side: how far facets may lie from the surface
SHORTEST = 1e-4  # of the longest side: shorter edges are collapsed, which OpenCASCADE would stumble over
FLAT = 1e-6  # of the longest side: how far corners of a face may lie from its plane


class FacetsWarning(UserWarning):
    """A file holds flat facets where its format could hold the surfaces themselves, or is not valid."""


def faceted(node: Node, fine: bool = False) -> TopoDS_Shape:
    """The exact mesh of a node of quadrics and named solids as a solid, or several where it is in pieces.

    fine: facets as near to the surface, by the node's shortest side.

    Raises:
        NoSurfaceError: nothing is left of the node, or its facets are too small.
    """
    sides = np.ptp(np.array(node.bounds()), axis=0)
    longest = float(sides.max())
    chord = CHORD * float(sides.min() if fine else longest)
    places, triangles = surface_of(simplified(solid_of(node, chord), SHORTEST * longest))
    if not len(triangles):
        raise NoSurfaceError("nothing is left of a node to be written as facets")
    try:
        return flat_faced(places, triangles, FLAT * longest)
    except opencascade_errors() as error:
        raise NoSurfaceError("the facets of a node are too small for a B-rep; export a mesh") from error


def flat_faced(places: np.ndarray, triangles: np.ndarray, flat: float) -> TopoDS_Shape:
    """A closed mesh as a solid of planes, or a compound of as many as it has pieces; cavities stay.

    places (V, 3), triangles (F, 3) indices, outwards. flat: how far a face's corners may lie from its plane,
    a length.
    """
    return side_by_side([_solid(places, shells, flat) for shells in _pieces(places, triangles)])


def _pieces(places: np.ndarray, triangles: np.ndarray) -> list[list[np.ndarray]]:
    """The triangles of each solid: those of its outside, then those of each of its cavities."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]]])
    of_triangle = components(len(places), *ends.T)[triangles[:, 0]]
    found, shell_of = np.unique(of_triangle, return_inverse=True)
    shells = [triangles[shell_of == one] for one in range(len(found))]
    volumes = signed_volumes(places, triangles, shell_of).tolist()
    boxes = [(places[shell].min(axis=(0, 1)), places[shell].max(axis=(0, 1))) for shell in shells]
    outsides = sorted((i for i, volume in enumerate(volumes) if volume > 0), key=lambda i: volumes[i])
    pieces = {i: [shells[i]] for i in outsides}
    for i, volume in enumerate(volumes):
        around = [
            o for o in outsides if (boxes[o][0] < boxes[i][0]).all() and (boxes[o][1] > boxes[i][1]).all()
        ]
        if volume <= 0 and around:
            pieces[around[0]].append(shells[i])
    return list(pieces.values())


def _solid(places: np.ndarray, shells: list[np.ndarray], flat: float) -> TopoDS_Solid:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

    builder, solid = BRep_Builder(), TopoDS_Solid()
    builder.MakeSolid(solid)
    for triangles in shells:
        shell, edges = TopoDS_Shell(), _Edges(places, flat)
        builder.MakeShell(shell)
        twins = twins_of(triangles)
        of_face, planes = patches(places, triangles, twins, flat)
        for loops, (middle, normal) in zip(boundary_loops(triangles, twins, of_face), planes, strict=True):
            builder.Add(shell, edges.face(loops, middle, normal))
        shell.Closed(True)
        builder.Add(solid, shell)
    return solid


class _Edges:
    """A shell's corners and edges, each made once: faces that meet share them."""

    def __init__(self, places: np.ndarray, tolerance: float) -> None:
        self._places, self._tolerance = places, tolerance
        self._corners: dict[int, TopoDS_Vertex] = {}
        self._edges: dict[tuple[int, int], TopoDS_Edge] = {}

    def face(self, loops: list[list[int]], middle: np.ndarray, normal: np.ndarray) -> TopoDS_Face:
        """A plane within loops of corners, which go around it to the left."""
        from OCP.BRep import BRep_Builder
        from OCP.Geom import Geom_Plane
        from OCP.gp import gp_Dir, gp_Pnt
        from OCP.TopoDS import TopoDS_Face, TopoDS_Wire

        builder, face = BRep_Builder(), TopoDS_Face()
        plane = Geom_Plane(gp_Pnt(*middle.tolist()), gp_Dir(*normal.tolist()))
        builder.MakeFace(face, plane, self._tolerance)
        for loop in loops:
            wire = TopoDS_Wire()
            builder.MakeWire(wire)
            for start, end in zip(loop, [*loop[1:], loop[0]], strict=True):
                builder.Add(wire, self._edge(start, end))
            wire.Closed(True)
            builder.Add(face, wire)
        return face

    def _edge(self, start: int, end: int) -> TopoDS_Shape:
        from OCP.BRep import BRep_Builder
        from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge

        key = (min(start, end), max(start, end))
        if key not in self._edges:
            edge = BRepBuilderAPI_MakeEdge(self._corner(key[0]), self._corner(key[1])).Edge()
            BRep_Builder().UpdateEdge(edge, self._tolerance)
            self._edges[key] = edge
        edge = self._edges[key]
        return edge if start == key[0] else edge.Reversed()

    def _corner(self, index: int) -> TopoDS_Vertex:
        from OCP.BRep import BRep_Builder
        from OCP.gp import gp_Pnt
        from OCP.TopoDS import TopoDS_Vertex

        if index not in self._corners:
            corner = TopoDS_Vertex()
            BRep_Builder().MakeVertex(corner, gp_Pnt(*self._places[index].tolist()), 2 * self._tolerance)
            self._corners[index] = corner
        return self._corners[index]
