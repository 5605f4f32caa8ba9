"""Whether bounds hold: measured on dense samples of both surfaces that no fit has seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.meshing import mesh_assembly
from partwright.metrics.deviation import COUNT, projected, surface_deviation
from partwright.shapes import Shape
from partwright.shapes.sampling import sample_triangles
from partwright.tolerances.distance_bounds import DistanceBounds

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly

_COUNT = 100_000
_CORNERS = 100_000
_ROUNDING = 2e-6  # unit lengths: float32 keeps no more

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Side:
    """How far a bound is used, and where."""

    worst: float
    """The largest distance, unit lengths; negative where nothing sticks out."""
    point: Floats
    """(3,) where that is, unit frame."""


@dataclass(frozen=True)
class Checked:
    """Bounds beside what was measured."""

    bounds: DistanceBounds
    """What was asked."""
    found: dict[str, Side]
    """By the bounds' names; those that were not asked for are left out."""

    @property
    def excess(self) -> dict[str, float]:
        """By how much (unit lengths) bounds are missed; empty where all hold."""
        over = {name: side.worst - getattr(self.bounds, name) for name, side in self.found.items()}
        return {name: by for name, by in over.items() if by > _ROUNDING}

    @property
    def total_excess(self) -> float:
        """What all bounds are missed by (unit lengths), added; 0 where all hold."""
        return sum(self.excess.values())

    @property
    def worst_ratio(self) -> float:
        """The largest distance over the tolerance; 0 where none was asked for."""
        asked = self.bounds.tolerance
        return self.found["tolerance"].worst / asked if asked else 0.0

    @property
    def satisfied(self) -> bool:
        return not self.excess


def check(assembly: Assembly, shape: Shape, bounds: DistanceBounds, seed: int = 0) -> Checked:
    """Measures an assembly (unit frame) against a shape, on 100,000 fresh points of each surface, the shape's
    corners, and the middles of its edges.

    contain: the largest F at the shape's surface. inside: the largest distance from the shape of the
    assembly's surface. tolerance: the largest distance between the surfaces, both ways, as `max_deviation`.
    """
    seeds = [int(s) for s in np.random.SeedSequence([seed, 4]).generate_state(3)]
    on_shape = shape_points(shape, _COUNT, seeds[0])
    found = {}
    if bounds.contain is not None:
        found["contain"] = _side(assembly.distance(on_shape), on_shape)
    if bounds.inside is None and bounds.tolerance is None:
        return Checked(bounds, found)
    surface = mesh_assembly(assembly)
    if bounds.inside is not None:
        points = assembly_points(assembly, surface, _COUNT, seeds[1])
        depth = shape.unit_distance(points).astype(np.float64)
        beyond = depth > 0
        depth[beyond] = shape.unit_unsigned(points[beyond])
        found["inside"] = _side(depth, points)
    if bounds.tolerance is not None:
        vertices, faces = np.asarray(surface.vertices), np.asarray(surface.faces)
        on_mesh = sample_triangles(vertices, faces, COUNT, seeds[2])[0]
        apart = surface_deviation(
            shape, assembly.distance, vertices, faces, on_mesh, on_shape[: _COUNT : _COUNT // COUNT]
        )
        found["tolerance"] = Side(apart.maximum, apart.worst_point)
    return Checked(bounds, found)


def shape_points(shape: Shape, count: int, seed: int) -> NDArray[np.float32]:
    """Points (N, 3) of the shape's surface: spread evenly, its corners, and the middles of its edges."""
    corners = shape.frame.to_unit(shape.vertices)
    ends = shape.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    ends = ends[ends[:, 0] < ends[:, 1]]
    special = np.concatenate([corners, corners[ends].mean(axis=1)])
    if len(special) > _CORNERS:
        special = special[np.random.default_rng(seed).permutation(len(special))[:_CORNERS]]
    return np.concatenate([shape.unit_surface(count, seed).points, special.astype(np.float32)])


def assembly_points(
    assembly: Assembly, surface: trimesh.Trimesh, count: int, seed: int
) -> NDArray[np.float32]:
    """Points (N, 3) of a unit-frame assembly's surface: its mesh's, moved onto the field's zero level."""
    points, _ = sample_triangles(np.asarray(surface.vertices), np.asarray(surface.faces), count, seed)
    return projected(assembly.distance, points)[0].astype(np.float32)


def _side(distance: NDArray[np.floating], points: NDArray[np.float32]) -> Side:
    worst = int(distance.argmax())
    return Side(float(distance[worst]), points[worst].astype(np.float64))
