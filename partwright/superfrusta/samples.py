"""What a fit sees of a shape: signed distances on a grid and at weighted sample points, in the unit frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial

import numpy as np
from numpy.typing import NDArray

from partwright.fields.columns import WIDTH, Column
from partwright.fields.kernel import Target
from partwright.methods import Checkpoint, Run
from partwright.metrics.deviation import buried
from partwright.shapes import Shape
from partwright.shapes.grid import DistanceGrid, grid_indices
from partwright.shapes.sampling import morton_order
from partwright.superfrusta.backend import Kernel, backend, watched
from partwright.superfrusta.far_cells import ALONG, CELL, HALF_SIDE, beyond_too, cell_middles, cell_of
from partwright.superfrusta.part_surfaces import surface_points
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetry import NEARLY, Isometry, Symmetry, generated_by, symmetries

Rows = NDArray[np.float32]
NOTHING: Rows = np.empty((0, WIDTH), np.float32)

_MOST_PADDING_WEIGHT = 3.0  # of one point, where the weight of a sample in the box is 1
_SURFACE = 8000  # points of the shape's surface
_STRAY = 0.05  # unit lengths: what an assembly covers further than this from the shape is astray
_LOCAL_CELLS = 40  # of a local grid, along the longest side
_LOCAL_ROOM = 0.15  # of that side: how much further than the place the grid goes
_LOCAL_SAMPLES = 6000
_EXACT_WITHIN = 1.6  # voxels from the surface: between voxels that are, all are exact
_FAR = 0.1  # unit lengths from the shape
_NOT_FAR = 0.3
_REMEMBERED = 3  # assemblies, beside the last, whose field at the samples is kept
_ALIKE = 0.0125  # unit lengths: mean distance of the surface from its image
_FAR_COUNT = 400  # about so many samples stand for all that are far


@dataclass(frozen=True)
class FitSamples:
    """Samples (the first `near` lie near the surface, the rest fills the box and more) and the grid.

    They never change: `with_stray_samples` gives others, so that a score always says of which samples it is.
    """

    points: NDArray[np.float32]
    """(N, 3), unit frame."""
    distance: NDArray[np.float32]
    """(N,) signed distance of the shape."""
    weight: NDArray[np.float32]
    """(N,) 1 + sigmoid(curvature) near the surface (eq. 7), 1 in the box."""
    near: int
    grid: DistanceGrid
    seed: int
    threads: int
    device: str
    kernel: Kernel
    measure: Callable[[NDArray[np.float32]], NDArray[np.float32]]
    """Signed distance (n,) of the shape at points (n, 3)."""
    away: Callable[..., NDArray[np.float32]]
    """How far (n,) points (n, 3) are from the shape's surface, as `Shape.unit_away`."""
    density: float
    """Of the samples in the box, per unit volume."""
    probes: NDArray[np.float32]
    """(n, 3) points that are no samples yet, where a part that goes astray is looked for."""
    surface: NDArray[np.float32]
    """(n, 3) points of the shape's surface that can be seen, as many to each unit of area."""
    find_symmetries: Callable[[], tuple[Symmetry, ...]] = tuple
    """Looks, at the first call, for those of the shape that hold nearly, the most exact first."""
    growth: int = 0
    """Which of several growths they serve: each optimises on others of them."""
    _last: dict[bytes, NDArray[np.float32]] = field(default_factory=dict, init=False, compare=False)

    @classmethod
    def of(
        cls, shape: Shape, settings: Settings, run: Run | None = None, checkpoint: Checkpoint | None = None
    ) -> FitSamples:
        """Of a shape. The checkpoint is passed before every call of the kernel."""
        run = run or Run()
        grid = shape.unit_grid(settings.resolution)
        drawn = shape.samples(settings.near, settings.uniform, run.seed)
        around, padding_weight = padding(grid, settings.uniform, run.seed)
        return cls(
            np.concatenate([drawn.points, around]),
            np.concatenate([drawn.distance, shape.unit_distance(around)]),
            np.concatenate([drawn.weight, np.full(len(around), padding_weight, np.float32)]),
            drawn.near,
            grid,
            run.seed,
            run.threads,
            run.device,
            backend(run.device, checkpoint),
            shape.unit_distance,
            shape.unit_away,
            settings.uniform / float(np.prod(grid.spacing * np.array(grid.values.shape))),
            _probes(grid),
            _seen(shape, run.seed),
            cache(partial(symmetries, shape, settings, tolerance=NEARLY)) if settings.symmetry else tuple,
        )

    def variant(self, growth: int, checkpoint: Checkpoint, threads: int) -> FitSamples:
        """These for one of several growths, which passes a checkpoint of its own."""
        return replace(self, growth=growth, threads=threads, kernel=watched(self.kernel, checkpoint))

    def with_stray_samples(self, rows: Rows) -> FitSamples:
        """These and samples where an assembly is astray, well outside the shape; itself where it nowhere is.

        A thin part that shoots out of the shape passes between random samples. The probes are a lattice fine
        enough to meet it; those that do become samples, with the weight of the volume that they stand for.
        """
        surfaces = surface_points(rows[rows[:, Column.SIGN] > 0]).reshape(-1, 3)
        probes = np.concatenate([self.probes, self._probes_beyond(surfaces)])
        hit = np.flatnonzero(self.distance_of(rows, probes) < 0)
        distance = self.measure(probes[hit])
        hit, distance = hit[distance > _STRAY], distance[distance > _STRAY]
        if len(hit) == 0:
            return self
        return replace(
            self,
            points=np.concatenate([self.points, probes[hit]]),
            distance=np.concatenate([self.distance, distance.astype(np.float32)]),
            weight=np.concatenate([self.weight, np.full(len(hit), self._probe_weight, np.float32)]),
            probes=np.delete(self.probes, hit[hit < len(self.probes)], axis=0),
        )

    @cached_property
    def far_cells(self) -> NDArray[np.bool_]:
        """Those further from the shape than the `lattice` goes, as `middles_within` takes them."""
        return beyond_too(self.near_distance(cell_middles()) > _NOT_FAR)

    def _probes_beyond(self, surfaces: NDArray[np.floating]) -> NDArray[np.float32]:
        """Probes (n, 3) as dense as the others, none that are samples already, about parts, of whose surfaces
        points (N, 3) are given, that reach out of the cube that those fill: of a body that is mostly cut away
        a chip may be left there."""
        if len(surfaces) == 0 or np.abs(surfaces).max() <= HALF_SIDE:
            return NOTHING[:, :3]
        first, last = cell_of(surfaces.min(0)), cell_of(surfaces.max(0))
        counts = last - first + 1
        cells = first + np.asarray(grid_indices(tuple(counts)))
        wanted = (np.abs(cells + 0.5).max(axis=1) > ALONG / 2).reshape(counts)
        wanted[tuple(self._cells_of_samples(first, counts))] = False
        return (CELL * (cells[wanted.ravel()] + 0.5)).astype(np.float32)

    def _cells_of_samples(self, first: NDArray[np.int64], counts: NDArray[np.int64]) -> NDArray[np.int64]:
        """(3, n) beyond the cube, counted from the first of so many (3,)."""
        known = cell_of(self.points[np.abs(self.points).max(axis=1) > HALF_SIDE]) - first
        return known[((known >= 0) & (known < counts)).all(axis=1)].T

    def about(
        self, low: NDArray[np.floating], high: NDArray[np.floating], carved: Rows | None = None
    ) -> FitSamples:
        """These and more, with another grid, a little beyond the box between two corners (3,).

        carved: the assembly from which something is to be subtracted there. The grid then holds what that
        takes, and the shape's exact distance only where it is needed. These know of no other places, so of no
        symmetries.
        """
        room = _LOCAL_ROOM * float((high - low).max())
        low, high = low - room, high + room
        spacing = float((high - low).max()) / _LOCAL_CELLS
        counts = np.maximum(np.ceil((high - low) / spacing).astype(int), 4)
        origin = (low + high - spacing * (counts - 1)) / 2
        places = (origin + spacing * grid_indices(counts)).astype(np.float32)
        values = self.measure(places) if carved is None else self._where_covered(carved, places, spacing)
        grid = DistanceGrid(origin, spacing, values.reshape(counts))
        drawn = np.random.default_rng(self.seed).uniform(low, high, (_LOCAL_SAMPLES, 3))
        local = drawn.astype(np.float32)
        return replace(
            self,
            points=np.concatenate([self.points, local]),
            distance=np.concatenate([self.distance, self.measure(local)]),
            weight=np.concatenate([self.weight, np.ones(len(local), np.float32)]),
            grid=grid,
            find_symmetries=tuple,
        )

    def _where_covered(self, rows: Rows, places: NDArray[np.float32], spacing: float) -> NDArray[np.float32]:
        """Signed distance (n,) of the shape at places (n, 3), as far as it says what rows cover too much.

        That is max(F, -S), within a voxel of it (growing._pieces). What is read off the whole grid is enough
        where it tells the shape's sign, unless it may decide that.
        """
        grid, field, read = self.grid, self.distance_of(rows, places), self.near_distance(places)
        # A distance between voxels is no further from theirs than they are, and far off these are rough.
        wrong = grid.spacing * np.where(np.abs(read) < _EXACT_WITHIN * grid.spacing, 0.87, 1.87)
        cell = (places - grid.origin) / grid.spacing
        between = ((cell >= 0) & (cell <= np.array(grid.values.shape) - 1)).all(axis=1)
        decides = (field <= spacing) & ~(between & (read - wrong > np.maximum(-field, spacing + field)))
        outside = (read > wrong) & ~decides
        inside = (read < -wrong) & ((field > spacing) | (read + wrong < -spacing))
        asked = np.flatnonzero(~(outside | inside))
        read[asked] = self.measure(places[asked])
        return read

    def stray_weight(self, rows: Rows) -> NDArray[np.float64]:
        """Weight (M,) of the probes that each part alone covers, as they would have it as samples."""
        # Row by row: along an axis NumPy counts by adding, which takes ten times as long.
        hits = np.array([np.count_nonzero(row) for row in self.covered_by(rows, self.probes)], np.int64)
        return np.asarray(hits * self._probe_weight, dtype=np.float64)

    @property
    def _probe_weight(self) -> float:
        return self.density * CELL**3

    @cached_property
    def images(self) -> tuple[Isometry, ...]:
        """What takes the shape to itself, well enough for a part to be tried where they take it."""
        return generated_by(self.find_symmetries(), _ALIKE)

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        return self.distance < 0

    @cached_property
    def _coordinates(self) -> NDArray[np.float32]:
        """(3, N), each coordinate's in one piece."""
        return np.ascontiguousarray(self.points.T)

    def within(self, low: NDArray[np.float32], high: NDArray[np.float32]) -> NDArray[np.int64]:
        """Indices of the samples in a box."""
        inside = np.ones(len(self.points), bool)
        for along, least, most in zip(self._coordinates, low, high, strict=True):
            inside &= (along > least) & (along < most)
        return np.flatnonzero(inside)

    @cached_property
    def grid_points(self) -> NDArray[np.float32]:
        """(X * Y * Z, 3), in the order of grid.values.ravel()."""
        return self.grid.points().astype(np.float32)

    @cached_property
    def _bricks(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """The order in which the kernel is quickest over the grid, and the points (X * Y * Z, 3) in it."""
        order = self.grid.in_bricks()
        return order, self.grid_points[order]

    @cached_property
    def lattice(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Voxels (n, 3) wholly inside the shape, every second, and outside but not far, every fourth; and the
        shape's distance (n,) there."""
        values = self.grid.values.ravel()
        inside = np.flatnonzero(values < -self.grid.spacing)[::2]
        outside = np.flatnonzero((values > self.grid.spacing) & (values < _NOT_FAR))[::4]
        index = np.concatenate([inside, outside])
        return self.grid_points[index], values[index]

    def lattice_field(self, rows: Rows) -> NDArray[np.float32]:
        """Distance (n,) of the assembly on the lattice, for which it is asked brick by brick."""
        order, points = self._lattice_bricks
        field = np.empty(len(order), np.float32)
        field[order] = self.distance_of(rows, points)
        return field

    @cached_property
    def _lattice_bricks(self) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        points, _ = self.lattice
        order = morton_order(points)
        return order, points[order]

    @cached_property
    def voxel(self) -> NDArray[np.int64]:
        """Index into grid.values.ravel() of the voxel that each sample lies in (or is nearest to)."""
        return voxel_of(self.grid, self.points)

    @cached_property
    def inside_voxels(self) -> int:
        return int(np.count_nonzero(self.grid.values < 0))

    @cached_property
    def thickness(self) -> float:
        """Typical depth of the solid: the 90 % quantile of the depths inside."""
        inside = self.grid.values[self.grid.values < 0]
        return float(-np.quantile(inside, 0.1)) if len(inside) else self.grid.spacing

    @cached_property
    def optimised_indices(self) -> NDArray[np.int64]:
        """The samples that optimisation runs on: every second one near the surface, every third elsewhere.

        Of further growths as many, drawn by lot: from a hair's breadth aside growth comes to other parts.
        """
        if self.growth == 0:
            return np.concatenate([np.arange(0, self.near, 2), np.arange(self.near, len(self.points), 3)])
        rng = np.random.default_rng((self.seed, self.growth))
        near = rng.choice(self.near, (self.near + 1) // 2, replace=False)
        away = len(self.points) - self.near
        rest = self.near + rng.choice(away, (away + 2) // 3, replace=False)
        return np.concatenate([np.sort(near), np.sort(rest)])

    @cached_property
    def far_indices(self) -> NDArray[np.int64]:
        """A few hundred samples far outside: they keep a part fitted to one region from running away."""
        outside = self.near + np.flatnonzero(self.distance[self.near :] > _FAR)
        return outside[:: max(1, len(outside) // _FAR_COUNT)]

    def target(self, index: NDArray[np.int64], weight: NDArray[np.float32] | None = None) -> Target:
        """Samples by index as the kernel takes them; weights are scaled to sum to 1."""
        weight = self.weight[index] if weight is None else weight
        return Target(self.points[index], self.distance[index], weight / max(float(weight.sum()), 1e-9))

    def field(self, rows: Rows) -> NDArray[np.float32]:
        """Distance (N,) of the assembly at the samples. Of those that were asked for last it is known: a
        search asks for its score, its IoU and whether it is the best, and may try several at once."""
        key = rows.tobytes()
        known = self._last.get(key)
        if known is None:
            known = self.distance_of(rows, self.points)
            for oldest in list(self._last)[:-_REMEMBERED]:
                self._last.pop(oldest, None)
            self._last[key] = known
        return known

    def field_at(self, rows: Rows, index: NDArray[np.int64]) -> NDArray[np.float32]:
        """Distance (n,) of the assembly at some of the samples."""
        known = self._last.get(rows.tobytes())
        return self.distance_of(rows, self.points[index]) if known is None else known[index]

    def grid_field(self, rows: Rows) -> NDArray[np.float32]:
        """Distance (X, Y, Z) of the assembly on the grid."""
        order, points = self._bricks
        field = np.empty(len(order), np.float32)
        field[order] = self.distance_of(rows, points)
        return field.reshape(self.grid.values.shape)

    def near_distance(self, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Signed distance (n,) of the shape at points (n, 3), read off the grid."""
        return self.grid.read(points).astype(np.float32)

    def distance_of(self, rows: Rows, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance (N,) of the assembly at points; far outside where there are no parts yet."""
        if len(rows) == 0:
            return np.full(len(points), np.float32(10))
        return self.kernel.evaluate(rows, points, self.threads)

    def parts_of(self, rows: Rows, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance (M, N) of each part alone."""
        return self.kernel.evaluate_parts(rows, points, self.threads)

    def covered_by(self, rows: Rows, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Whether each part alone covers each point (M, N)."""
        return self.kernel.covered(rows, points, self.threads)


def _seen(shape: Shape, seed: int) -> NDArray[np.float32]:
    """Points (n, 3) of a shape's surface, but for faces between bodies that meet: what covers both covers
    those, and is not to blame."""
    drawn = shape.unit_surface(_SURFACE, seed)
    return drawn.points[~buried(shape.unit_distance, drawn.points, drawn.normals)]


def padding(grid: DistanceGrid, uniform: int, seed: int) -> tuple[NDArray[np.float32], float]:
    """Points (G, 3) around the box that the uniform samples fill, and the weight of each.

    Without them nothing would stop a part from growing out of the box. The weight makes up for their lower
    density, up to a limit: a few points of more weight would outvote all that lies near them.
    """
    low = grid.origin
    high = low + grid.spacing * (np.array(grid.values.shape) - 1)
    rng = np.random.default_rng(seed + 1)
    points = rng.uniform(-HALF_SIDE, HALF_SIDE, (uniform // 3, 3)).astype(np.float32)
    points = points[((points < low) | (points > high)).any(axis=1)]
    points = points[morton_order(points)]
    around = (2 * HALF_SIDE) ** 3 - float(np.prod(high - low))
    density = around / max(len(points), 1) * uniform / float(np.prod(high - low))
    return points, min(density, _MOST_PADDING_WEIGHT)


def _probes(grid: DistanceGrid) -> NDArray[np.float32]:
    """Lattice points (n, 3), each moved within its cell, that may lie well outside the shape."""
    points = _all_probes()
    voxel = voxel_of(grid, points)
    values, nearest = grid.values.ravel()[voxel], grid.points_of(voxel).astype(np.float32)
    return points[values + np.linalg.norm(points - nearest, axis=1) > _STRAY]


@cache
def _all_probes() -> NDArray[np.float32]:
    """Of an empty space (ALONG ** 3, 3), in the order in which the kernel is quickest."""
    corner = grid_indices((ALONG,) * 3)
    within = np.random.default_rng(0).uniform(0.1, 0.9, corner.shape)
    points = (CELL * (corner + within) - HALF_SIDE).astype(np.float32)
    return points[morton_order(points)]


def voxel_of(grid: DistanceGrid, points: NDArray[np.float32]) -> NDArray[np.int64]:
    """Index (N,) into grid.values.ravel() of the voxel nearest to each point (N, 3)."""
    shape = np.array(grid.values.shape)
    cell = np.rint((points - grid.origin) / grid.spacing).astype(np.int64)
    return np.ravel_multi_index(tuple(np.clip(cell, 0, shape - 1).T), tuple(shape))
