"""An assembly as the solids that a physics engine collides, and meshes where no solid is near enough."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.change import Change
from partwright.approximation.convex import segments, wedges
from partwright.approximation.decomposition import convex_pieces
from partwright.approximation.nearest import Approximation, nearest_solid
from partwright.approximation.pieces import Piece, piece_mesh, pieces, require_some
from partwright.assembly import Assembly, Node, Part
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import Field, Solid
from partwright.meshing import mesh_part
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    import trimesh

TOLERANCE = 0.05  # of the longest side: how far a solid's surface may lie from its part's
_MOST_ERROR = 0.3  # of its volume: thin parts are within any tolerance of much
_SPACING = 0.04  # of its size: between the points of a hull that are held against what it stands for
_COMPARED = 32  # cells along what is compared


@dataclass(frozen=True)
class Geometry:
    """A piece in the format's terms: `part`, placed, holds a solid; else `mesh` stands for it."""

    name: str
    colour: np.ndarray
    part: Part | None
    mesh: trimesh.Trimesh | None


def geometries(
    assembly: Assembly,
    kinds: Sequence[type[Field]],
    tolerance: float,
    resolution: int,
    *,
    convex: bool,
    length: float = 1.0,
) -> tuple[list[Geometry], list[Change]]:
    """Each piece as one of `kinds`, or as a mesh where none is near enough.

    The changes are those that the file makes to the assembly.

    tolerance: share of the assembly's longest side. resolution: cells along a part that becomes a mesh.
    convex: the engine collides the convex hull of a mesh, so that is what a mesh is.
    length: of the assembly's unit of length in the unit that changes are to be told in.

    Raises:
        NothingToExportError: no piece has a volume.
        ParameterError: the tolerance is not a number of at least 0.
    """
    if isinstance(tolerance, bool) or not isinstance(tolerance, int | float) or not 0 <= tolerance < np.inf:
        raise ParameterError(f"tolerance: expected a share of the longest side, 0.05 say, got {tolerance!r}")
    lower, upper = assembly.bounds()
    allowed = tolerance * float((upper - lower).max())
    result: list[Geometry] = []
    changes: list[Change] = []
    for piece in pieces(assembly, separate=True):
        try:
            found, change = _stand_ins(piece, kinds, allowed, resolution, convex)
        except NoSurfaceError as nothing:
            changes.append(Change(piece.part_names, "nothing", note=str(nothing)))
            continue
        result += found
        if change is not None or piece.blend:
            kind = found[0].part.field.kind if found[0].part else ""
            told = change or Change(piece.part_names, kind, 0.0, 0.0)
            deviation = (told.max_deviation or 0.0) * length
            changes.append(
                dataclasses.replace(told, max_deviation=deviation, blend_dropped=piece.blend * length)
            )
    return require_some(assembly, result), changes


def _stand_ins(
    piece: Piece, kinds: Sequence[type[Field]], allowed: float, resolution: int, convex: bool
) -> tuple[list[Geometry], Change | None]:
    """What stands for a piece, and the change that this is: the first of these that is near enough.

    A solid; its hull, where only hulls collide; solids along the arc of a bent part; the hulls of the pieces
    of a bent or hollow part, or of a difference; its mesh.
    """
    names = piece.part_names
    part = piece.node if isinstance(piece.node, Part) else None
    if part is not None:
        near = nearest_solid(part, kinds)
        if _alike(near, allowed):
            change = Change(names, near.solid.kind, near.volume_error_ratio, near.max_deviation)
            return [Geometry(piece.name, piece.colour, near.part_with_solid, None)], (
                None if near.exact else change
            )
    mesh, error, deviation = _mesh(piece, resolution, convex)
    whole = [Geometry(piece.name, piece.colour, None, mesh)]
    mesh_change = Change(names, "convex mesh" if convex else "mesh", error, deviation)
    if convex and deviation <= allowed and error <= _MOST_ERROR:
        return whole, mesh_change
    if part is None:
        return _decomposed(piece, allowed) if convex else (whole, mesh_change)
    if part.field.superfrustum() is None:
        return whole, mesh_change  # it has no arc and no hole to go by
    chain = _chain(piece, part, kinds, allowed, resolution)
    if all(geometry.part for geometry in chain):
        return chain, _compared(piece, chain, f"chain of {len(chain)} solids")
    if not convex or len(chain) == 1:
        return whole, mesh_change
    return chain, _compared(piece, chain, f"{len(chain)} convex pieces")


def _decomposed(piece: Piece, allowed: float) -> tuple[list[Geometry], Change]:
    """The convex pieces of a difference or intersection."""
    found = _numbered(piece, convex_pieces(piece.node, allowed))
    return found, _compared(piece, found, f"{len(found)} convex pieces")


def _chain(
    piece: Piece, part: Part, kinds: Sequence[type[Field]], allowed: float, resolution: int
) -> list[Geometry]:
    """The straight segments of a part as solids, or the hulls of their wedges."""
    forms: list[Part | trimesh.Trimesh] = []
    named = [kind for kind in kinds if issubclass(kind, Solid)]
    for segment in segments(part, allowed):
        try:
            near = nearest_solid(segment, named)
        except NoSurfaceError:
            continue  # a segment beyond a tip
        if _alike(near, allowed):
            forms.append(near.part_with_solid)
        else:
            forms += wedges(segment, allowed, resolution)
    return _numbered(piece, forms)


def _numbered(piece: Piece, forms: Sequence[Part | trimesh.Trimesh]) -> list[Geometry]:
    return [
        Geometry(
            f"{piece.name}/{i}", piece.colour, *((form, None) if isinstance(form, Part) else (None, form))
        )
        for i, form in enumerate(forms, 1)
    ]


def _alike(near: Approximation, allowed: float) -> bool:
    return near.max_deviation <= allowed and near.volume_error_ratio <= _MOST_ERROR


def _compared(piece: Piece, chain: list[Geometry], to: str) -> Change:
    """Volume and distance between the piece and the union of what stands for it."""
    from manifold3d import Manifold, Mesh, OpType

    lower, upper = piece.node.bounds()
    middle, side = (lower + upper) / 2, float((upper - lower).max())

    def solid(mesh: trimesh.Trimesh) -> Manifold:
        vertices = (mesh.vertices - middle) / side
        return Manifold(Mesh(vertices.astype(np.float32), mesh.faces.astype(np.uint32)))

    own = solid(piece_mesh(piece, _COMPARED))
    meshes = (g.mesh if g.part is None else mesh_part(g.part, _COMPARED) for g in chain)
    union = Manifold.batch_boolean([solid(mesh) for mesh in meshes if mesh is not None], OpType.Add)
    apart = (own - union).volume() + (union - own).volume()
    surface = union.refine_to_length(0.05).to_mesh()
    places, faces = surface.vert_properties[:, :3].astype(np.float64), surface.tri_verts.astype(np.int64)
    there = np.abs(piece.node.distance(places * side + middle)).max()
    back = MeshDistance(places, faces, faces, True).unsigned(own.to_mesh().vert_properties[:, :3]).max()
    deviation = max(float(there), float(back) * side)
    return Change(piece.part_names, to, apart / own.volume(), deviation)


def _mesh(piece: Piece, resolution: int, convex: bool) -> tuple[trimesh.Trimesh, float, float]:
    """The piece's mesh or its convex hull, by how much volume that is more, and how far off at most."""
    mesh = piece_mesh(piece, resolution)
    if not convex:
        return mesh, 0.0, 0.0
    return _hull(mesh, piece.node)


def _hull(mesh: trimesh.Trimesh, node: Node) -> tuple[trimesh.Trimesh, float, float]:
    """Found at a size of 1: the hulls of meshes in micrometres would lose their triangles in metres."""
    import trimesh

    lower, upper = mesh.bounds
    middle, side = (lower + upper) / 2, float((upper - lower).max())
    unit = trimesh.Trimesh((mesh.vertices - middle) / side, mesh.faces, process=False)
    hull = unit.convex_hull
    places = hull.subdivide_to_size(_SPACING).triangles_center * side + middle
    deviation = float(np.abs(node.distance(places)).max())
    placed = trimesh.Trimesh(hull.vertices * side + middle, hull.faces, process=False)
    return placed, float(hull.volume / unit.volume - 1), deviation
