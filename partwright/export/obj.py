"""OBJ: the blended surface as text, coordinates to their last digit."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.collision import TOLERANCE
from partwright.approximation.pieces import piece_mesh, pieces, require_some, surfaces
from partwright.assembly import Similarity
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError, SettingError
from partwright.export.collider_meshes import collider_mesh
from partwright.export.engine_names import KINDS, collider_names, plain_name
from partwright.export.formats import Format, Holds
from partwright.export.glb_physics import ENGINES
from partwright.export.identifiers import free_name
from partwright.export.rigid_body import DENSITY, Body

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly

_CELLS = 32  # along each part


def write(
    assembly: Assembly,
    path: str | Path,
    by_part: bool = False,
    resolution: int | None = None,
    physics: str | None = None,
    tolerance: float | None = None,
) -> None:
    """Write the surface, watertight, in the assembly's own units and place.

    by_part: an object (`o NAME`) a part, each closed by itself, instead of one for the blended surface.
    resolution: cells along the longest side, 128 if not given; with by_part along each part, 32.
    physics: "unreal" or "godot": by part, and beside each one convex colliders, under names that these
    engines know. tolerance: as of MJCF.

    Raises:
        SettingError: there is no such physics in OBJ, or a tolerance without it.
    """
    if physics is None and tolerance is not None:
        raise SettingError("tolerance is of colliders: it needs physics unreal or godot")
    if physics is None:
        objects: Iterable[tuple[str, trimesh.Trimesh]] = surfaces(assembly, by_part, resolution)
    else:
        objects = _with_colliders(assembly, path, physics, resolution or _CELLS, tolerance)
    lines, first = [f"# unit: {assembly.unit or 'unknown'}"], 1
    for name, mesh in objects:
        lines += [f"o {name}"] if name else []
        lines += ["v {!r} {!r} {!r}".format(*vertex) for vertex in np.asarray(mesh.vertices).tolist()]
        lines += ["f {} {} {}".format(*face) for face in (mesh.faces + first).tolist()]
        first += len(mesh.vertices)
    write_bytes(path, ("\n".join(lines) + "\n").encode())


def _with_colliders(
    assembly: Assembly, path: str | Path, engine: str, cells: int, tolerance: float | None
) -> list[tuple[str, trimesh.Trimesh]]:
    """Each piece under a name of its own, and its colliders, in the assembly's own units and place."""
    if engine not in ENGINES:
        raise SettingError(f"physics: expected one of {', '.join(ENGINES)} in OBJ, got {engine!r}")
    asked = TOLERANCE if tolerance is None else tolerance
    body = Body.of(assembly, KINDS[engine], DENSITY, asked, cells, convex=True, frame=lambda _: Similarity())
    taken: set[str] = set()
    names, objects = {}, []
    for piece in pieces(assembly, separate=True):
        try:
            mesh = piece_mesh(piece, cells, lean=True)
        except NoSurfaceError:  # it only shows where it blends
            continue
        names[piece.name] = free_name(plain_name(piece.name), taken)
        objects.append((names[piece.name], mesh))
    of = [(names[g.piece], g) for g in body.geometries if g.piece in names]
    colliders = zip(collider_names(engine, of), (collider_mesh(g) for _, g in of), strict=True)
    body.write_report(path)
    return [*require_some(assembly, objects), *colliders]


FORMAT = Format("OBJ", write, frozenset({Holds.BLENDS, Holds.LEARNED}))
