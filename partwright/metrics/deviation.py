"""How far apart two surfaces are, and where most."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.metrics.metric import Metric
from partwright.render.camera import picture_axes
from partwright.shapes.distance import MeshDistance

if TYPE_CHECKING:
    from partwright.metrics.comparison import Comparison
    from partwright.shapes import Shape

COUNT = 30_000
_STEP = 5e-4  # unit lengths: half of what a field's slope is measured over
_STEPS = 3
_FIRST = 0.02  # of all points: so many are measured at the field first
_ON = 1e-4  # a point whose distance is less lies on the surface
_APART = 0.005  # unit lengths: surfaces that are nearer need no second look
_BESIDE = 0.01  # unit lengths from a face at which open space is looked for
_NARROW = 0.5  # of that: a distance that is less is no open space
_FURTHEST = 500  # points whose side is asked for at once
_MIDDLE = 1 / 3  # of a half extent: nearer to the middle than this a direction is not named


@dataclass(frozen=True)
class Deviation:
    """maximum, quantile_95: lengths, both ways. protrusion: the furthest that the first surface is outside of
    the second. worst_point: (3,) where the maximum is."""

    maximum: float
    protrusion: float
    quantile_95: float
    worst_point: np.ndarray


def deviation(
    on_first: np.ndarray, to_second: np.ndarray, on_second: np.ndarray, to_first: np.ndarray, beyond: float
) -> Deviation:
    """Of dense samples of two surfaces; the maximum is the larger of both directions' (a sampled Hausdorff
    distance), and so is the 95 % quantile.

    on_first, on_second: (N, 3) and (M, 3) surface points; to_second, to_first: their unsigned distances
    across. beyond: the `protrusion`.
    """
    points, distances = (on_first, to_second) if to_second.max() >= to_first.max() else (on_second, to_first)
    worst = int(distances.argmax())
    quantile = max(float(np.quantile(to_second, 0.95)), float(np.quantile(to_first, 0.95)))
    at = np.asarray(points[worst], dtype=np.float64)
    return Deviation(float(distances[worst]), beyond, quantile, at)


def protrusion(
    signed: Callable[[np.ndarray], np.ndarray], points: np.ndarray, distances: np.ndarray
) -> float:
    """The largest of the distances (N,) among the points (N, 3) that lie outside; 0 where none does.

    signed: distance of points (n, 3). Its sign costs most, so it is asked for the furthest points first.
    """
    order = np.argsort(-distances, kind="stable")
    for some in np.split(order, range(_FURTHEST, len(order), _FURTHEST)):
        outside = np.asarray(signed(points[some])) > 0
        if outside.any():
            return float(distances[some[outside.argmax()]])
    return 0.0


def surface_deviation(
    shape: Shape,
    distance: Callable[[np.ndarray], np.ndarray],
    vertices: np.ndarray,
    faces: np.ndarray,
    result: np.ndarray,
    target: np.ndarray,
) -> Deviation:
    """Between a shape's surface and that of a field `distance` with this mesh, all in the unit frame.

    result: (N, 3) points of the mesh; target: (M, 3) points of the shape's surface. The input's corners count
    too, but nothing that is `buried`. Where the surfaces are furthest apart the field has the word: its mesh
    cuts corners off.
    """
    corners = shape.frame.to_unit(shape.vertices)
    if len(corners) > COUNT:
        corners = corners[:: -(-len(corners) // COUNT)]
    on_shape = np.concatenate([target, corners])
    to_result = MeshDistance(vertices, np.asarray(faces), np.asarray(faces), True).exact(on_shape)
    apart = np.flatnonzero(to_result > _APART)
    shown = np.delete(np.arange(len(on_shape)), apart[buried(shape.unit_distance, on_shape[apart])])
    on_shape, to_result = on_shape[shown], to_result[shown]

    def to_field(some: np.ndarray) -> np.ndarray:
        feet, on_it = projected(distance, on_shape[some])
        there = np.linalg.norm(feet - on_shape[some], axis=1)
        return np.where(on_it, np.minimum(there, to_result[some]), to_result[some])

    to_result = _furthest_again(to_result, to_field)
    to_shape = shape.unit_unsigned(result)
    apart = np.flatnonzero(to_shape > _APART)
    shown = np.delete(np.arange(len(result)), apart[buried(distance, result[apart])])
    result, to_shape = result[shown], to_shape[shown]

    def of_field(some: np.ndarray) -> np.ndarray:
        result[some], _ = projected(distance, result[some])
        return shape.unit_unsigned(result[some])

    to_shape = _furthest_again(to_shape, of_field)
    return deviation(result, to_shape, on_shape, to_result, protrusion(shape.unit_distance, result, to_shape))


def _furthest_again(distances: np.ndarray, measured: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Distances (N,), the largest measured again until none that is left is larger than all of these.

    measured: distances (n,) of the points with these indices (n,).
    """
    again = distances.copy()
    order = np.argsort(-distances, kind="stable")
    largest, start, count = 0.0, 0, max(1, round(_FIRST * len(order)))
    while start < len(order) and distances[order[start]] > largest:
        some = order[start : start + count]
        again[some] = measured(some)
        largest = max(largest, float(again[some].max()))
        start, count = start + count, 2 * count
    return again


def buried(
    distance: Callable[[np.ndarray], np.ndarray], points: np.ndarray, normals: np.ndarray | None = None
) -> np.ndarray:
    """Which (N,) of the points (N, 3) of a solid's faces have no open space beside them, unit frame.

    They lie inside, as those of shells that overlap, or in a crack narrower than 0.5 % of the longest side.
    distance: signed, of points (n, 3). normals: (N, 3), outwards, where most have open space.
    """
    corners = np.stack(np.meshgrid(*[(-1.0, 1.0)] * 3), axis=-1).reshape(-1, 3) / 3**0.5
    closed = np.ones(len(points), bool)
    if normals is not None:
        closed = np.asarray(distance(points + _BESIDE * normals)) < _NARROW * _BESIDE
    for way in _BESIDE * np.concatenate([np.eye(3), -np.eye(3), corners]):
        left = np.flatnonzero(closed)  # most points have open space in one of the first ways
        if len(left):
            closed[left] = np.asarray(distance(points[left] + way)) < _NARROW * _BESIDE
    return closed


def projected(
    distance: Callable[[np.ndarray], np.ndarray], points: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) moved onto a field's surface by Newton steps along its slope, and which (N,) got there.

    Those that did not (the field has a crease in between) stay where they were.
    """
    moved = np.asarray(points, dtype=np.float64)
    axes = _STEP * np.eye(3)
    for _ in range(_STEPS):
        sides = np.concatenate([moved[None] + axes[:, None], moved[None] - axes[:, None]]).reshape(-1, 3)
        high, low = np.asarray(distance(sides), dtype=np.float64).reshape(2, 3, -1)
        slope = (high - low).T / (2 * _STEP)
        square = np.maximum((slope * slope).sum(axis=1), 0.1)
        moved = moved - (np.asarray(distance(moved)) / square)[:, None] * slope
    arrived = np.abs(distance(moved)) < _ON
    return np.where(arrived[:, None], moved, points), arrived


def place_name(unit_point: np.ndarray, unit_size: np.ndarray, up: str | None = None) -> str:
    """A place in words, as seen from the front: "front upper left", "right", "middle".

    unit_point: (3,) from the bounding box's centre; unit_size: (3,) its sides; up: the up axis, z if None.
    """
    words = (("right", "left"), ("upper", "lower"), ("front", "back"))
    named = []
    for axis, (positive, negative) in zip(picture_axes(up or "z"), words, strict=True):
        share = float(unit_point @ axis) / max(float(unit_size @ np.abs(axis)) / 2, 1e-12)
        named.append(positive if share > _MIDDLE else negative if share < -_MIDDLE else "")
    return " ".join(word for word in reversed(named) if word) or "middle"


def place_in(shape: Shape, unit_point: np.ndarray) -> str:
    """Where a point (3,) of the unit frame is in a shape, in words."""
    size = shape.frame.length_to_unit(np.ptp(shape.vertices, axis=0))
    return place_name(unit_point, size, shape.up)


def places_in(shape: Shape, unit_points: Iterable[np.ndarray]) -> str:
    """Where points (3,) of the unit frame are in a shape, in words: that of the first, and whether others are
    elsewhere."""
    first, *others = dict.fromkeys(place_in(shape, point) for point in unit_points)
    return f"{first} and elsewhere" if others else first


def _in_input_units(pair: Comparison, length: float) -> float:
    return float(pair.shape.frame.length_from_unit(length))


MAX_DEVIATION = Metric(lambda pair: _in_input_units(pair, pair.deviation.maximum), "lower")
MAX_PROTRUSION = Metric(lambda pair: _in_input_units(pair, pair.deviation.protrusion), "lower")
DEVIATION_95 = Metric(lambda pair: _in_input_units(pair, pair.deviation.quantile_95), "lower")
