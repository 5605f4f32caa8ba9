"""Meshes of robots as closed solids: as they are where they close, repaired where they do not."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import (
    FlatShapeError,
    OpenShellError,
    PartwrightError,
    RobotError,
)
from partwright.meshing.manifolds import closed, surface_of
from partwright.robots.model import Link, MeshUse, mirrored
from partwright.robots.wrapping import wrapped
from partwright.shapes import Shape as InputShape
from partwright.shapes.collada import read_collada
from partwright.shapes.reading import read_source, source_of
from partwright.shapes.sampling import sample_triangles
from partwright.shapes.source import Piece, Source

if TYPE_CHECKING:
    from pathlib import Path

    from manifold3d import Manifold

    _Key = tuple[Path, str | None, bool]  # of `MeshUse.mesh`
    _Placed = tuple[tuple[_Key, bytes], ...]

_OPEN = "it does not close; what its surface goes around, or cannot be reached from outside, is its inside"


@dataclass(frozen=True, eq=False)
class Target:
    """What shapes are to stand for, in the link's frame.

    solid: closed. wrap: what contains all triangles: the solid, or more where that was told by a lattice.
    vertices (V, 3), faces (F, 3): the triangles as they were read, which are to be contained. notes: what was
    repaired, or could not be read. loose: whether some of the triangles bound no solid by themselves, so that
    the wrap stands off them. sheets: whether they bound nothing but what wraps them, whose thickness is the
    wrap's alone.
    """

    solid: Manifold
    wrap: Manifold
    vertices: np.ndarray
    faces: np.ndarray
    notes: tuple[str, ...]
    loose: bool = False
    sheets: bool = False

    @property
    def size(self) -> float:
        """Longest side."""
        return float(np.ptp(self.vertices, axis=0).max())

    def samples(self, count: int, seed: int) -> np.ndarray:
        """(N, 3) points spread evenly over the triangles, and all corners."""
        points, _ = sample_triangles(self.vertices, self.faces, count, seed)
        return np.concatenate([points, self.vertices[np.unique(self.faces)]])


@dataclass(frozen=True, eq=False)
class _Mesh:
    """A file's own triangles (V, 3), (F, 3), and the solid that they bound, if they do. repairs: what of the
    file could not be read."""

    vertices: np.ndarray
    faces: np.ndarray
    solid: Manifold | None
    repairs: tuple[str, ...]


class Solids:
    """Reads each mesh file once; links that have the same meshes in the same places share one target.

    Another process gets none of what was read: a solid that is built again from its triangles is not always
    quite the same, so it reads what it needs."""

    def __reduce__(self) -> tuple[type[Solids], tuple[()]]:
        return Solids, ()

    def __init__(self) -> None:
        self._meshes: dict[tuple[_Key, bool], _Mesh] = {}
        self._wraps: dict[_Placed, tuple[Manifold, Manifold]] = {}
        self._targets: dict[tuple[bool, _Placed], Target] = {}

    def target(self, link: Link, uses: Sequence[MeshUse], sheets: bool = False) -> Target:
        """All of these meshes as one. Those that do not close are wrapped together: one may close another.

        sheets: those without thickness are wrapped, as what is seen often has them, for a label say.

        Raises:
            PartwrightError: one of them cannot be read, or encloses nothing; the message names the link.
        """
        key = sheets, _placed(uses)
        if key not in self._targets:
            self._targets[key] = self._made(link, uses, sheets)
        return self._targets[key]

    def _made(self, link: Link, uses: Sequence[MeshUse], sheets: bool) -> Target:
        from manifold3d import Manifold, OpType

        read = [self._of(link, use, sheets) for use in uses]
        placed = [
            (
                one.vertices @ use.matrix[:3, :3].T + use.matrix[:3, 3],
                one.faces[:, ::-1] if mirrored(use.matrix) else one.faces,
            )
            for one, use in zip(read, uses, strict=True)
        ]
        solids = [
            one.solid.transform(use.matrix[:3])
            for one, use in zip(read, uses, strict=True)
            if one.solid is not None
        ]
        notes = [
            f"{use.source.name}: {text}" for one, use in zip(read, uses, strict=True) for text in one.repairs
        ]
        open_ = [i for i, one in enumerate(read) if one.solid is None]
        if not open_:
            solid = Manifold.batch_boolean(solids, OpType.Add)
            return Target(solid, solid, *_together(placed), tuple(dict.fromkeys(notes)))
        key = _placed([uses[i] for i in open_])
        if key not in self._wraps:
            try:
                self._wraps[key] = wrapped(*_together([placed[i] for i in open_]))
            except PartwrightError as error:
                raise type(error)(f"link {link.name!r}: {uses[open_[0]].source.name}: {error}") from error
        inner, whole = self._wraps[key]
        return Target(
            Manifold.batch_boolean([*solids, inner], OpType.Add),
            Manifold.batch_boolean([*solids, whole], OpType.Add),
            *_together(placed),
            tuple(dict.fromkeys([*notes, *(f"{uses[i].source.name}: {_OPEN}" for i in open_)])),
            loose=True,
            sheets=inner is whole and not solids,
        )

    def _of(self, link: Link, use: MeshUse, sheets: bool) -> _Mesh:
        if not np.isfinite(use.matrix).all() or abs(np.linalg.det(use.matrix[:3, :3])) < 1e-30:
            raise RobotError(f"link {link.name!r}: the scale of {use.source.name} leaves nothing of it")
        key = use.mesh, sheets
        if key not in self._meshes:
            try:
                self._meshes[key] = _read(use, sheets)
            except PartwrightError as error:
                raise type(error)(f"link {link.name!r}: {use.source.name}: {error}") from error
        return self._meshes[key]


def _placed(uses: Sequence[MeshUse]) -> _Placed:
    """The same for the same meshes in the same places, whatever the signs of zeros."""
    return tuple((use.mesh, (use.matrix + 0.0).tobytes()) for use in uses)


def _together(pieces: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces of all pieces as one."""
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in pieces)])
    faces = [faces + start for (_, faces), start in zip(pieces, starts, strict=False)]
    return np.concatenate([vertices for vertices, _ in pieces]), np.concatenate(faces)


def _read(use: MeshUse, sheets: bool) -> _Mesh:
    """A file's triangles, as they are or repaired to a solid.

    Raises:
        FlatShapeError: they bound none, and are no `sheets`.
    """
    source = _meant(use)
    vertices, faces = _together([(piece.vertices, piece.faces) for piece in source.pieces])
    solid = None
    with suppress(OpenShellError, *((FlatShapeError,) if sheets else ())):
        # What stays open is wrapped, and wraps hold every sheet.
        shape = InputShape(dataclasses.replace(source, sealing=False))
        solid = _manifold(shape.vertices, shape.faces)
    return _Mesh(vertices, faces, solid, source.repairs)


def _meant(use: MeshUse) -> Source:
    """The file, or what is meant of it, as one piece.

    Raises:
        RobotError: nothing in it has the submesh's name.
    """
    if use.inline is not None:
        return source_of(use.inline)
    collada = use.source.suffix.lower() == ".dae"
    # Gazebo and ROS do not ask a file for its up axis, and nothing in a link's frame is the ground.
    source = dataclasses.replace(read_collada(use.source), up=None) if collada else read_source(use.source)
    if use.submesh is None and not collada:
        return source
    pieces = [piece for piece in source.pieces if use.submesh in (None, piece.name)]
    if not pieces:
        names = ", ".join(dict.fromkeys(piece.name for piece in source.pieces))
        raise RobotError(f"it has no submesh {use.submesh!r}; it has {names}")
    vertices, faces = _together([(piece.vertices, piece.faces) for piece in pieces])
    if use.centred:
        vertices = vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return dataclasses.replace(source, pieces=(Piece(source.name, vertices, faces),))


def _manifold(vertices: np.ndarray, faces: np.ndarray) -> Manifold | None:
    from manifold3d import Error

    solid = closed(vertices, faces)
    return solid if solid.status() == Error.NoError and solid.volume() > 0 else None


@dataclass(frozen=True)
class Deviation:
    """How far the surface of either of two solids reaches beyond the other, as a length, at most; at: (3,)
    where that is; missing: whether the second one lacks something there, or adds it."""

    length: float
    at: tuple[float, float, float]
    missing: bool


def largest_deviation(solid: Manifold, shapes: Manifold) -> Deviation:
    """By points about an eightieth of the size apart."""
    size = float(np.ptp(np.reshape(solid.bounding_box(), (2, 3)), axis=0).max())
    solid, shapes = solid.as_original(), shapes.as_original()
    lacks, where_it_lacks = _beyond(solid, shapes, size)
    adds, where_it_adds = _beyond(shapes, solid, size)
    missing = lacks > adds
    x, y, z = (where_it_lacks if missing else where_it_adds).tolist()
    return Deviation(max(lacks, adds), (x, y, z), missing)


def _beyond(one: Manifold, other: Manifold, size: float) -> tuple[float, np.ndarray]:
    """How far what of one solid, an original, is not in another reaches from that, and where (3,).

    Only its own surface is looked at: what bounds the rest else is the other's, at no distance, and often
    nearly all. In double precision: in single, the nearest place of a narrow triangle is up to a thousandth
    of the size off.
    """
    import igl

    left = one - other
    if left.is_empty():
        return 0.0, np.zeros(3)
    mesh = left.refine_to_length(size / 80).to_mesh64()
    ends = np.asarray(mesh.run_index) // 3
    runs = zip(mesh.run_original_id, ends, ends[1:], strict=False)
    own = [mesh.tri_verts[first:last] for of, first, last in runs if of == one.original_id()]
    if not own:
        return 0.0, np.zeros(3)
    points = np.asarray(mesh.vert_properties, dtype=np.float64)[np.unique(np.concatenate(own)), :3]
    squared, *_ = igl.point_mesh_squared_distance(points, *surface_of(other))
    return float(np.sqrt(squared.max())), points[squared.argmax()]
