"""The meshes of a robot's links, as STL files beside its own: what collides as no solid, and what is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.names import unique_names
from partwright.atomic_io import write_bytes
from partwright.export.identifiers import file_name

if TYPE_CHECKING:
    import trimesh

    from partwright.export.links import Link
    from partwright.export.rigid_body import Body


@dataclass(frozen=True)
class LinkMeshes:
    """seen: of each link, pieces that are seen as something else than they collide as: name, colour (3,).
    files: of each link, piece -> the name of its file."""

    seen: dict[str, list[tuple[str, np.ndarray]]]
    files: dict[str, dict[str, str]]


def write_link_meshes(
    made: Sequence[tuple[Link, Body]], path: Path, resolution: int, visuals: bool
) -> LinkMeshes:
    """Write them as FILE_piece.stl, or FILE_link_piece.stl where there are several links.

    resolution: cells along a piece that is seen. visuals: whether any are seen as other than they collide.
    """
    from trimesh.exchange.stl import export_stl

    meshes: list[tuple[str, str, trimesh.Trimesh]] = []  # link, piece, mesh
    seen = {}
    for link, body in made:
        meshes += [(link.name, g.name, g.mesh) for g in body.geometries if g.mesh is not None]
        own = body.visuals(resolution) if visuals else []
        meshes += [(link.name, name, mesh) for name, _, mesh in own]
        seen[link.name] = [(name, colour) for name, colour, _ in own]
    keys = [f"{link}_{piece}" if len(made) > 1 else piece for link, piece, _ in meshes]
    plain = [file_name(key) for key in keys]
    files: dict[str, dict[str, str]] = {link.name: {} for link, _ in made}
    for (link_name, piece, mesh), name in zip(meshes, unique_names(plain, plain), strict=True):
        files[link_name][piece] = f"{path.stem}_{name}.stl"
        write_bytes(path.with_name(files[link_name][piece]), export_stl(mesh))
    return LinkMeshes(seen, files)
