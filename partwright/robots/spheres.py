"""A link as so many spheres, as motion planners on GPUs collide it.

Points of the solid are shared out among spheres, each of which then becomes the smallest around its points,
or the one of their volume; both are repeated, as in k-means, from the deepest places on.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_fit import smallest_ball
from partwright.meshing.manifolds import surface_of
from partwright.robots.solids import Target
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    from manifold3d import Manifold

_ROUNDS = 12
_INSIDE, _SURFACE = 14, 3000  # cells along the solid's box; points of its surface
_MARGIN = 1e-6
_ERRORS = ("mean", "best", "worst")
Spheres = np.ndarray  # (N, 4): centre and radius


def spheres_for(target: Target, count: int, around: bool, seed: int = 0) -> Spheres:
    """(N, 4) centres and radii of at most `count` spheres in the link's frame.

    around: they contain every point of the target's surface that is tried, and its corners; else they are so
    large that they lack about as much volume as they add.
    """
    surface = target.samples(_SURFACE, seed)
    inside = _points_inside(target.solid)
    points = np.concatenate([surface, inside])
    centres = _spread_out(points, count)
    for _ in range(_ROUNDS):
        owner = _nearest(points, centres)
        found = [smallest_ball(points[owner == i]) for i in np.unique(owner)]
        moved = np.array([centre for centre, _ in found])
        if moved.shape == centres.shape and np.allclose(moved, centres, atol=1e-4 * target.size):
            break
        centres = moved
    owner = _nearest(points, centres)
    radii = np.array([_reach(points[owner == i], centre) for i, centre in enumerate(centres)])
    spheres = np.column_stack([centres, radii])[radii > 0]
    if not around:
        return _balanced(spheres, target.solid)
    fresh = target.samples(10 * _SURFACE, seed + 1)
    beyond = np.min(np.linalg.norm(fresh[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3], axis=1)
    spheres[:, 3] += max(float(beyond.max()), 0.0) + _MARGIN * target.size
    return spheres


def curobo(spheres: Mapping[str, Spheres]) -> bytes:
    """As the YAML of cuRobo's robot configurations."""
    lines = ["collision_spheres:"]
    for link, found in spheres.items():
        lines.append(f"  {json.dumps(link)}:")
        for x, y, z, radius in found.tolist():
            lines.append(f"    - center: [{x:.6g}, {y:.6g}, {z:.6g}]")
            lines.append(f"      radius: {radius:.6g}")
    return ("\n".join(lines) + "\n").encode()


def errors_of(spheres: Spheres, target: Target) -> dict[str, float]:
    """Mean, smallest and largest distance of the target's surface from that of the spheres, as lengths."""
    points = target.samples(_SURFACE, seed=2)
    distance = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
    apart = np.abs(distance.min(axis=1))
    return {
        name: _short(float(v))
        for name, v in zip(_ERRORS, (apart.mean(), apart.min(), apart.max()), strict=True)
    }


def as_json(spheres: Mapping[str, Spheres], errors: Mapping[str, Mapping[str, float]]) -> bytes:
    """For each link its errors, and a list of `origin` and `radius`, as foam's sphere decompositions have
    them."""
    whole = {
        link: {
            **errors[link],
            "spheres": [{"origin": [_short(v) for v in row[:3]], "radius": _short(row[3])} for row in found],
        }
        for link, found in spheres.items()
    }
    return (json.dumps(whole, indent=1) + "\n").encode()


def _short(value: float) -> float:
    return float(f"{value:.6g}")


def _points_inside(solid: Manifold) -> np.ndarray:
    vertices, faces = surface_of(solid)
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    size = float((upper - lower).max())
    step = size / _INSIDE
    axes = [np.arange(low + step / 2, high, step) for low, high in zip(lower, upper, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    signed = MeshDistance((vertices - lower) / size, faces, faces, True).signed((points - lower) / size)
    return points[signed < 0]


def _spread_out(points: np.ndarray, count: int) -> np.ndarray:
    """Points of which each is the farthest from those before it, the first the nearest to the middle."""
    first = int(((points - points.mean(axis=0)) ** 2).sum(axis=1).argmin())
    chosen, distance = [first], np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < min(count, len(points)):
        chosen.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return points[chosen]


def _nearest(points: np.ndarray, centres: np.ndarray) -> np.ndarray:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(centres).query(points)[1])


def _reach(points: np.ndarray, centre: np.ndarray) -> float:
    return float(np.linalg.norm(points - centre, axis=1).max(initial=0.0))


def _balanced(spheres: Spheres, solid: Manifold) -> Spheres:
    """All radii smaller by one factor, at which the spheres fill as much as the solid does."""
    from manifold3d import Manifold, OpType

    def filled(factor: float) -> float:
        balls = [Manifold.sphere(factor * r, 32).translate((x, y, z)) for x, y, z, r in spheres.tolist()]
        return float(Manifold.batch_boolean(balls, OpType.Add).volume())

    low, high = 0.3, 1.0
    for _ in range(12):
        middle = (low + high) / 2
        low, high = (middle, high) if filled(middle) < solid.volume() else (low, middle)
    return np.column_stack([spheres[:, :3], high * spheres[:, 3]])
