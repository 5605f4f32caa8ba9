"""Parts and assemblies as closed meshes in their own units."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.joint import is_joint
from partwright.errors import NoSurfaceError
from partwright.fields import Field, Pipe, SuperFrustum, Swept
from partwright.fields.base import LIPSCHITZ
from partwright.meshing.csg import check_count, has_exact_mesh, mesh_csg
from partwright.meshing.marching import mesh_field
from partwright.meshing.small_components import without_small_components
from partwright.meshing.thin_parts import thin_solids, united, without_scraps
from partwright.meshing.thin_walls import has_thin_walls

if TYPE_CHECKING:
    import trimesh

# Cells across the thinnest wall. Under sqrt(3) a slanted wall would show holes; 3 also keep a thin rod round.
ACROSS, _ACROSS_PART = 2.0, 3.0
_HOLED = 1.75  # cells across a slanted wall, under which there may be holes in it
_FINEST = 2.0  # an assembly's resolution may grow by this for the sake of thin walls
_PART_CELLS = 120_000  # a part's surface is given at most this many cells
_MOST = 1024.0  # cells along one axis of a part
_LEAST = 24  # cells along the longest side of a thin part, or of what cuts it
_CRUMB = 3.0  # cells; a component that is shorter along each axis is what is left of too thin a sheet
_SCRAP = 8  # what is shorter, or nowhere nearer to the assembly, than this part of a cell is none of it
_CHORDS = 32  # a chord of an exact mesh is this part of a cell from its surface at most
_ROOM = 1e-3  # of the longest side, around the bounds
_MESHES_KEPT = 8  # of parts in their own frames, for what comes again soon: some megabytes each


def mesh_assembly(
    assembly: Assembly | Part, resolution: int = 128, *, sharp: bool = True, exact: bool | None = None
) -> trimesh.Trimesh:
    """The whole blended surface, watertight, in the assembly's own units and place.

    exact: by booleans of the leaves' own surfaces (see `csg`), chords within 1/32 of a cell; None does so
    where all leaves are quadrics or named solids without blends. Otherwise by marching cubes:

    resolution: cells along the longest side; up to twice as many where that is enough to put two cells across
    a thin part, and where cuts leave walls that are so thin. Parts that are thinner still are meshed along
    their own axes and united with the whole by a boolean (see `thin_parts`). Where thin ones are subtracted
    or intersected, holes may be left (the mesh is closed all the same); crumbs that are shorter than three
    cells are left out.

    Raises NoSurfaceError where nothing is left of the assembly, as when a difference takes all away, or where
    it does not end; ParameterError where it has no exact mesh, but one is asked for, or where it has more
    than 10,000 parts, copies counted.
    """
    check_count(assembly)
    if exact or (exact is None and has_exact_mesh(assembly)):
        return _exact(assembly, resolution)
    cell = float(np.ptp(assembly.bounds(), axis=0).max()) / resolution
    learned = _learned(assembly, cell)
    if learned is not None:
        return learned
    solids = thin_solids(assembly, lambda part: _is_thin(part, cell), partial(_alone, cell, sharp))
    solids = without_scraps(solids, assembly.distance, cell / _SCRAP)
    if not solids:
        return _marched(assembly, cell, sharp)
    try:
        return united(_marched(assembly, cell, sharp), solids, cell / _SCRAP)
    except NoSurfaceError:  # nothing but sheets, all of which slipped through the cells
        return united(None, solids, cell / _SCRAP)


def _learned(assembly: Assembly | Part, cell: float) -> trimesh.Trimesh | None:
    """One learned shape and nothing else, by its model: it knows where no part can be."""
    if assembly.is_part or assembly.operation != "union":
        return None
    parts = [part for part in assembly.children if is_joint(part)]
    if len(parts) < len(assembly.children) or any(part.blend or part.instances for part in parts):
        return None
    first = parts[0]
    mesh = first.field.whole(cell) if len(first.field.members) == len(parts) else None
    if mesh is not None:
        mesh.vertices = first.pose(mesh.vertices)
    return mesh


def _is_thin(part: Part, cell: float) -> bool:
    """Whether not even the finest cells would put enough of them across its thinnest wall."""
    return part.field.wall < ACROSS * cell / _FINEST


def _alone(cell: float, sharp: bool, node: Assembly | Part) -> trimesh.Trimesh:
    """A part, or what is subtracted from one, in cells about as long as those of the whole."""
    resolution = max(int(np.ceil(np.ptp(node.bounds(), axis=0).max() / cell)), _LEAST)
    if isinstance(node, Part):
        return mesh_part(node, resolution, sharp=sharp)
    return mesh_assembly(node, resolution, sharp=sharp)


def _marched(node: Assembly | Part, cell: float, sharp: bool) -> trimesh.Trimesh:
    """The whole blended surface by cubes of this size, own units, or down to half of it where it is thin."""
    import trimesh

    lower, upper = node.bounds()
    frame, longest = _frame(lower, upper), float((upper - lower).max())
    thick = [part.field.wall for part in node.parts if not _is_thin(part, cell)]
    thinnest = min(thick, default=np.inf)
    counts = int(np.ceil(longest / min(cell, thinnest / ACROSS)))
    local = node.transformed(frame)
    room = _ROOM + (upper - lower) * frame.scale / 2
    mesh = mesh_field(local.distance, -room, room, counts, lipschitz=lipschitz(node), sharp=sharp)
    finest, across = int(np.ceil(_FINEST * longest / cell)), _HOLED * 2 * room.max() / counts
    carved = counts < finest and len(thick) == len(node.parts) and _carved(node)
    if carved and has_thin_walls(local.distance, mesh.vertices, across):
        counts = finest
        mesh = mesh_field(local.distance, -room, room, counts, lipschitz=lipschitz(node), sharp=sharp)
    vertices, faces = without_small_components(mesh.vertices, mesh.faces, _CRUMB * 2 * room.max() / counts)
    return trimesh.Trimesh(frame.inverse()(vertices), faces, process=False)


def _carved(node: Assembly | Part) -> bool:
    """Whether a wall may be thinner than those of the parts: where a cut ends beside another surface."""
    if isinstance(node, Part):
        return False
    return node.operation != "union" or any(_carved(child) for child in node.children)


def mesh_part(part: Part, resolution: int = 64, *, sharp: bool = True) -> trimesh.Trimesh:
    """One part alone, watertight, in its own units and place; all copies of a repeated one, each closed.

    The mesh of a quadric, extrusion, revolution or pipe is exact, see `mesh_assembly`. A learned part's is by
    its model, with more cells where it is thin. Any other is meshed along its own axes. Cells are made
    shorter where the part is thin, each axis by itself, so that walls come out complete, as long as that
    takes no more than about 100,000 cells.

    Raises NoSurfaceError for a part without volume, or without end, as most quadrics are.
    """
    if part.field.quadric() is not None or isinstance(part.field, Swept | Pipe):
        return _repeated(_exact(replace(part, instances=()), resolution), part.instances)
    mesh = part.field.surface(resolution)
    if mesh is not None:
        mesh.vertices = part.pose(mesh.vertices)
        return _repeated(mesh, part.instances)
    import trimesh

    field = part.field.superfrustum()
    if field is not None:
        frame, vertices, faces = _kept_in_own_frame(field, repr(field), resolution, sharp)
    else:
        frame, vertices, faces = _in_own_frame(part.field, resolution, sharp)
    pose = part.pose @ frame.inverse()
    return _repeated(trimesh.Trimesh(pose(vertices), faces.copy(), process=False), part.instances)


@lru_cache(_MESHES_KEPT)
def _kept_in_own_frame(
    field: SuperFrustum, said: str, resolution: int, sharp: bool
) -> tuple[Similarity, np.ndarray, np.ndarray]:
    """`_in_own_frame`, which copies of a part share.

    said: the field's repr, as 0 and -0 are the same number, but not to the bit.
    """
    return _in_own_frame(field, resolution, sharp)


def _in_own_frame(field: Field, resolution: int, sharp: bool) -> tuple[Similarity, np.ndarray, np.ndarray]:
    """The frame in which a field is meshed, and the vertices (V, 3) and faces (F, 3) there."""
    lower, upper = field.bounds()
    frame = _frame(lower, upper)
    local = field.scaled(frame.scale)
    centre = np.asarray(frame.translation)
    extent = (upper - lower) * frame.scale + 2 * _ROOM
    walls = local.walls() if isinstance(local, SuperFrustum) else np.full(3, local.wall)
    thin = np.maximum(walls, 1e-9)
    counts = np.maximum(resolution * extent / extent.max(), _ACROSS_PART * extent / thin)
    surface = 4 * (counts * np.roll(counts, 1)).sum()
    counts = np.clip(counts * min(1.0, float(np.sqrt(_PART_CELLS / surface))), 4.0, _MOST)

    def distance(points: np.ndarray) -> np.ndarray:
        return local(points - centre.astype(np.float32))

    mesh = mesh_field(distance, -extent / 2, extent / 2, counts, lipschitz=local.lipschitz, sharp=sharp)
    return frame, np.asarray(mesh.vertices), np.asarray(mesh.faces)


def lipschitz(node: Assembly | Part) -> float:
    """How fast the distance may change: learned parts know how steep they are."""
    return max(LIPSCHITZ, *(part.field.lipschitz for part in node.parts))


def _exact(node: Assembly | Part, resolution: int) -> trimesh.Trimesh:
    box = node.bounds()
    finite = np.isfinite(box).all()
    return mesh_csg(node, float(np.ptp(box, axis=0).max()) / (_CHORDS * resolution) if finite else None)


def _repeated(mesh: trimesh.Trimesh, moves: tuple[Similarity, ...]) -> trimesh.Trimesh:
    if not moves:
        return mesh
    import trimesh

    vertices = [mesh.vertices, *(move(mesh.vertices) for move in moves)]
    faces = [mesh.faces + i * len(mesh.vertices) for i in range(len(vertices))]
    return trimesh.Trimesh(np.concatenate(vertices), np.concatenate(faces), process=False)


def _frame(lower: np.ndarray, upper: np.ndarray) -> Similarity:
    """To a box around the origin whose longest side is 1.8: float32 keeps its digits there."""
    longest = float((upper - lower).max())
    if longest <= 0:
        raise NoSurfaceError("The part or assembly has no size at all; give it an extent or a dilation.")
    scale = 1.8 / longest
    centre = (np.asarray(lower) + np.asarray(upper)) / 2
    return Similarity(scale, translation=tuple(-scale * centre))
