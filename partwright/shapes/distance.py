"""Where distances come from. A shape asks a `DistanceSource`; meshes answer with `MeshDistance`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import product
from operator import attrgetter
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright._kernel import TriangleTree
from partwright.at_once import share_of
from partwright.shapes.topology import area_vectors
from partwright.shapes.winding import closing_fans, winding_grid

_CHUNK = 262_144  # closest-point queries at once: a query's record takes about 100 bytes
_INSIDE = 0.5  # generalised winding number above which a point is inside
_BLOCK = 2
_FEW_OPEN = 20  # triangles to an open edge, from which the open edges count as few
_LATTICE = 0.02  # spacing of the sign lattice, unit frame
_SLACK = 1.0001  # on squared bounds, for their rounding to single precision
_MANY = 2000  # points from which the lattice pays; once it is made, it serves fewer too
_WITHIN = 1e-3  # barycentric margin from which on a point is surely beside a triangle and not an edge


class DistanceSource(Protocol):
    """Distances and inside tests in the unit frame."""

    def unsigned(self, points: NDArray[Any], within: float = np.inf) -> NDArray[np.float32]:
        """Distance to the surface at points (N, 3); anything greater than `within` where it is greater."""

    def exact(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """As `unsigned`, in double precision."""

    def closest(self, points: NDArray[Any]) -> NDArray[np.float32]:
        """Nearest surface point (N, 3) of each of the points (N, 3)."""

    def signed(self, points: NDArray[Any]) -> NDArray[np.float32]:
        """Distance to the surface at points (N, 3), negative inside."""

    def signed_nearest(self, points: NDArray[Any]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """As `signed`, and the triangle (N,) that is nearest."""

    def inside_grid(
        self, origin: ArrayLike, spacing: float, shape: tuple[int, int, int]
    ) -> NDArray[np.bool_]:
        """Whether the points origin + spacing * (i, j, k) lie inside: (nx, ny, nz)."""


class MeshDistance:
    """Distance to triangles (FCPW's bounding volume hierarchy), sign by winding number: by the kernel where
    the surface is closed, else by libigl.

    In single precision, good to 1e-6 but at long triangles that are narrower than a hundredth of their
    length, where it may be wrong by a thousandth of that. `exact` is for lengths that are told or decide.
    `faces` (F, 3) is the surface that distances are measured to. `winding_faces` decide what is inside; they
    may hold more (sheets inside the shape). `closed` says that they have no open edge, so that their winding
    number is an integer and whole grids can be scan converted; `embedded` that the closed surface nowhere
    passes through itself, which makes most signs cheap. Results do not depend on the number of threads.
    """

    def __init__(
        self,
        vertices: NDArray[np.float64],
        faces: NDArray[np.int64],
        winding_faces: NDArray[np.int64],
        closed: bool,
        embedded: bool = False,
    ) -> None:
        self._vertices = vertices
        self._faces = faces
        self._winding_faces = winding_faces
        self._closed = closed
        self._embedded = embedded

    @cached_property
    def _scene(self) -> Any:
        import fcpw

        if not len(self._faces):
            raise ValueError("a surface without triangles is nowhere near: FCPW would end the process")
        scene = fcpw.scene_3D()
        scene.set_object_count(1)
        scene.set_object_vertices(np.asfortranarray(self._vertices, dtype=np.float32), 0)
        scene.set_object_triangles(np.asfortranarray(self._faces, dtype=np.int32), 0)
        scene.build(fcpw.aggregate_type.bvh_surface_area, True, False, False)
        return scene

    @cached_property
    def _tree(self) -> TriangleTree:
        return self._tree_of(self._faces)

    @cached_property
    def _winding_tree(self) -> TriangleTree:
        same = self._winding_faces is self._faces
        return self._tree if same else self._tree_of(self._winding_faces)

    def _tree_of(self, faces: NDArray[np.int64]) -> TriangleTree:
        vertices = np.ascontiguousarray(self._vertices, dtype=np.float64)
        return TriangleTree(vertices, np.ascontiguousarray(faces, dtype=np.int64))

    @cached_property
    def _winding(self) -> Any:
        import igl

        tree = igl.FastWindingNumberBVH()
        tree.init(np.ascontiguousarray(self._vertices), np.ascontiguousarray(self._winding_faces))
        return tree

    def unsigned(self, points: NDArray[Any], within: float = np.inf) -> NDArray[np.float32]:
        """Distance to the nearest triangle at points (N, 3); anything greater than `within` if it is greater.

        A bound makes the search quicker.
        """
        return np.concatenate([_distances(found) for found in self._find(points, within)])

    def exact(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """Distance to the nearest triangle at points (N, 3) in double precision, good to 1e-15.

        Takes one to three times as long as `unsigned`.
        """
        if len(points) == 0:
            return np.zeros(0)
        return np.sqrt(
            self._tree.squared_distances(np.ascontiguousarray(points, dtype=np.float64), share_of(0))
        )

    def closest(self, points: NDArray[Any]) -> NDArray[np.float32]:
        """Nearest surface point (N, 3) of each of the points (N, 3)."""
        triangle = np.concatenate([_triangles(found) for found in self._find(points)])
        return closest_on_triangles(self._vertices[self._faces[triangle]], points).astype(np.float32)

    def nearest(self, points: NDArray[Any]) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """Nearest triangle (N,) of each of the points (N, 3), and the distance (N,) to it."""
        found = list(self._find(points))
        return (
            np.concatenate([_triangles(f) for f in found]),
            np.concatenate([_distances(f) for f in found]),
        )

    def signed(self, points: NDArray[Any]) -> NDArray[np.float32]:
        """Distance to the nearest triangle at points (N, 3), negative inside."""
        return self.signed_nearest(points)[0]

    def signed_nearest(self, points: NDArray[Any]) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Distance (N,) to the nearest triangle at points (N, 3), negative inside; and that triangle (N,)."""
        triangle, distance = self.nearest(points)
        if len(points) >= _MANY or "_lattice" in vars(self):
            inside = self._inside_by_lattice(points, distance, triangle)
        else:
            inside = self.inside(points)
        return np.where(inside, -distance, distance), triangle

    def _find(self, points: NDArray[Any], within: float = np.inf) -> Iterator[Any]:
        """Records of the nearest triangles, chunk by chunk."""
        import fcpw

        for start in range(0, max(len(points), 1), _CHUNK):
            chunk = np.asfortranarray(points[start : start + _CHUNK], dtype=np.float32)
            found = fcpw.interaction_3D_list()
            if len(chunk):
                bound = np.full(len(chunk), within * within * _SLACK, np.float32)
                self._scene.find_closest_points(chunk, bound, found, False)
            yield found

    @cached_property
    def _lattice(self) -> tuple[NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_]]:
        """Origin and inside flags of points `_LATTICE` apart over the bounding box, and where to trust them.

        Where the surface passes through itself or is open, the sign may change where no triangle is: there
        only points whose neighbours have the same flag are trusted.
        """
        from scipy.ndimage import maximum_filter, minimum_filter

        corners = self._vertices[self._faces]
        lower, upper = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
        sides = np.ceil((upper - lower) / _LATTICE).astype(int) + 2
        origin = lower - _LATTICE / 2
        flags = self.inside_grid(origin, _LATTICE, (int(sides[0]), int(sides[1]), int(sides[2])))
        if self._embedded:
            return origin, flags, np.ones_like(flags)
        return origin, flags, maximum_filter(flags, 3) == minimum_filter(flags, 3)

    def _inside_by_lattice(
        self, points: NDArray[Any], distance: NDArray[np.float32], triangle: NDArray[np.int32]
    ) -> NDArray[np.bool_]:
        """Sign without winding numbers for most points.

        A ball of radius `distance` around a point is free of surface, so a lattice point in it has the same
        sign. Nearer points whose closest point lies within a triangle are inside exactly when they are behind
        it. What remains (closest to an edge or a corner) goes by winding number.
        """
        origin, flags, trusted = self._lattice
        cell = np.rint((points - origin) / _LATTICE).astype(np.int64)
        within = ((cell >= 0) & (cell < flags.shape)).all(axis=1)
        inside = np.zeros(len(points), dtype=bool)
        inside[within] = flags[tuple(cell[within].T)]
        far = within & (distance > _LATTICE)  # half a cell's diagonal is 0.87 of it
        near = np.flatnonzero(within & ~far)
        doubtful = np.flatnonzero(far)[~trusted[tuple(cell[far].T)]]
        side, sure = _side_of_triangle(self._vertices[self._faces[triangle[near]]], points[near], _WITHIN)
        sure &= (side < 0) == inside[near]
        rest = np.concatenate([near[~sure], doubtful])
        inside[rest] = self.inside(points[rest])
        return inside

    def winding(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """Generalised winding number (N,) at points (N, 3) (Barill et al. 2018), to about 0.01."""
        if len(points) == 0:
            return np.zeros(0)
        return np.asarray(self._winding.winding_number(np.ascontiguousarray(points, dtype=np.float64)))

    def inside(self, points: NDArray[Any]) -> NDArray[np.bool_]:
        """Whether points (N, 3) lie inside."""
        if self._closed and len(points):
            places = np.ascontiguousarray(points, dtype=np.float64)
            return self._winding_tree.windings(places, share_of(0)) > 0
        return self.winding(points) > _INSIDE

    def inside_grid(
        self, origin: ArrayLike, spacing: float, shape: tuple[int, int, int]
    ) -> NDArray[np.bool_]:
        """Whether the points origin + spacing * (i, j, k) lie inside: (nx, ny, nz)."""
        start = np.asarray(origin, dtype=np.float64)
        if self._closed:
            return winding_grid(self._vertices, self._winding_faces, start, spacing, shape) > 0
        vertices, fans = self._fans
        if len(fans) * _FEW_OPEN <= len(self._winding_faces):
            return self._inside_grid_ajar(vertices, fans, start, spacing, shape)
        return self._inside_grid_open(start, spacing, shape)

    @cached_property
    def _fans(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        return closing_fans(self._vertices, self._winding_faces)

    def _inside_grid_ajar(
        self,
        vertices: NDArray[np.float64],
        fans: NDArray[np.int64],
        origin: NDArray[np.float64],
        spacing: float,
        shape: tuple[int, int, int],
    ) -> NDArray[np.bool_]:
        """Flags of a surface with a few open edges: the winding number of the surface closed by fans, less
        that of the fans, which matters only where it can reach one half. It never does where the fans are
        farther away than the radius of a half sphere of their area.
        """
        import igl

        closed = winding_grid(vertices, np.concatenate([self._winding_faces, fans]), origin, spacing, shape)
        inside = closed > 0
        corners = vertices[fans]
        normal = area_vectors(corners)
        reach = np.sqrt(np.linalg.norm(normal, axis=1).sum() / (4 * np.pi))
        first = np.clip((corners.min(axis=(0, 1)) - reach - origin) / spacing, 0, shape).astype(int)
        stop = np.clip((corners.max(axis=(0, 1)) + reach - origin) / spacing + 1, 0, shape).astype(int)
        box = tuple(slice(a, b) for a, b in zip(first, stop, strict=True))
        if inside[box].size:
            places = origin + spacing * (first + grid_indices(inside[box].shape))
            fan_winding = np.asarray(igl.winding_number(vertices, fans, places)).reshape(inside[box].shape)
            inside[box] = closed[box] - fan_winding > _INSIDE
        return inside

    def _inside_grid_open(
        self, origin: NDArray[np.float64], spacing: float, shape: tuple[int, int, int]
    ) -> NDArray[np.bool_]:
        """Flags in blocks of 2^3 points: the winding number is harmonic off the surface, so a block that no
        triangle comes near and whose corners agree clearly agrees throughout; the others go point by point.
        """
        blocks = tuple(-(-n // _BLOCK) for n in shape)
        corners = grid_indices([b + 1 for b in blocks])
        clear = self.winding(origin + spacing * _BLOCK * corners).reshape([b + 1 for b in blocks])
        ends = np.stack(
            [
                clear[tuple(slice(o, o + b) for o, b in zip(offset, blocks, strict=True))]
                for offset in product((0, 1), repeat=3)
            ]
        )
        centres = grid_indices(blocks) + 0.5
        away = self.unsigned(origin + spacing * _BLOCK * centres).reshape(blocks) > spacing * _BLOCK * 0.87
        settled = away & ((ends.min(axis=0) > _INSIDE + 0.1) | (ends.max(axis=0) < _INSIDE - 0.1))
        inside = ends[0] > _INSIDE
        for axis in range(3):
            settled, inside = np.repeat(settled, _BLOCK, axis), np.repeat(inside, _BLOCK, axis)
        crop = tuple(slice(0, n) for n in shape)
        settled, inside = settled[crop], inside[crop].copy()
        todo = np.argwhere(~settled)
        inside[~settled] = self.inside(origin + spacing * todo)
        return inside


def grid_indices(sides: Sequence[int]) -> NDArray[np.int64]:
    """All (i, j, k) of a grid (nx * ny * nz, 3), the last index running fastest."""
    return np.moveaxis(np.indices(tuple(sides)), 0, -1).reshape(-1, 3)


def _distances(found: Any) -> NDArray[np.float32]:
    return np.fromiter(map(attrgetter("d"), found), np.float32, len(found))


def _triangles(found: Any) -> NDArray[np.int32]:
    return np.fromiter(map(attrgetter("primitive_index"), found), np.int32, len(found))


def _side_of_triangle(
    corners: NDArray[np.float64], points: NDArray[Any], margin: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Side of its triangle (N, 3, 3) a point (N, 3) is on, positive in front; whether it projects into it,
    further from its edges than a barycentric margin.
    """
    u, v = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    w = points - corners[:, 0]
    normal = np.cross(u, v)
    square = np.maximum((normal * normal).sum(axis=1), np.finfo(np.float64).tiny)
    second = (np.cross(u, w) * normal).sum(axis=1) / square
    first = (np.cross(w, v) * normal).sum(axis=1) / square
    within = (first > margin) & (second > margin) & (first + second < 1 - margin)
    return (w * normal).sum(axis=1), within


def closest_on_triangles(corners: NDArray[np.float64], points: NDArray[Any]) -> NDArray[np.float64]:
    """Point (N, 3) of each triangle (N, 3, 3) that is closest to the point (N, 3) of the same row."""
    side, within = _side_of_triangle(corners, points, 0.0)
    normal = area_vectors(corners)
    square = np.maximum((normal * normal).sum(axis=1), np.finfo(np.float64).tiny)
    best = points - (side / square)[:, None] * normal
    least = np.where(within, 0.0, np.inf)
    for k in range(3):
        start, along = corners[:, k], corners[:, (k + 1) % 3] - corners[:, k]
        length = np.maximum((along * along).sum(axis=1), np.finfo(np.float64).tiny)
        fraction = np.clip(((points - start) * along).sum(axis=1) / length, 0.0, 1.0)
        foot = start + fraction[:, None] * along
        squared = ((points - foot) ** 2).sum(axis=1)
        nearer = squared < least
        best[nearer], least[nearer] = foot[nearer], squared[nearer]
    return best
