"""An assembly as the solids that a physics engine collides, and meshes where no solid is near enough."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.errors import NoSurfaceError, ParameterError
from partwright.export.approximation import Change
from partwright.export.nearest import Approximation, nearest_solid
from partwright.export.pieces import Piece, piece_mesh, pieces, require_some
from partwright.fields import Field

if TYPE_CHECKING:
    import trimesh

TOLERANCE = 0.05  # of the longest side: how far a solid's surface may lie from its part's


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
    result, changes = [], []
    for piece in pieces(assembly):
        blend = piece.blend * length
        try:
            near = nearest_solid(piece.node, kinds) if isinstance(piece.node, Part) else None
            if near is None or near.max_deviation > allowed:
                mesh, error, deviation = _mesh(piece, resolution, convex)
                to = "convex mesh" if convex else "mesh"
                changes.append(Change(piece.part_names, to, error, deviation * length, blend))
                result.append(Geometry(piece.name, piece.colour, None, mesh))
                continue
        except NoSurfaceError as nothing:
            changes.append(Change(piece.part_names, "nothing", note=str(nothing)))
            continue
        result.append(Geometry(piece.name, piece.colour, near.part_with_solid, None))
        changes += _change(piece, near, blend, length)
    return require_some(assembly, result), changes


def _change(piece: Piece, near: Approximation, blend: float, length: float) -> list[Change]:
    if near.exact and not blend:
        return []
    error, deviation = near.volume_error_ratio, near.max_deviation * length
    return [Change(piece.part_names, near.solid.kind, error, deviation, blend)]


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
    places = hull.subdivide().subdivide().triangles_center * side + middle
    deviation = float(np.abs(node.distance(places)).max())
    placed = trimesh.Trimesh(hull.vertices * side + middle, hull.faces, process=False)
    return placed, float(hull.volume / unit.volume - 1), deviation
