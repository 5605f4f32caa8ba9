"""Points on, near and around a shape, all in the unit frame and repeatable by seed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partwright.rows import units
from partwright.shapes.topology import area_vectors, doubled_areas

NEAR_SIGMA = (0.02, 0.005)  # unit lengths; half of the near samples each
_ENLARGED = 0.05  # unit lengths that the box of the uniform samples reaches beyond the bounding box


@dataclass(frozen=True)
class SurfaceSamples:
    """Area-weighted points (N, 3) and outward normals (N, 3)."""

    points: NDArray[np.float32]
    normals: NDArray[np.float32]
    measure: Callable[[], NDArray[np.float32]] = field(repr=False, compare=False)
    """The curvature, which takes longer than all the rest and is rarely asked for."""

    @cached_property
    def curvature(self) -> NDArray[np.float32]:
        """|principal curvature| (N,) in 1/unit length."""
        return self.measure()


@dataclass(frozen=True)
class Samples:
    """Points (N, 3), signed distance (N,) and weight (N,), unit frame.

    The first `near` rows lie near the surface, the rest is uniform; each run is in Morton order.
    """

    points: NDArray[np.float32]
    distance: NDArray[np.float32]
    weight: NDArray[np.float32]
    near: int


def sample_triangles(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    count: int,
    seed: int,
    running: NDArray[np.float64] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """`count` points (N, 3) spread evenly over the area, and the triangle (N,) of each.

    Stratified along the running area, so that the number of points on any part is as even as it can be.

    running: the `running_area`, where it is known.
    """
    rng = np.random.default_rng(seed)
    running = running_area(vertices, faces) if running is None else running
    target = (np.arange(count) + rng.random(count)) * (running[-1] / max(count, 1))
    face = np.minimum(np.searchsorted(running, target, side="right"), len(faces) - 1)
    root, second = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    a, b, c = vertices[faces[face]].transpose(1, 0, 2)
    return (1 - root) * a + root * ((1 - second) * b + second * c), face


def running_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Twice the area (F,) of each triangle and all before it."""
    return np.cumsum(doubled_areas(vertices, faces))


def sample_with_normals(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], count: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """`count` points (N, 3) spread evenly over the area, and the outward unit normals (N, 3) of their
    triangles."""
    points, face = sample_triangles(vertices, faces, count, seed)
    return points, units(area_vectors(vertices[faces[face]]))


def near_surface(surface: NDArray[np.float32], sigma: Sequence[float], seed: int) -> NDArray[np.float32]:
    """Surface points (N, 3) moved by isotropic Gaussian noise, each sigma used for an equal share of them."""
    rng = np.random.default_rng(seed)
    width = np.asarray(sigma, dtype=np.float64)[rng.permutation(len(surface)) % len(sigma)]
    return (surface + width[:, None] * rng.standard_normal(surface.shape)).astype(np.float32)


def uniform_box(
    lower: NDArray[np.float64], upper: NDArray[np.float64], count: int, seed: int
) -> NDArray[np.float32]:
    """`count` points (N, 3) uniform in the slightly enlarged bounding box."""
    rng = np.random.default_rng(seed)
    span = upper - lower + 2 * _ENLARGED
    return (lower - _ENLARGED + span * rng.random((count, 3))).astype(np.float32)


def curvature_weight(curvature: NDArray[np.float32]) -> NDArray[np.float32]:
    """w = 1 + sigmoid(curvature) (SuperFrusta, eq. 7), between 1.5 on flat places and 2 on edges."""
    return (1.0 + 1.0 / (1.0 + np.exp(-curvature))).astype(np.float32)


def morton_order(points: NDArray[np.float32]) -> NDArray[np.int64]:
    """Order (N,) along a Z-curve of 1024^3 cells, so that neighbours in memory are neighbours in space."""
    lower = points.min(axis=0, initial=np.inf)
    span = max(float((points.max(axis=0, initial=-np.inf) - lower).max()), 1e-12) if len(points) else 1.0
    cell = ((points - lower) * (1023 / span)).astype(np.uint64)
    code = np.zeros(len(points), dtype=np.uint64)
    for axis in range(3):
        code |= _spread_bits(cell[:, axis]) << np.uint64(axis)
    return np.argsort(code, kind="stable")


def _spread_bits(x: NDArray[np.uint64]) -> NDArray[np.uint64]:
    """Two zero bits between each of the ten low bits."""
    for shift, mask in ((16, 0x030000FF), (8, 0x0300F00F), (4, 0x030C30C3), (2, 0x09249249)):
        x = (x | (x << np.uint64(shift))) & np.uint64(mask)
    return x
