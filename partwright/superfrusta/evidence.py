"""What a fit sees of a shape: signed distances on a grid and at weighted sample points, in the unit frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partwright.fields.kernel import COLUMNS, Target
from partwright.shapes import Shape
from partwright.shapes.grid import DistanceGrid
from partwright.shapes.sampling import morton_order
from partwright.superfrusta.backend import Kernel, backend
from partwright.superfrusta.settings import Settings

Rows = NDArray[np.float32]
NOTHING: Rows = np.empty((0, len(COLUMNS)), np.float32)

_REACH = 1.2  # half the side of the cube that guards and probes fill
_LOUDEST = 3.0
_PROBES = 48  # along a side of that cube
_STRAY = 0.05  # an assembly that reaches further than this from the shape is astray
_FAR, _FEW = 0.1, 400


@dataclass
class Evidence:
    """Samples (the first `near` lie near the surface, the rest fills the box and more) and the grid.

    points (N, 3), distance (N,), weight (N,) = 1 + sigmoid(curvature) near the surface (eq. 7), 1 in the box.
    measure: signed distance (n,) of the shape at points (n, 3). `learn` adds samples.
    """

    points: NDArray[np.float32]
    distance: NDArray[np.float32]
    weight: NDArray[np.float32]
    near: int
    grid: DistanceGrid
    threads: int
    kernel: Kernel
    measure: Callable[[NDArray[np.float32]], NDArray[np.float32]]
    density: float = 0.0  # of the samples in the box, per unit volume

    @classmethod
    def of(cls, shape: Shape, settings: Settings) -> Evidence:
        grid = shape.unit_grid(settings.resolution)
        samples = shape.samples(settings.near, settings.uniform, settings.seed)
        guards, density = _guards(grid, settings)
        return cls(
            np.concatenate([samples.points, guards]),
            np.concatenate([samples.distance, shape.unit_distance(guards)]),
            np.concatenate([samples.weight, np.full(len(guards), density, np.float32)]),
            samples.near,
            grid,
            settings.threads,
            backend(settings.device),
            shape.unit_distance,
            settings.uniform / float(np.prod(grid.spacing * np.array(grid.values.shape))),
        )

    def learn(self, rows: Rows) -> bool:
        """Adds samples where an assembly is astray, well outside the shape; says whether there were any.

        A thin part that shoots out of the shape passes between random samples. The probes are a lattice fine
        enough to meet it; those that do become samples, with the weight of the volume that they stand for.
        """
        hit = np.flatnonzero(self.distance_of(rows, self._probes) < 0)
        distance = self.measure(self._probes[hit])
        hit, distance = hit[distance > _STRAY], distance[distance > _STRAY]
        if len(hit) == 0:
            return False
        self.points = np.concatenate([self.points, self._probes[hit]])
        self.distance = np.concatenate([self.distance, distance.astype(np.float32)])
        self.weight = np.concatenate([self.weight, np.full(len(hit), self._probe_weight, np.float32)])
        self._probes = np.delete(self._probes, hit, axis=0)
        for name in ("inside", "voxel", "training", "outskirts"):
            self.__dict__.pop(name, None)
        return True

    def astray(self, rows: Rows) -> NDArray[np.float64]:
        """Weight (M,) of the probes that each part alone covers, as `learn` would give it to them."""
        hits = (self.parts_of(rows, self._probes) < 0).sum(axis=1)
        return np.asarray(hits * self._probe_weight, dtype=np.float64)

    @property
    def _probe_weight(self) -> float:
        return self.density * (2 * _REACH / _PROBES) ** 3

    @cached_property
    def _probes(self) -> NDArray[np.float32]:
        """Lattice points (n, 3), each moved within its cell, that may lie well outside the shape."""
        cell = 2 * _REACH / _PROBES
        corner = np.stack(np.meshgrid(*[np.arange(_PROBES)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        within = np.random.default_rng(0).uniform(0.1, 0.9, corner.shape)
        points = (cell * (corner + within) - _REACH).astype(np.float32)
        values = self.grid.values.ravel()[self._voxel_of(points)]
        nearest = self.grid_points[self._voxel_of(points)]
        return points[values + np.linalg.norm(points - nearest, axis=1) > _STRAY]

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        return self.distance < 0

    @cached_property
    def grid_points(self) -> NDArray[np.float32]:
        """(X * Y * Z, 3), in the order of grid.values.ravel()."""
        return self.grid.points().astype(np.float32)

    @cached_property
    def voxel(self) -> NDArray[np.int64]:
        """Index into grid.values.ravel() of the voxel that each sample lies in (or is nearest to)."""
        return self._voxel_of(self.points)

    def _voxel_of(self, points: NDArray[np.float32]) -> NDArray[np.int64]:
        shape = np.array(self.grid.values.shape)
        cell = np.rint((points - self.grid.origin) / self.grid.spacing).astype(np.int64)
        return np.ravel_multi_index(tuple(np.clip(cell, 0, shape - 1).T), tuple(shape))

    @cached_property
    def inside_voxels(self) -> int:
        return int(np.count_nonzero(self.grid.values < 0))

    @cached_property
    def thickness(self) -> float:
        """Typical depth of the solid: the 90 % quantile of the depths inside."""
        inside = self.grid.values[self.grid.values < 0]
        return float(-np.quantile(inside, 0.1)) if len(inside) else self.grid.spacing

    @cached_property
    def training(self) -> NDArray[np.int64]:
        """The samples that optimisation runs on: every second one near the surface, every third elsewhere."""
        return np.concatenate([np.arange(0, self.near, 2), np.arange(self.near, len(self.points), 3)])

    @cached_property
    def outskirts(self) -> NDArray[np.int64]:
        """A few hundred samples far outside: they keep a part fitted to one region from running away."""
        outside = self.near + np.flatnonzero(self.distance[self.near :] > _FAR)
        return outside[:: max(1, len(outside) // _FEW)]

    def target(self, index: NDArray[np.int64], weight: NDArray[np.float32] | None = None) -> Target:
        """Samples by index as the kernel takes them; weights are scaled to sum to 1."""
        weight = self.weight[index] if weight is None else weight
        return Target(self.points[index], self.distance[index], weight / max(float(weight.sum()), 1e-9))

    def field(self, rows: Rows) -> NDArray[np.float32]:
        """Distance (N,) of the assembly at the samples."""
        return self.distance_of(rows, self.points)

    def grid_field(self, rows: Rows) -> NDArray[np.float32]:
        """Distance (X, Y, Z) of the assembly on the grid."""
        return self.distance_of(rows, self.grid_points).reshape(self.grid.values.shape)

    def distance_of(self, rows: Rows, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance (N,) of the assembly at points; far outside where there are no parts yet."""
        if len(rows) == 0:
            return np.full(len(points), np.float32(10))
        return self.kernel.evaluate(rows, points, self.threads)

    def parts_of(self, rows: Rows, points: NDArray[np.float32]) -> NDArray[np.float32]:
        """Distance (M, N) of each part alone."""
        return self.kernel.evaluate_parts(rows, points, self.threads)


def _guards(grid: DistanceGrid, settings: Settings) -> tuple[NDArray[np.float32], float]:
    """Points (G, 3) around the box that the uniform samples fill, and their weight.

    Without them nothing would stop a part from growing out of the box. The weight makes up for their lower
    density, up to a limit beyond which few points would speak too loudly.
    """
    low = grid.origin
    high = low + grid.spacing * (np.array(grid.values.shape) - 1)
    rng = np.random.default_rng(settings.seed + 1)
    points = rng.uniform(-_REACH, _REACH, (settings.uniform // 3, 3)).astype(np.float32)
    points = points[((points < low) | (points > high)).any(axis=1)]
    points = points[morton_order(points)]
    around = (2 * _REACH) ** 3 - float(np.prod(high - low))
    density = around / max(len(points), 1) * settings.uniform / float(np.prod(high - low))
    return points, min(density, _LOUDEST)
