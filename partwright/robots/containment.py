"""Whether shapes contain what they stand for: tried on fresh points, in double precision."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.approximation.hull_faces import beyond_faces, faces_of
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.hulls import hull_of
from partwright.robots.model import Shape

if TYPE_CHECKING:
    from manifold3d import Manifold

    from partwright.robots.solids import Target

_POINTS = 100_000  # of the triangles, that are tried
_SEGMENTS = 64


def sticking_out(shapes: Sequence[Shape], target: Target, seed: int = 1_000) -> float:
    """How far the target's surface sticks out of the shapes, by fresh points and all its corners; 0 for not
    at all, or for less than numbers in single precision, as mesh files have them, tell apart there."""
    samples = target.samples(_POINTS, seed)
    points = _left_out(shapes, samples)
    farthest = float(np.min([outside_of(shape, points) for shape in shapes], axis=0).max(initial=0.0))
    return told_apart(farthest, samples)


def told_apart(beyond: float, points: np.ndarray) -> float:
    """A length, or 0 where single precision, as mesh files have it, tells no such length apart at points
    (N, 3). Files whose own origin lies farther off than the link's tell even less."""
    return beyond if beyond > np.spacing(np.float32(np.abs(points).max())) else 0.0


def _left_out(shapes: Sequence[Shape], points: np.ndarray) -> np.ndarray:
    """Those of the points (N, 3) that are outside of all shapes."""
    for shape in shapes:
        lower, upper = np.reshape(shape_solid(shape).bounding_box(), (2, 3))
        room = 1e-3 * float((upper - lower).max())  # facets lie within what they stand for
        near = ((points > lower - room) & (points < upper + room)).all(axis=1)
        near[near] = outside_of(shape, points[near]) <= 0
        points = points[~near]
    return points


def outside_of(shape: Shape, points: np.ndarray) -> np.ndarray:
    """(N,) how far points are outside at most, in double precision; not positive inside."""
    if shape.part is None:
        return beyond_faces(points, *shape_planes(shape))
    local = (points - shape.part.translation) @ rotation_matrix(shape.part.rotation)
    match shape.part.field:
        case Box(size=size):
            return np.asarray((np.abs(local) - np.array(size) / 2).max(axis=1))
        case Sphere(radius=radius):
            return np.linalg.norm(local, axis=1) - radius
        case Cylinder(radius=radius, height=height):
            across = np.hypot(local[:, 0], local[:, 1]) - radius
            return np.maximum(across, np.abs(local[:, 2]) - height / 2)
        case Capsule(radius=radius, height=height):
            beyond = np.maximum(np.abs(local[:, 2]) - height / 2, 0)
            return np.sqrt(local[:, 0] ** 2 + local[:, 1] ** 2 + beyond**2) - radius
        case Ellipsoid(radii=radii):
            return (np.linalg.norm(local / np.array(radii), axis=1) - 1) * max(radii)
    raise AssertionError(f"{shape.part.field.kind} is no native solid")


def shape_planes(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Normals (F, 3) and offsets (F,) of a hull."""
    return faces_of(shape_solid(shape))


def shape_solid(shape: Shape) -> Manifold:
    """With curved surfaces as 64 facets to a circle, on corners that lie on the surface."""
    if shape.part is None:
        assert shape.mesh is not None
        return hull_of(np.asarray(shape.mesh.vertices))
    pose = np.column_stack([rotation_matrix(shape.part.rotation), shape.part.translation])
    return _native(shape.part.field).transform(pose)


def _native(field: Field) -> Manifold:
    from manifold3d import Manifold

    match field:
        case Box(size=size):
            return Manifold.cube(size, True)
        case Sphere(radius=radius):
            return Manifold.sphere(radius, _SEGMENTS)
        case Cylinder(radius=radius, height=height):
            return Manifold.cylinder(height, radius, circular_segments=_SEGMENTS, center=True)
        case Capsule(radius=radius, height=height):
            ball = Manifold.sphere(radius, _SEGMENTS)
            return Manifold.batch_hull([ball.translate((0, 0, side * height / 2)) for side in (1, -1)])
        case Ellipsoid(radii=radii):
            return Manifold.sphere(1.0, _SEGMENTS).scale(radii)
    raise AssertionError(f"{field.kind} is no native solid")


def larger(field: Field, by: float) -> Field:
    """Every point of its surface further out by at least a length."""
    match field:
        case Box(size=(x, y, z)):
            return Box((x + 2 * by, y + 2 * by, z + 2 * by))
        case Sphere(radius=radius):
            return Sphere(radius + by)
        case Cylinder(radius=radius, height=height):
            return Cylinder(radius + by, height + 2 * by)
        case Capsule(radius=radius, height=height):
            return Capsule(radius + by, height)
        case Ellipsoid(radii=(x, y, z)):
            factor = 1 + by / min(x, y, z)
            return Ellipsoid((factor * x, factor * y, factor * z))
    raise AssertionError(f"{field.kind} is no native solid")
