"""A shape: a surface with an inside, its own units and place, and everything a fit asks of it."""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright.errors import NotFiniteError, PartwrightError, SettingError
from partwright.shapes.curvature import CurvatureField
from partwright.shapes.frame import UnitFrame
from partwright.shapes.grid import DistanceGrid, distance_grid, occupancy_grid
from partwright.shapes.hidden_faces import Ground
from partwright.shapes.holes import Openings
from partwright.shapes.lengths import Length, own_length
from partwright.shapes.reading import read_source, source_of
from partwright.shapes.repair import Surface, repair
from partwright.shapes.sampling import (
    NEAR_SIGMA,
    Samples,
    SurfaceSamples,
    curvature_weight,
    morton_order,
    near_surface,
    sample_triangles,
    sample_with_normals,
    uniform_box,
)
from partwright.shapes.source import Piece, Source
from partwright.shapes.topology import area_vectors, compacted, signed_volumes
from partwright.shapes.units import axis_vector, canonical_unit, canonical_up

if TYPE_CHECKING:
    import trimesh

_T = TypeVar("_T")
_D = TypeVar("_D", bound=np.generic)
_CURVATURE_POINTS = 40_000


@dataclass(frozen=True)
class Node:
    """A named piece of the file: rows start..stop of `shape.input_faces`."""

    name: str
    start: int
    stop: int


class NodeLeftOutWarning(UserWarning):
    """A node of a scene encloses nothing, so it is no shape by itself."""


class Shape:
    """What comes in. Build one with `load_shape`.

    name: of the file, without its suffix, or of the node. file: its name with the suffix, None for what
    was in memory. vertices (V, 3) float64 and faces (F, 3) int64: the repaired outer surface in own
    units. input_vertices, input_faces: as read, before any repair; `nodes` are ranges of input_faces.
    frame: to the unit frame and back. unit: "mm", "m" ... or None; up: "x", "y", "z", "-z" ... or None.
    points: (N, 3) as read, own units, where it came as points, else None. repairs: what was done to the
    surface, a sentence each. openings: how much of the surface the input left out, and where the most of
    it, own units. left_out: share of the area that sheets took, and that is no part of it. sealed: the
    surface is that of the solid that is seen in triangles which are open in many places. confidence: 0 to 1,
    how sure inside and outside are. thickness: that its sheets were given, own units, or None.
    reading_seconds: that `load_shape` took, 0 for a node. Results are cached by their arguments; returned
    arrays are read-only.
    """

    def __init__(self, source: Source) -> None:
        name, pieces = source.name, source.pieces
        offsets = np.cumsum([0] + [len(p.vertices) for p in pieces])
        ends = np.cumsum([0] + [len(p.faces) for p in pieces]).tolist()
        self.name, self.unit, self.up = name, source.unit, source.up
        self.file, self.points = source.file, source.points
        self.input_vertices = np.concatenate([p.vertices for p in pieces])
        self.input_faces = np.concatenate([p.faces + o for p, o in zip(pieces, offsets[:-1], strict=True)])
        self.nodes = tuple(Node(p.name, a, b) for p, a, b in zip(pieces, ends[:-1], ends[1:], strict=True))
        used, compact = compacted(self.input_faces, len(self.input_vertices))
        corners = self.input_vertices[used]  # a vertex that no triangle uses may hold anything
        finite = np.isfinite(corners).all(axis=1)
        if not finite.all():
            raise NotFiniteError(
                f"{name}: {np.count_nonzero(~finite)} of {len(used)} vertices have a NaN or infinite "
                "coordinate; all coordinates must be finite. Export the shape again"
            )
        self._ground = source.ground
        if source.up is not None and source.ground is None:
            self._ground = float((corners @ axis_vector(source.up)).min())
        self.thickness, self._sealing = source.thickness, source.sealing
        self.frame, self._surface = _named(
            name, lambda: _repaired(corners, compact, replace(source, ground=self._ground))
        )
        self.vertices = self.frame.from_unit(self._surface.vertices)
        self.faces = self._surface.faces
        self.repairs = source.repairs + self._surface.repairs
        self.confidence = min(source.confidence, self._surface.confidence)
        self.openings = self._own(self._surface.openings)
        self.left_out = self._surface.left_out
        self.sealed = self._surface.sealed
        self._source = self._surface.distance()
        self.reading_seconds = 0.0
        self._cache: dict[tuple[Any, ...], Any] = {}

    def __repr__(self) -> str:
        return f"Shape({self.name!r}, {len(self.faces)} triangles, unit={self.unit}, up={self.up})"

    def __getstate__(self) -> dict[str, Any]:
        """All but what is computed from it, so that a shape can go to another process."""
        return {name: value for name, value in vars(self).items() if name not in ("_source", "_cache")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state, _source=state["_surface"].distance(), _cache={})

    @property
    def area(self) -> float:
        """Area of the outer surface in own units squared."""
        corners = self.vertices[self.faces]
        normal = area_vectors(corners)
        return float(np.linalg.norm(normal, axis=1).sum() / 2)

    @property
    def volume(self) -> float:
        """Volume in own units cubed: exact where the surface is simple, else counted on a 128^3 grid."""
        if self._surface.simple:
            zero = np.zeros(len(self.faces), dtype=np.int64)
            unit_volume = float(signed_volumes(self._surface.vertices, self._surface.faces, zero)[0])
        else:
            unit_volume = float(np.count_nonzero(self.unit_occupancy(128))) * (2 / 128) ** 3
        return unit_volume / self.frame.scale**3

    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) lowest and highest corner of the outer surface, own units."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    def split_nodes(self) -> list[Shape]:
        """Each node as a shape of its own, named after the node, with this shape's unit and up axis.

        A node that encloses nothing (a decal, a glass pane) is left out with a NodeLeftOutWarning; when that
        leaves no node, the last one's error is raised.
        """
        shapes: list[Shape] = []
        failure: PartwrightError | None = None
        for node in self.nodes:
            piece = Piece(node.name, self.input_vertices, self.input_faces[node.start : node.stop])
            alone = Source(
                node.name,
                (piece,),
                self.unit,
                self.up,
                ground=self._ground,
                thickness=self.thickness,
                sealing=self._sealing,
            )
            try:
                shapes.append(Shape(alone))
            except PartwrightError as error:
                failure = error
                warnings.warn(f"node left out: {error}", NodeLeftOutWarning, stacklevel=2)
        if not shapes and failure is not None:
            raise failure
        return shapes

    def signed_distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Signed distance (N,) at points (N, 3), both in own units, negative inside."""
        unit = self.unit_distance(self.frame.to_unit(points))
        return self.frame.length_from_unit(unit)

    def unit_distance(self, points: ArrayLike) -> NDArray[np.float32]:
        """Signed distance (N,) at points (N, 3), both in the unit frame, negative inside.

        Raises NotFiniteError for NaN or infinite points.
        """
        return self.unit_nearest(points)[0]

    def unit_unsigned(self, points: ArrayLike) -> NDArray[np.float64]:
        """Distance (N,) to the surface at points (N, 3), both in the unit frame: `unit_distance` without the
        sign, in double precision.

        Raises as `unit_distance` does.
        """
        return self._source.exact(_checked(points))

    def unit_away(self, points: ArrayLike, within: float = np.inf) -> NDArray[np.float32]:
        """How far (N,) points (N, 3) are from the surface, both in the unit frame: `unit_distance` without
        the sign, which takes longer to find than the distance. Anything greater than `within` where it is so.

        Raises as `unit_distance` does.
        """
        return self._source.unsigned(_checked(points), within)

    def unit_nearest(self, points: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Signed distance (N,) at points (N, 3), unit frame, and the row (N,) of `faces` that is nearest.

        Raises as `unit_distance` does.
        """
        return self._source.signed_nearest(_checked(points))

    def unit_surface(self, count: int, seed: int = 0) -> SurfaceSamples:
        """`count` area-weighted points of the surface with normals and curvature, unit frame."""
        return self._cached(("surface", count, seed), lambda: self._sample_surface(count, seed))

    def unit_grid(self, resolution: int = 96) -> DistanceGrid:
        """Signed distance on voxels of size 1.8 / (resolution - 4) over the bounding box and two voxels more.

        Exact within 2.5 voxels of the surface, 0.07 voxel too large on average beyond.
        """
        if resolution < 8:
            raise SettingError(f"grid resolution {resolution} was given; expected 8 or more")
        return self._cached(
            ("grid", resolution), lambda: distance_grid(self._source, *self._unit_bounds(), resolution)
        )

    def unit_occupancy(self, resolution: int = 128) -> NDArray[np.bool_]:
        """Inside or not (R, R, R) at the cell centres of [-1, 1]^3."""
        if resolution < 1:
            raise SettingError(f"occupancy resolution {resolution} was given; expected 1 or more")
        return self._cached(
            ("occupancy", resolution), lambda: occupancy_grid(self._source, *self._unit_bounds(), resolution)
        )

    def samples(
        self, near: int, uniform: int, seed: int = 0, sigma: float | Sequence[float] = NEAR_SIGMA
    ) -> Samples:
        """`near` points near the surface, then `uniform` ones in the box, with signed distance and weight.

        Near points are surface samples moved by isotropic Gaussian noise, an equal share for each sigma (unit
        lengths). Weights: 1 + sigmoid(curvature) near the surface (SuperFrusta, eq. 7), 1 elsewhere.
        """
        widths = (sigma,) if isinstance(sigma, (int, float)) else tuple(sigma)
        if near < 0 or uniform < 0 or not widths or min(widths) < 0:
            raise SettingError(
                f"near={near}, uniform={uniform}, sigma={widths}: none of them may be negative or empty"
            )
        return self._cached(
            ("samples", near, uniform, seed, widths), lambda: self._sample(near, uniform, seed, widths)
        )

    @property
    def unit_mesh(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Vertices (V, 3) in the unit frame and faces (F, 3) of the repaired outer surface."""
        return self._surface.vertices, self._surface.faces

    def _own(self, openings: Openings) -> Openings:
        if openings.largest is None:
            return openings
        x, y, z = self.frame.from_unit(openings.largest).tolist()
        return replace(openings, largest=(x, y, z))

    def _unit_bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return self._surface.vertices.min(axis=0), self._surface.vertices.max(axis=0)

    def _sample_surface(self, count: int, seed: int) -> SurfaceSamples:
        points, normal = sample_with_normals(*self.unit_mesh, count, seed)

        def curvature() -> NDArray[np.float32]:
            return _read_only(self._cached(("curvature",), self._curvature)(points).astype(np.float32))

        return SurfaceSamples(points.astype(np.float32), normal.astype(np.float32), curvature)

    def _curvature(self) -> CurvatureField:
        vertices, faces = self._surface.vertices, self._surface.faces
        points = sample_triangles(vertices, faces, _CURVATURE_POINTS, 0)[0]
        return CurvatureField(vertices, faces, points, float(self.area * self.frame.scale**2))

    def _sample(self, near: int, uniform: int, seed: int, sigma: tuple[float, ...]) -> Samples:
        seeds = np.random.SeedSequence(seed).generate_state(3)
        surface = self.unit_surface(near, int(seeds[0]))
        close = near_surface(surface.points, sigma, int(seeds[1]))
        around = uniform_box(*self._unit_bounds(), uniform, int(seeds[2]))
        first, second = morton_order(close), morton_order(around)
        points = np.concatenate([close[first], around[second]])
        weight = np.concatenate([curvature_weight(surface.curvature[first]), np.ones(uniform, np.float32)])
        return Samples(points, self._source.signed(points), weight, near)

    def _cached(self, key: tuple[Any, ...], make: Callable[[], _T]) -> _T:
        if key not in self._cache:
            made = make()
            for value in [made, *vars(made).values()] if hasattr(made, "__dict__") else [made]:
                if isinstance(value, np.ndarray):
                    _read_only(value)
            self._cache[key] = made
        return self._cache[key]


def load_shape(
    source: str | Path | trimesh.Trimesh | tuple[ArrayLike, ArrayLike] | NDArray[Any],
    unit: str | None = None,
    up: str | None = None,
    thickness: Length | None = None,
) -> Shape:
    """Shape of a file, a Trimesh, (vertices (V, 3), faces (F, 3)), points (N, 3 or 6) or a grid (nx, ny, nz).

    Points and grids become a mesh first; `repairs` says so, and `confidence` how well the points bear it out.
    `unit` and `up` state what the file does not say, or overrule it; the geometry is never scaled or turned.
    Where up is known, so is the ground: openings as low as anything lies are closed.
    `thickness` makes walls of surfaces that are open or flat, half of it on either side, where they would be
    filled or left out; in own units, or text as "2mm" or "1%" of the longest side.
    Raises UnsupportedFormatError, UnreadableFileError, EmptyShapeError, NeedsSurfaceError, NotFiniteError,
    FlatShapeError, OpenShellError, GridError, MissingDependencyError, or SettingError for an unknown unit or
    axis, or a thickness that is no length above 0.
    """
    started = time.perf_counter()
    stated_unit = None if unit is None else canonical_unit(unit)
    stated_up = None if up is None else canonical_up(up)
    if isinstance(source, (str, Path)):
        read = replace(read_source(Path(source)), file=Path(source).name)
    else:
        read = source_of(source)
    read = replace(read, unit=stated_unit or read.unit, up=stated_up or read.up)
    shape = Shape(read if thickness is None else replace(read, thickness=_wall(thickness, read)))
    shape.reading_seconds = time.perf_counter() - started
    return shape


def _wall(thickness: Length, source: Source) -> float:
    """The thickness in the source's own units."""
    corners = np.concatenate([piece.vertices[piece.faces].reshape(-1, 3) for piece in source.pieces])
    longest = float(np.ptp(corners, axis=0).max())
    try:
        wall = own_length(thickness, source.unit, longest)
    except SettingError as error:
        raise SettingError(f"thickness: {error}") from error
    if longest > 0 and not 0 < wall <= longest / 2:  # without any length the mesh is what is wrong
        raise SettingError(
            f"thickness: expected a length above 0, and at most half of the longest side, got {thickness!r}"
        )
    return wall


def _repaired(
    corners: NDArray[np.float64], faces: NDArray[np.int64], source: Source
) -> tuple[UnitFrame, Surface]:
    """The surface of corners (V, 3), own units, and faces (F, 3), and the unit frame that it is in. source:
    what they are of, and what is known and wanted of it."""
    frame = UnitFrame.of(corners)
    ground = None
    if source.up is not None and source.ground is not None:
        above = axis_vector(source.up)
        ground = Ground(above, float(frame.to_unit(source.ground * above) @ above))
    wall = None if source.thickness is None else float(frame.length_to_unit(source.thickness))
    surface = repair(frame.to_unit(corners), faces, ground, wall, sealing=source.sealing)
    return surface.in_frame(frame)


def _checked(points: ArrayLike) -> NDArray[Any]:
    array = np.asarray(points)
    if array.ndim != 2 or array.shape[1] != 3:
        raise SettingError(f"points of shape {array.shape} were given; expected (N, 3)")
    if not np.isfinite(array).all():
        raise NotFiniteError("points hold NaN or infinite coordinates; all must be finite")
    return array


def _read_only(array: NDArray[_D]) -> NDArray[_D]:
    array.setflags(write=False)
    return array


def _named(name: str, work: Callable[[], _T]) -> _T:
    """Run the repair and put the shape's name before the message of an error."""
    try:
        return work()
    except PartwrightError as error:
        raise type(error)(f"{name}: {error}") from error
