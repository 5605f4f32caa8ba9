"""What a format without blends and holes takes one by one: the solids that an assembly is the union of."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from partwright.approximation.separation import separated
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.names import unique_names
from partwright.assembly.palette import palette
from partwright.errors import NoSurfaceError, NothingToExportError
from partwright.meshing import lean_assembly, lean_part, mesh_assembly, mesh_part

if TYPE_CHECKING:
    import trimesh

WHOLE = 64  # cells along the longest side of a difference or intersection
T = TypeVar("T")


@dataclass(frozen=True)
class Piece:
    """A part, or a difference or intersection, which is taken as a whole.

    name: unique among the pieces. colour: (3,) sRGB, 0..1. blend: with which it melts into those before it.
    """

    node: Node
    name: str
    colour: np.ndarray
    blend: float

    @property
    def part_names(self) -> tuple[str, ...]:
        return (self.node.name,) if isinstance(self.node, Part) else tuple(p.name for p in self.node.parts)


def pieces(assembly: Assembly, *, separate: bool = False) -> list[Piece]:
    """In the order in which they are joined; each copy of a repeated part is one.

    separate: a difference of several is the union of their differences, each a piece.
    """
    colours = dict(zip((p.name for p in assembly.parts), palette(len(assembly)) / 255, strict=True))
    opened = list(_opened(assembly, 0.0))
    if separate:
        opened = [(one, one.blend or blend) for node, blend in opened for one in separated(node)]
    names = unique_names([_name(node) for node, _ in opened], ["piece"] * len(opened))
    return [
        Piece(node, name, colours[node.name if isinstance(node, Part) else node.parts[0].name], blend)
        for (node, blend), name in zip(opened, names, strict=True)
    ]


def _opened(node: Node, blend: float) -> Iterator[tuple[Node, float]]:
    """The first child of a union melts in as the union itself does."""
    if isinstance(node, Assembly) and node.operation == "union":
        for i, child in enumerate(node.operands):
            yield from _opened(child, child.blend if i else blend)
    else:
        yield node, blend


def _name(node: Node) -> str:
    return node.name or (node.parts[0].name if isinstance(node, Assembly) else "")


def piece_mesh(piece: Piece, resolution: int, lean: bool = False) -> trimesh.Trimesh:
    """A closed mesh of the piece alone; resolution: cells along it, `WHOLE` for a difference or intersection.

    lean: with no more triangles than it needs, as for files.

    Raises:
        NoSurfaceError: it has no volume.
    """
    node = piece.node
    if isinstance(node, Part):
        return lean_part(node, resolution) if lean else mesh_part(node, resolution)
    return lean_assembly(node, WHOLE) if lean else mesh_assembly(node, WHOLE)


def piece_meshes(assembly: Assembly, resolution: int) -> list[tuple[Piece, trimesh.Trimesh]]:
    """Every piece that has a volume, with its mesh, each closed by itself.

    Raises:
        NothingToExportError: none has.
    """
    found = []
    for piece in pieces(assembly):
        with suppress(NoSurfaceError):  # it only shows where it blends
            found.append((piece, piece_mesh(piece, resolution, lean=True)))
    return require_some(assembly, found)


def require_some(assembly: Assembly, found: list[T]) -> list[T]:
    """What is to be written, if that is anything."""
    if not found:
        raise nothing_to_export(assembly)
    return found


def nothing_to_export(assembly: Assembly) -> NothingToExportError:
    return NothingToExportError(
        f"none of the {len(assembly)} parts has a volume: there is nothing to export; "
        "give them a size, or remove those that are empty"
    )


def surfaces(assembly: Assembly, by_part: bool, resolution: int | None) -> list[tuple[str, trimesh.Trimesh]]:
    """Named closed meshes: of each piece, or of the whole blended surface, which has no name."""
    if by_part:
        return [(piece.name, mesh) for piece, mesh in piece_meshes(assembly, resolution or 32)]
    return [("", whole_surface(assembly, resolution or 128))]


def whole_surface(assembly: Assembly, resolution: int) -> trimesh.Trimesh:
    """The blended surface; resolution: cells along its longest side.

    Raises:
        NothingToExportError: it has none.
    """
    try:
        return lean_assembly(assembly, resolution)
    except NoSurfaceError as error:
        raise NothingToExportError(
            f"nothing to export: the assembly has no surface at {resolution} cells along its longest side; "
            "give its parts a size, or take more cells (--resolution)"
        ) from error


def one_surface(assembly: Assembly, by_part: bool, resolution: int | None) -> trimesh.Trimesh:
    """The meshes of `surfaces` as one mesh."""
    import trimesh

    meshes = [mesh for _, mesh in surfaces(assembly, by_part, resolution)]
    return cast("trimesh.Trimesh", trimesh.util.concatenate(meshes))
