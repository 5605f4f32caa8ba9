"""The nearest solid that a format can hold, and how far off it is.

Exact members come back as they are. For the rest, solids are placed by the part's moments and fitted to its
field by least squares: the squared difference of the two distances, both clipped to a band of a few cells, is
a smooth stand-in for the volume in which part and solid disagree. The one with the highest IoU wins.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.approximation.recognise import SAME, exact_solid
from partwright.approximation.round_cone import RoundCone
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import NO_ROTATION, quaternion_product, rotation_matrix
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import Box, Capsule, Cone, Cylinder, Field, Frustum, Sphere, Torus, Tube
from partwright.least_squares import Damping, minimise

SOLIDS: tuple[type[Field], ...] = (Box, Cylinder, Cone, Frustum, Sphere, Capsule, Tube, Torus)

_CELLS, _MARGIN, _STRIDE = 24, 3, 3  # of the lattice; every third point of it is fitted to
_BAND = 2.0  # cells of the coarse lattice in which distances count
_FINALISTS = 3  # starts that are fitted
_DAMPING = Damping(trials=4, start=1e-2, down=0.2, up=10.0)
_LONGEST_STEP = 0.5  # of the logarithm of a length, and of the place where the part's longest side is 1
_A_LENGTH = 2e-3  # of IoU: what a solid with one more length must be better by
_STEP = 1e-3  # of the finite differences; the part's longest side is 1
_THIRD = (0.5, 0.5, 0.5, 0.5)  # z to x, x to y, y to z
_AXES = (NO_ROTATION, _THIRD, (0.5, -0.5, -0.5, -0.5))
_FLIP = (0.0, 1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Approximation:
    """A solid in a part's stead.

    solid: the field. part_with_solid: the part with it, placed; name, blend and metadata are the part's own.
    volume_error_ratio: volume that is in one of the two only, over the part's.
    max_deviation: of the surfaces, in the part's unit, to about a 24th of its box.
    """

    solid: Field
    part_with_solid: Part
    volume_error_ratio: float
    max_deviation: float

    @property
    def exact(self) -> bool:
        return self.volume_error_ratio == 0.0


def nearest_solid(part: Part, kinds: Sequence[type[Field]] = SOLIDS) -> Approximation:
    """The nearest of `kinds` (`SOLIDS`, `Ellipsoid` and `RoundCone`) to the part alone, unblended.

    Raises:
        NoSurfaceError: the part has no volume.
        ParameterError: none of `kinds` can be fitted.
    """
    exact = exact_solid(part.field)
    if exact is not None and isinstance(exact, tuple(kinds)):
        return Approximation(exact, dataclasses.replace(part, field=exact), 0.0, 0.0)
    lower, upper = part.field.bounds()
    longest = float((upper - lower).max())
    own = part.field.superfrustum()
    if longest <= 0 or (own is not None and own.thinnest < SAME * longest):
        raise NoSurfaceError(f"part {part.name!r} has no volume, so no solid is near it")
    found = _nearest(part.field.scaled(1 / longest), tuple(kinds))
    if found is None:
        raise NoSurfaceError(f"part {part.name!r} is too thin to be measured, so no solid is near it")
    best, error, deviation = found
    solid = best.field.scaled(longest)
    pose = part.pose
    placed = dataclasses.replace(
        part,
        field=solid,
        translation=tuple(pose(longest * best.centre).tolist()),
        rotation=quaternion_product(part.rotation, best.rotation),
    )
    return Approximation(solid, placed, error, longest * deviation)


def compared(part: Part, field: Field) -> Approximation:
    """Another field in the part's stead, in the same place."""
    lower, upper = part.field.bounds()
    longest = float((upper - lower).max())
    lattice = _Lattice.of(part.field.scaled(1 / longest))
    placed = _Placed(field.scaled(1 / longest), NO_ROTATION, np.zeros(3))
    error, deviation = lattice.compare(placed)
    return Approximation(field, dataclasses.replace(part, field=field), error, longest * deviation)


@dataclass(frozen=True)
class _Placed:
    """A solid in the part's frame: `centre` (3,) is where its origin lies."""

    field: Field
    rotation: tuple[float, float, float, float]
    centre: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        turned = (points - self.centre) @ rotation_matrix(self.rotation)
        return self.field(turned.astype(np.float32)).astype(np.float64)

    def numbers(self) -> np.ndarray:
        """Logarithms of its lengths, then the centre."""
        return np.concatenate([np.log(_lengths(self.field)), self.centre])

    def moved(self, numbers: np.ndarray) -> _Placed:
        return _Placed(_of_lengths(type(self.field), np.exp(numbers[:-3])), self.rotation, numbers[-3:])


@dataclass(frozen=True)
class _Lattice:
    """The part's distance at points of its box: the box's faces are planes of the lattice."""

    points: np.ndarray
    distance: np.ndarray
    cell: float
    coarse: np.ndarray

    @classmethod
    def of(cls, field: Field) -> _Lattice:
        lower, upper = field.bounds()
        step = np.maximum(upper - lower, 1e-4) / _CELLS
        ticks = np.arange(-_MARGIN, _CELLS + _MARGIN + 1)
        axes = [low + h * ticks for low, h in zip(lower, step, strict=True)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        index = np.arange(len(points)).reshape((len(ticks),) * 3)
        coarse = index[::_STRIDE, ::_STRIDE, ::_STRIDE].ravel()
        distance = field(points.astype(np.float32)).astype(np.float64)
        return cls(points, distance, float(step.min()), coarse)

    @property
    def volume(self) -> float:
        """In cells."""
        return float(self._inside(self.distance).sum())

    def _inside(self, distance: np.ndarray, cell: float = 0.0) -> np.ndarray:
        """How much of each point's cell is inside, as if the surface there were flat."""
        return np.clip(0.5 - distance / (cell or self.cell), 0.0, 1.0)

    def compare(self, solid: _Placed) -> tuple[float, float]:
        """Volume of the symmetric difference over the part's volume, and the largest deviation."""
        other = solid(self.points)
        error = np.abs(self._inside(other) - self._inside(self.distance)).sum() / self.volume
        near = np.minimum(np.abs(self.distance), np.abs(other)) < self.cell / 2
        apart = np.abs(self.distance - other)[near]
        return float(error), float(apart.max(initial=0.0))

    def iou(self, solid: _Placed) -> float:
        """On the coarse lattice."""
        a, b = self._inside(self.distance[self.coarse]), self._inside(solid(self.points[self.coarse]))
        return float(np.minimum(a, b).sum() / max(np.maximum(a, b).sum(), 1e-9))

    def fitted(self, start: _Placed) -> _Placed:
        """By Levenberg-Marquardt on the clipped distances."""
        band = _BAND * _STRIDE * self.cell
        points, target = self.points[self.coarse], np.clip(self.distance[self.coarse], -band, band)

        def residual(solid: _Placed) -> np.ndarray:
            return np.clip(solid(points), -band, band) - target

        def linearise(at: tuple[_Placed, np.ndarray]) -> tuple[float, np.ndarray, np.ndarray]:
            solid, error = at
            nudged = solid.numbers() + _STEP * np.eye(len(solid.numbers()))
            jacobian = np.stack([(residual(solid.moved(row)) - error) / _STEP for row in nudged], axis=1)
            return float(error @ error), jacobian.T @ error, jacobian.T @ jacobian

        def move(at: tuple[_Placed, np.ndarray], step: np.ndarray) -> tuple[_Placed, np.ndarray]:
            solid = at[0].moved(at[0].numbers() + np.clip(step, -_LONGEST_STEP, _LONGEST_STEP))
            return solid, residual(solid)

        found = minimise((start, residual(start)), linearise, lambda at: float(at[1] @ at[1]), move, _DAMPING)
        return found.state[0]


@lru_cache(maxsize=256)  # copies of a part, and segments of a bent one, are often the same
def _nearest(field: Field, kinds: tuple[type[Field], ...]) -> tuple[_Placed, float, float] | None:
    """The solid, its volume error and deviation, for a field whose longest side is 1; None if too thin."""
    lattice = _Lattice.of(field)
    if lattice.volume <= 0:
        return None
    best = _best(lattice, kinds)
    return best, *lattice.compare(best)


def _best(lattice: _Lattice, kinds: Sequence[type[Field]]) -> _Placed:
    starts = sorted(_starts(lattice, kinds), key=lattice.iou, reverse=True)[:_FINALISTS]
    if not starts:
        raise ParameterError(f"no solid of {', '.join(k.kind for k in kinds)} can be fitted to the part")
    fitted = (lattice.fitted(start) for start in starts)
    return max(fitted, key=lambda solid: lattice.iou(solid) - _A_LENGTH * len(_lengths(solid.field)))


def _starts(lattice: _Lattice, kinds: Sequence[type[Field]]) -> Iterator[_Placed]:
    """Solids of the part's own volume, centre and second moments, about each of its axes."""
    inside = lattice._inside(lattice.distance)
    weight = inside / inside.sum()
    centre = weight @ lattice.points
    spread = (lattice.points - centre).T @ ((lattice.points - centre) * weight[:, None])
    steps = np.ptp(lattice.points, axis=0) / (_CELLS + 2 * _MARGIN)
    volume = float(inside.sum() * np.prod(steps))
    frames = [NO_ROTATION]
    if np.abs(spread - np.diag(np.diag(spread))).max() > 1e-3 * np.trace(spread):
        frames.append(_principal(spread))
    for kind, frame, axis in product(kinds, frames, _AXES):
        if axis is not NO_ROTATION and kind in (Box, Ellipsoid, Sphere):
            continue
        rotation = quaternion_product(frame, axis)
        local = np.diag(rotation_matrix(rotation).T @ spread @ rotation_matrix(rotation))
        lengths = _BY_MOMENTS[kind](np.maximum(local, 1e-8), volume)
        if lengths is None:
            continue
        field = _of_lengths(kind, lengths)
        if not isinstance(field, Cone | Frustum | RoundCone):
            yield _Placed(field, rotation, centre)
            continue
        for turn in (rotation, quaternion_product(rotation, _FLIP)):
            up = rotation_matrix(turn)[:, 2]
            lift = lengths[1] / 4 if isinstance(field, Cone) else 0.0
            yield _Placed(field, turn, centre + lift * up)


def _principal(spread: np.ndarray) -> tuple[float, float, float, float]:
    vectors = np.linalg.eigh(spread)[1]
    vectors[:, 2] *= np.sign(np.linalg.det(vectors))
    pose = np.eye(4)
    pose[:3, :3] = vectors
    return Similarity.from_matrix(pose).rotation


def _torus(v: np.ndarray, _: float) -> Sequence[float] | None:
    major = v[0] + v[1] - 3 * v[2]
    return (math.sqrt(major), 2 * math.sqrt(v[2])) if major > 4 * v[2] else None


def _tube(v: np.ndarray, volume: float) -> Sequence[float] | None:
    height = math.sqrt(12 * v[2])
    ring = volume / height / (2 * math.pi)
    radius, hole = v[0] + v[1] + ring, v[0] + v[1] - ring
    return (math.sqrt(radius), math.sqrt(radius) - math.sqrt(hole), height) if hole > 0 else None


def _capsule(v: np.ndarray, _: float) -> Sequence[float]:
    radius = math.sqrt(2 * (v[0] + v[1]))
    return radius, max(1.1 * math.sqrt(12 * v[2]) - 2 * radius, 0.1 * radius)


def _round_cone(v: np.ndarray, volume: float) -> Sequence[float]:
    radius, height = _capsule(v, volume)
    return 1.15 * radius, 0.85 * radius, max(height, 0.4 * radius)


def _disc(v: np.ndarray) -> float:
    return math.sqrt(2 * (v[0] + v[1]))


# kind -> its lengths, in the order of its parameters, from the variances (3,) along its axes and the volume
_BY_MOMENTS: dict[type[Field], Callable[[np.ndarray, float], Sequence[float] | None]] = {
    Box: lambda v, _: np.sqrt(12 * v),
    Ellipsoid: lambda v, _: np.sqrt(5 * v),
    Sphere: lambda _, volume: (math.cbrt(volume * 3 / (4 * math.pi)),),
    Cylinder: lambda v, _: (_disc(v), math.sqrt(12 * v[2])),
    Cone: lambda v, _: (math.sqrt(10 / 3 * (v[0] + v[1])), math.sqrt(80 / 3 * v[2])),
    Frustum: lambda v, _: (1.15 * _disc(v), 0.85 * _disc(v), math.sqrt(12 * v[2])),
    Capsule: _capsule,
    RoundCone: _round_cone,
    Tube: _tube,
    Torus: _torus,
}


def _lengths(field: Field) -> np.ndarray:
    return np.hstack([getattr(field, entry.name) for entry in dataclasses.fields(field)])  # type: ignore[arg-type]


def _of_lengths(kind: type[Field], lengths: Sequence[float] | np.ndarray) -> Field:
    """The solid of these lengths, held to what its kind allows."""
    v = [float(x) for x in np.clip(lengths, 1e-4, 10.0)]
    if kind is Box or kind is Ellipsoid:
        return kind((v[0], v[1], v[2]))
    if kind is Frustum:
        v[1] = min(v[1], 2 * v[0])
    if kind is RoundCone:
        v[2] = max(v[2], 1.01 * abs(v[0] - v[1]))
    if kind in (Tube, Torus):
        v[1] = min(v[1], 0.999 * v[0])
    return kind(*v)
