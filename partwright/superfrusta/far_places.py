"""Where a body and a shape are far apart: measured both ways, as the report does, slits left out."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from partwright.approximation.sketches.bodies import bodies
from partwright.assembly import Assembly
from partwright.meshing.csg import solid_of
from partwright.meshing.manifolds import surface_of
from partwright.metrics.deviation import buried
from partwright.rows import units
from partwright.shapes import MeshDistance
from partwright.shapes.topology import EdgeTable, area_vectors, signed_volumes
from partwright.superfrusta.feature_mending import FAR

Floats = NDArray[np.float64]
Distance = Callable[[NDArray[np.float32]], NDArray[np.float32]]

NEARLY = 0.95
"""Of `FAR`: what is nearer is mended, samples being what they are."""
_REGION = 0.75  # of `FAR`: what is as far belongs to the place
_SPACING = 0.03  # unit lengths between points of a surface
_FINE = 60_000  # triangles of a surface that is as fine
CHORD = 1e-3
"""Unit lengths."""
_ONE = 0.07  # unit lengths between points of one place, at most
_ON = 1e-6  # unit lengths: what is as near to a box's sides lies on them
_CRUMB = 1e-5  # of the volume: a body that is smaller is rounding
_VOID = 5e-7  # of the volume: a cavity that is smaller has no open space anywhere
_WITHIN = 0.3  # of the points of a gap, that lie within the shape
_GAP = 0.02  # unit lengths: what is as near to where a piece nearly touches the rest is filled, too


@dataclass(frozen=True, eq=False)
class Place:
    """points: (N, 3) far from the other surface, and where they would lie on it. lacks: whether the body
    lacks something there; else it has too much. off: unit lengths. gap: whether it is one between a piece
    that floats and the rest. floats: the share of the volume that does."""

    points: Floats
    lacks: bool
    off: float
    gap: bool = False
    floats: float = 0.0

    @cached_property
    def box(self) -> Floats:
        """(2, 3)"""
        return np.stack([self.points.min(axis=0), self.points.max(axis=0)])


@dataclass(frozen=True, eq=False)
class Solid:
    """A body with its signed distance (n,) at points (n, 3), sign exact, negative inside."""

    body: Manifold
    distance: Distance

    @classmethod
    def of(cls, whole: Assembly) -> Solid:
        """Of an assembly with an exact mesh, in unit lengths."""
        return cls(solid_of(whole, CHORD), whole.distance)

    def points(self, box: Floats | None = None) -> Floats:
        """(N, 3) of its surface, within a box (2, 3) if one is given."""
        body = self.body
        if box is not None:
            body = body ^ Manifold.cube((box[1] - box[0]).tolist()).translate(box[0].tolist())
        fine = body.refine_to_length(_SPACING) if body.num_tri() < _FINE else body
        found = surface_of(fine)[0]
        if box is None:
            return found
        return found[((found > box[0] + _ON) & (found < box[1] - _ON)).all(axis=1)]

    @cached_property
    def mesh(self) -> tuple[Floats, NDArray[np.int64]]:
        """Vertices (V, 3) and faces (F, 3)."""
        return surface_of(self.body)

    @cached_property
    def walls(self) -> Floats:
        """(F, 3) unit normals of its faces."""
        vertices, faces = self.mesh
        return units(area_vectors(vertices[faces]))

    @cached_property
    def surface(self) -> MeshDistance:
        vertices, faces = self.mesh
        return MeshDistance(vertices, faces, faces, True)

    def away(self, points: Floats) -> NDArray[np.floating]:
        """(N,) from its surface, infinite where it has none: all of a body may lie elsewhere."""
        return np.full(len(points), np.inf) if self.body.is_empty() else self.surface.unsigned(points)

    def feet(self, points: Floats) -> Floats:
        """(N, 3) on its surface, nearest to points; these themselves where it has none."""
        if not len(points) or self.body.is_empty():
            return points
        return self.surface.closest(points).astype(np.float64)

    @cached_property
    def count(self) -> int:
        """Connected bodies, crumbs left out; such as touch along an edge are one, as they are in a mesh."""
        vertices, faces = self.mesh
        same = np.unique(vertices, axis=0, return_inverse=True)[1].reshape(-1)[faces]
        volume = signed_volumes(vertices, faces, EdgeTable(same).bodies)
        return int((volume > _CRUMB * self.body.volume()).sum())

    @cached_property
    def cavities(self) -> list[Floats]:
        """(N, 3) the corners of each."""
        vertices, faces = self.mesh
        label = EdgeTable(faces).bodies
        volume = signed_volumes(vertices, faces, label)
        found = np.flatnonzero(volume < -_VOID * self.body.volume())
        return [vertices[np.unique(faces[label == k])] for k in found]

    def sign(self, points: Floats) -> Floats:
        return self.distance(points.astype(np.float32)).astype(np.float64)


def far_places(shape: Solid, other: Solid) -> list[Place]:
    """Of another body beside a shape, the farthest first."""
    points, feet, off, lacks = _apart(shape, other)
    found = []
    for side in (True, False):
        mine = np.flatnonzero(lacks == side)
        if not len(mine):
            continue
        tree = cKDTree(points[mine])
        number, label = connected_components(tree.sparse_distance_matrix(tree, _ONE), directed=False)
        for k in range(number):
            one = mine[label == k]
            if off[one].max() > NEARLY * FAR:
                both = np.concatenate([points[one], feet[one]])
                found.append(Place(both, side, float(off[one].max())))
    return sorted([*found, *_voids(shape, other)], key=lambda place: -place.off)


def _voids(shape: Solid, other: Solid) -> Iterator[Place]:
    """Cavities deep in the shape, between parts that do not quite meet: too narrow for most of their points
    to have open space beside them, but no less hollow for that."""
    for corners in other.cavities:
        off = float(shape.away(corners).max())
        if off > NEARLY * FAR and (shape.sign(corners) < 0).all():
            yield Place(corners, True, off)


def reach(shape: Solid, other: Solid, box: Floats, least: float = _REGION * FAR) -> float:
    """How far the surfaces are apart in a box (2, 3), unit lengths; 0 where that is less than `least`, and
    infinite where only one of both has any."""
    return float(_apart(shape, other, box, least)[2].max(initial=0.0))


def loose_places(shape: Solid, other: Solid) -> list[Place]:
    """Where pieces of the other body nearly touch its largest, if it has more of them than the shape."""
    pieces = sorted(bodies(other.body, _CRUMB * shape.body.volume(), 0.0), key=lambda piece: -piece[0])
    if len(pieces) < 2 or other.count <= shape.count:
        return []
    found = []
    largest = pieces[0][1]
    rest = Solid(largest, other.distance).surface
    volume = sum(one for one, _ in pieces)
    for own, piece in pieces[1:]:
        points = Solid(piece, other.distance).points()
        gap = rest.unsigned(points)
        near = points[gap < gap.min() + _GAP]
        across = rest.closest(near)
        middle = (near + across) / 2
        if (shape.sign(middle) < 0).mean() > _WITHIN:
            off = float(gap.min())
            found.append(Place(np.concatenate([near, across]), True, off, gap=True, floats=own / volume))
    return found


def _apart(
    shape: Solid, other: Solid, box: Floats | None = None, least: float = _REGION * FAR
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Points (N, 3) of both surfaces that are further from the other than `least`, their feet (N, 3) there,
    how far (N,), and whether the other body lacks something there (N,)."""
    found: list[Floats] = []
    lacks: list[NDArray[np.bool_]] = []
    for one, across, here in ((shape, other, True), (other, shape, False)):
        points = one.points(box)
        off = across.away(points)
        far = np.flatnonzero(off > least)
        far = far[~buried(one.sign, points[far])]
        points = points[far]
        outside = across.sign(points) > 0
        # In a slit of the other body, the shape's surface that is nearest may lie on the far side of a wall.
        feet = np.where((outside | here)[:, None], across.feet(points), points)
        found.append(np.column_stack([points, feet, off[far]]))
        lacks.append(outside == here)
    both = np.concatenate(found)
    return both[:, :3], both[:, 3:6], both[:, 6], np.concatenate(lacks)
