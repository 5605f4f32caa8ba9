"""An assembly as the solids that a physics engine collides, and meshes where no solid is near enough."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.balanced_hull import balanced_hulls
from partwright.approximation.change import Change
from partwright.approximation.convex import segments, walls
from partwright.approximation.convex_cover import convex_cover, simplified
from partwright.approximation.convex_fit import CONVEX_KINDS, convex_fits
from partwright.approximation.convex_piece import Limits
from partwright.approximation.light_hull import light_hull
from partwright.approximation.nearest import Approximation, nearest_solid
from partwright.approximation.pieces import Piece, piece_mesh, pieces, require_some
from partwright.approximation.pipe_chain import has_narrow_bore, pipe_chain, straight_rod
from partwright.approximation.separation import node_solid
from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import Box, Cylinder, Field, Pipe, Solid
from partwright.meshing import mesh_part
from partwright.meshing.hulls import file_hull
from partwright.meshing.manifolds import as_mesh, surface_of
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    import trimesh

TOLERANCE = 0.05  # of the longest side: how far a solid's surface may lie from its part's
_MOST_ERROR = 0.3  # of its volume: thin parts are within any tolerance of much
_SPACING = 0.04  # of its size: between the points of a hull that are held against what it stands for
_NATIVE_FOR = 0.05  # of its volume: by how much a solid may be worse than the hull that it saves
_EXTRA = 0.1  # of its volume: what the hulls of its pieces may add, before they are balanced
_AS_GOOD = 0.02  # of a piece's volume: a solid that is off by no more takes the place of its hull
_FILLED = "its bore is filled"
_CHORD = 0.05  # of the tolerance, or the thinnest wall: what curved faces may lose
_LIGHT = 0.1  # of the tolerance: what hulls may lose for fewer corners
_COMPARED = 32  # cells along what is compared


@dataclass(frozen=True)
class Geometry:
    """A piece in the format's terms: `part`, placed, holds a solid; else `mesh` stands for it.

    piece, parts: names of the piece that it is of, and of the parts in that. exact: whether it
    has the piece's own surface.
    """

    name: str
    colour: np.ndarray
    part: Part | None
    mesh: trimesh.Trimesh | None
    piece: str
    parts: tuple[str, ...]
    exact: bool = False


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

    A solid, unless its hull is nearer by volume; its hull, where only hulls collide; solids along the arc
    of a bent part; convex pieces, where only those collide; its mesh.
    """
    names = piece.part_names
    part = piece.node if isinstance(piece.node, Part) else None
    rod = straight_rod(part) if part is not None and Cylinder in kinds else None
    if rod is not None:
        return [Geometry(piece.name, piece.colour, rod, None, piece.name, names, True)], None
    near = nearest_solid(part, kinds) if part is not None else None
    if near is not None and near.exact:
        return [Geometry(piece.name, piece.colour, near.part_with_solid, None, piece.name, names, True)], None
    mesh, error, deviation = _mesh(piece, resolution, convex)
    if near is not None and _alike(near, allowed):
        hull_is_nearer = convex and deviation <= allowed and error + _NATIVE_FOR < near.volume_error_ratio
        if not hull_is_nearer:
            change = Change(names, near.solid.kind, near.volume_error_ratio, near.max_deviation)
            return [Geometry(piece.name, piece.colour, near.part_with_solid, None, piece.name, names)], change
    whole = [Geometry(piece.name, piece.colour, None, mesh, piece.name, names, not convex)]
    mesh_change = Change(names, "convex mesh" if convex else "mesh", error, deviation)
    if convex and deviation <= allowed and error <= _MOST_ERROR:
        return whole, mesh_change
    boxes = walls(part) if part is not None and Box in kinds else []
    if boxes:
        found = _numbered(piece, boxes)
        return found, _compared(piece, found, "4 boxes")
    chain = _chain(part, kinds, allowed, convex) if part is not None else []
    if chain:
        found = _numbered(piece, chain)
        change = _compared(piece, found, f"chain of {len(chain)} solids")
        filled = part is not None and has_narrow_bore(part, allowed)
        return found, dataclasses.replace(change, note=_FILLED) if filled else change
    if not convex:
        return whole, mesh_change
    found = _numbered(piece, _covered(piece.node, kinds, allowed))
    if len(found) == 1:
        return whole, mesh_change
    return found, _compared(piece, found, f"{len(found)} convex pieces")


def _covered(node: Node, kinds: Sequence[type[Field]], allowed: float) -> list[Part | trimesh.Trimesh]:
    """Convex pieces of a hollow or bent part, a difference or an intersection: as few as the tolerance asks
    for.

    Each is a native solid where that is as good as its hull, whose faces are moved to add as much as they
    lack. Found at a size of 1: engines' metres make micrometres of small assemblies.
    """
    lower, upper = node.bounds()
    middle, side = (lower + upper) / 2, float((upper - lower).max())
    if not side > 0 or not np.isfinite(side):
        raise NoSurfaceError(f"{node.name or 'a difference'}: nothing is left of it")
    thinnest = min(part.field.wall for part in node.parts)
    unit = node_solid(node, _CHORD * min(allowed, thinnest)).translate(tuple(-middle)).scale((1 / side,) * 3)
    frame = Similarity(side, translation=tuple(middle.tolist()))
    forms: list[Part | trimesh.Trimesh] = []
    unit = simplified(unit, allowed / side)
    native = [kind for kind in kinds if kind in CONVEX_KINDS]
    for hull in balanced_hulls(convex_cover(unit, Limits(allowed / side, _EXTRA)), unit, allowed / side):
        fits = convex_fits(hull, native, "nearest", allowed / side, _AS_GOOD)
        if fits:
            forms.append(fits[0].part.transformed(frame))
        else:
            corners, _ = surface_of(light_hull(hull, _LIGHT * allowed / side)[0])
            forms.append(as_mesh(file_hull(frame(corners))))
    return forms


def _chain(part: Part, kinds: Sequence[type[Field]], allowed: float, convex: bool) -> list[Part]:
    """The straight segments of a bent part as solids; none where one of them is near to no solid.

    Where only convex pieces collide, which would be very many around a bore, one within what is allowed is
    filled."""
    if isinstance(part.field, Pipe):
        solid = not part.field.bore or (convex and has_narrow_bore(part, allowed))
        return pipe_chain(part, kinds, allowed) if solid else []
    named = [kind for kind in kinds if issubclass(kind, Solid)]
    own = part.field.superfrustum()
    forms: list[Part] = []
    for segment in segments(part, allowed) if own is not None and not own.hollow else ():
        try:
            near = nearest_solid(segment, named)
        except NoSurfaceError:
            continue  # a segment beyond a tip
        if not _alike(near, allowed):
            return []
        forms.append(near.part_with_solid)
    return forms


def _numbered(piece: Piece, forms: Sequence[Part | trimesh.Trimesh]) -> list[Geometry]:
    return [
        Geometry(
            f"{piece.name}/{i}",
            piece.colour,
            form if isinstance(form, Part) else None,
            None if isinstance(form, Part) else form,
            piece.name,
            piece.part_names,
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
    back = MeshDistance(places, faces, faces, True).exact(own.to_mesh().vert_properties[:, :3]).max()
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
    placed = as_mesh(file_hull(np.asarray(hull.vertices) * side + middle))
    return placed, float(hull.volume / unit.volume - 1), deviation
