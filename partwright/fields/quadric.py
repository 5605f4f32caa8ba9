"""The quadric: one polynomial of second degree for planes, spheres, cylinders, cones and their relatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from reprlib import repr as brief
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.base import LARGEST, Array, Field, checked, normalise
from partwright.fields.operations import is_tensor, library

# The largest coefficient: its square still fits a float64 with room for sums.
_LARGEST = 1e100
_NAMES = ("xx", "yy", "zz", "x", "y", "z", "1", "xy", "yz", "zx")
_TINY = 1e-36  # keeps roots away from 0, where they have no slope
_FLAT = 1e-12  # of the largest: curvatures and slopes that are smaller are rounding


class Terms(NamedTuple):
    """f = p^T square p + linear p + constant, and the curvatures by which f can fall, and rise."""

    square: np.ndarray
    linear: np.ndarray
    constant: float
    fall: float
    rise: float


@dataclass(frozen=True)
class Quadric(Field):
    """The solid f <= 0 of CAPRI-Net's primitive (eq. 1), with the cross terms that the paper leaves out:

    f = a x^2 + b y^2 + c z^2 + d x + e y + f z + g + h xy + i yz + j zx.

    coefficients: a to g (7,), or a to j (10,); kept as ten. Only their ratios and their common sign matter.
    Most quadrics are unbounded (a plane's is a half-space); an intersection of several makes a solid.

    Its distance is exact for planes, spheres and round cylinders. For the others it never exceeds the true
    distance and equals it to first order at the surface; it is finite everywhere.
    """

    kind: ClassVar[str] = "quadric"
    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        given = self.coefficients
        if not isinstance(given, tuple | list | np.ndarray) or len(given) not in (7, 10):
            raise ParameterError(
                f"quadric: coefficients are {brief(given)}; expected 7 or 10 numbers: {', '.join(_NAMES)}"
            )
        values = [
            checked(f"quadric: coefficient of {name}", value, -_LARGEST, _LARGEST)
            for name, value in zip(_NAMES, given, strict=False)
        ]
        values += [0.0] * (10 - len(values))
        if not any(values[:6] + values[7:]):
            raise ParameterError("quadric: all coefficients but the constant are 0, so it has no surface")
        normalise(self, coefficients=tuple(values))

    @classmethod
    def from_matrices(cls, square: np.ndarray, linear: np.ndarray, constant: float) -> Quadric:
        """p^T square p + linear p + constant <= 0; square (3, 3) symmetric, linear (3,)."""
        s = np.asarray(square, dtype=np.float64)
        cross = (2 * s[0, 1], 2 * s[1, 2], 2 * s[2, 0])
        return cls(tuple(float(v) for v in (*np.diag(s), *linear, constant, *cross)))

    @classmethod
    def plane(cls, normal: Sequence[float], offset: float) -> Quadric:
        """The half-space normal . p <= offset |normal|."""
        n = _direction(normal)
        return cls.from_matrices(np.zeros((3, 3)), n, -offset)

    @classmethod
    def sphere(cls, radius: float, centre: Sequence[float] = (0.0, 0.0, 0.0)) -> Quadric:
        return cls.ellipsoid((radius,) * 3, centre)

    @classmethod
    def ellipsoid(cls, radii: Sequence[float], centre: Sequence[float] = (0.0, 0.0, 0.0)) -> Quadric:
        """Semi-axes along x, y, z, all positive; an infinite one makes an elliptic cylinder."""
        if len(radii) != 3 or not all(radius > 0 for radius in radii):
            raise ParameterError(f"quadric: radii are {brief(radii)}; expected three positive lengths")
        # In units of the smallest radius, so that a cylinder of radius r has coefficients of order 1.
        r = np.asarray(radii, dtype=np.float64) / min(radii)
        return cls.from_matrices(np.diag(r**-2.0), np.zeros(3), -(float(min(radii)) ** 2)).moved(
            np.eye(3), np.asarray(centre, dtype=np.float64)
        )

    @classmethod
    def cylinder(
        cls, radius: float, axis: Sequence[float] = (0.0, 0.0, 1.0), point: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Quadric:
        """Round and without end, about the line through `point` along `axis`."""
        if not radius > 0:
            raise ParameterError(f"quadric: radius is {brief(radius)}; expected a positive length")
        along = np.outer(_direction(axis), _direction(axis))
        own = cls.from_matrices(np.eye(3) - along, np.zeros(3), -(float(radius) ** 2))
        return own.moved(np.eye(3), np.asarray(point, dtype=np.float64))

    @classmethod
    def cone(
        cls, slope: float, axis: Sequence[float] = (0.0, 0.0, 1.0), apex: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> Quadric:
        """Both nappes, without end: at a height h from the apex the radius is slope |h|."""
        if not slope > 0:
            raise ParameterError(f"quadric: slope is {brief(slope)}; expected a positive number")
        along = np.outer(_direction(axis), _direction(axis))
        own = cls.from_matrices(np.eye(3) - (1 + float(slope) ** 2) * along, np.zeros(3), 0.0)
        return own.moved(np.eye(3), np.asarray(apex, dtype=np.float64))

    def matrices(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Symmetric (3, 3), linear (3,) and constant part of f = p^T A p + b p + g."""
        a, b, c, d, e, f, g, xy, yz, zx = self.coefficients
        square = np.array([[a, xy / 2, zx / 2], [xy / 2, b, yz / 2], [zx / 2, yz / 2, c]])
        return square, np.array([d, e, f]), g

    @property
    def is_plane(self) -> bool:
        """Whether it is a half-space."""
        return not any(self.coefficients[:3] + self.coefficients[7:])

    def polynomial(self, points: np.ndarray) -> np.ndarray:
        """f itself (N,), float64, at points (N, 3)."""
        square, linear, constant = self.matrices()
        p = np.asarray(points, dtype=np.float64)
        return np.asarray(((p @ square) * p).sum(axis=1) + p @ linear + constant)

    def gradient(self, points: np.ndarray) -> np.ndarray:
        """Gradient (N, 3) of f, float64, at points (N, 3); it points outwards at the surface."""
        square, linear, _ = self.matrices()
        return np.asarray(2 * np.asarray(points, dtype=np.float64) @ square + linear)

    def __call__(self, points: Array) -> Array:
        """Signed lower bound of the distance at points (N, 3).

        Over a step of length t, |f| shrinks by at most |grad f| t + k t^2, where k is the largest curvature
        that works towards the surface; the distance is the t at which nothing is left (Taubin 1994, section
        6, with the curvature's sign).
        """
        if is_tensor(points):
            return cast(Array, self._bound(points))
        return cast(Array, self._bound(np.asarray(points, dtype=np.float64)).astype(np.float32))

    def _bound(self, points: Any) -> Any:
        xp, (square, linear, constant, fall, rise) = library(points), self.scaled_terms
        if is_tensor(points):
            square, linear = points.new_tensor(square), points.new_tensor(linear)
        half = points @ square
        value = (half * points).sum(-1) + points @ linear + constant
        steep = xp.sqrt(((2 * half + linear) ** 2).sum(-1) + _TINY)
        inside, size = value < 0, abs(value)
        bend = xp.where(inside, rise * size, fall * size)
        reach = 2 * size / (steep + xp.sqrt(xp.clip(steep * steep + 4 * bend, _TINY, None)))
        return xp.where(inside, -reach, reach)

    @cached_property
    def scaled_terms(self) -> Terms:
        """What the distance is made of: the coefficients over the largest of A and b."""
        square, linear, constant = self.matrices()
        size = max(np.abs(square).max(), np.abs(linear).max())
        square, linear, constant = square / size, linear / size, constant / size
        curvature, axes = np.linalg.eigh(square)
        slope = np.abs(axes.T @ linear)
        idle = (np.abs(curvature) <= _FLAT * np.abs(curvature).max()) & (slope <= _FLAT * slope.max())
        used = curvature[~idle] if not idle.all() else curvature
        return Terms(square, linear, float(constant), float(-used.min()), float(used.max()))

    def quadric(self) -> Quadric:
        return self

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        """As `Field.support`; not known above level 0, where the level sets are no quadrics."""
        directions = np.asarray(directions, dtype=np.float64)
        if level:
            return np.full(len(directions), np.inf)
        square, linear, constant = self.scaled_terms[:3]
        curvature, axes = np.linalg.eigh(square)
        slope, along = axes.T @ linear, directions @ axes
        threshold = _FLAT * np.abs(curvature).max()
        if curvature.min() < -threshold:
            return np.full(len(directions), np.inf)
        round_, flat = curvature > threshold, curvature <= threshold
        k, s = curvature[round_], slope[round_]
        level = float((s * s / (4 * k)).sum() - constant)
        middle = along[:, round_] @ (-s / (2 * k))
        spread = (along[:, round_] ** 2 / k).sum(axis=1)
        fall = np.where(flat, slope, 0.0)
        steep = float(np.linalg.norm(fall))
        if steep <= _FLAT * max(np.abs(slope).max(), threshold):
            if level < 0:
                return np.full(len(directions), -np.inf)
            free = np.abs(along[:, flat]).max(axis=1, initial=0.0) > 1e-9
            return np.where(free, np.inf, middle + np.sqrt(level * spread))
        towards = along @ (fall / steep)
        aside = np.linalg.norm(np.where(flat, along, 0.0) - np.outer(towards, fall / steep), axis=1)
        ends = (aside <= 1e-9) & (towards > 1e-9)
        safe = np.where(ends, towards, 1.0)
        return np.where(ends, middle + safe * level / steep + steep * spread / (4 * safe), np.inf)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Infinite along the axes where the solid does not end; both corners 0 where nothing is inside."""
        reach = self.support(np.vstack([-np.eye(3), np.eye(3)]))
        if np.isneginf(reach).any():
            return np.zeros(3), np.zeros(3)
        return -reach[:3], reach[3:]

    def scaled(self, factor: float) -> Quadric:
        factor = checked("quadric: scale factor", factor, 0.0, LARGEST, above=True)
        square, linear, constant = self.matrices()
        return Quadric.from_matrices(square / factor, linear, constant * factor)

    def moved(self, rotation: np.ndarray, translation: np.ndarray) -> Quadric:
        """Turned by a (3, 3) rotation, then moved by (3,): a quadric stays one."""
        square, linear, constant = self.matrices()
        square, linear = rotation @ square @ rotation.T, rotation @ linear
        back = square @ translation
        return Quadric.from_matrices(
            square, linear - 2 * back, float(translation @ back - linear @ translation + constant)
        )

    def complement(self) -> Quadric:
        """What is outside: f >= 0."""
        return Quadric(tuple(-value for value in self.coefficients))


def _direction(given: Sequence[float]) -> np.ndarray:
    vector = np.asarray(given, dtype=np.float64)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
    if not 0 < length < np.inf:
        raise ParameterError(f"quadric: {brief(given)} is no direction; expected three numbers, not all 0")
    return vector / length
