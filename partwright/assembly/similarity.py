"""Similarities: turn, scale uniformly, move. How parts are posed and assemblies are moved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.checks import Quaternion, Vector, number, unit_quaternion, vector
from partwright.errors import ParameterError
from partwright.rows import lengths, sums

_N = TypeVar("_N", float, NDArray[np.float64])

ORIGIN: Vector = (0.0, 0.0, 0.0)
NO_ROTATION: Quaternion = (1.0, 0.0, 0.0, 0.0)


def quaternion_product(a: tuple[_N, _N, _N, _N], b: tuple[_N, _N, _N, _N]) -> tuple[_N, _N, _N, _N]:
    """The rotation `b` followed by `a`; components may be arrays, of many rotations."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def rotation_matrix(quaternion: Quaternion) -> np.ndarray:
    """(3, 3) float64 matrix of a unit quaternion."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@dataclass(frozen=True)
class Similarity:
    """The map p -> scale * rotation(p) + translation.

    Raises:
        ParameterError: scale is not positive, or a number is not finite.
    """

    scale: float = 1.0
    rotation: Quaternion = NO_ROTATION
    translation: Vector = ORIGIN

    def __post_init__(self) -> None:
        scale = number(self.scale, "scale")
        if scale <= 0:
            raise ParameterError(f"scale: expected a positive number, got {scale:g}")
        object.__setattr__(self, "scale", scale)
        object.__setattr__(self, "rotation", unit_quaternion(self.rotation, "rotation"))
        object.__setattr__(self, "translation", vector(self.translation, "translation"))

    @classmethod
    def turn(cls, axis: Sequence[float], angle: float, about: Sequence[float] = ORIGIN) -> Similarity:
        """By an angle in radians, about an axis (3,), a unit vector, through a point (3,)."""
        c, s = math.cos(angle / 2), math.sin(angle / 2)
        x, y, z = (s * component for component in axis)
        rotation = (c, x, y, z)
        dx, dy, dz = (np.asarray(about, float) - cls(rotation=rotation)(np.asarray(about, float))).tolist()
        return cls(rotation=rotation, translation=(dx, dy, dz))

    @classmethod
    def from_matrix(cls, matrix: np.ndarray) -> Similarity:
        """From a (4, 4) homogeneous matrix.

        Raises:
            ParameterError: the matrix shears, mirrors or scales unevenly.
        """
        matrix = np.asarray(matrix, dtype=np.float64)
        if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
            raise ParameterError(f"expected a finite (4, 4) matrix, got shape {matrix.shape}")
        linear = matrix[:3, :3]
        scale = float(np.cbrt(np.linalg.det(linear)))
        if scale <= 0 or not np.allclose(linear @ linear.T, scale**2 * np.eye(3), atol=1e-6 * scale**2):
            raise ParameterError("the matrix shears, mirrors or scales unevenly; expected a similarity")
        return cls(scale, _quaternion(linear / scale), tuple(matrix[:3, 3]))

    @classmethod
    def from_linear(cls, linear: np.ndarray, shift: np.ndarray) -> Similarity:
        """The map p -> linear @ p + shift, of (3, 3) and (3,).

        Raises:
            ParameterError: as of `from_matrix`.
        """
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = linear, shift
        return cls.from_matrix(matrix)

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Map points (N, 3) or one point (3,), in float64."""
        result = np.asarray(points, dtype=np.float64)
        if self.rotation != NO_ROTATION:
            result = result @ rotation_matrix(self.rotation).T
        return self.scale * result + np.array(self.translation)

    def turned(self, vectors: np.ndarray) -> np.ndarray:
        """Directions (N, 3), turned, their lengths as they are."""
        return np.asarray(vectors, dtype=np.float64) @ rotation_matrix(self.rotation).T

    def __matmul__(self, first: Similarity) -> Similarity:
        """`first`, then this one."""
        return Similarity(
            self.scale * first.scale,
            quaternion_product(self.rotation, first.rotation),
            tuple(self(np.array(first.translation))),
        )

    def inverse(self) -> Similarity:
        w, x, y, z = self.rotation
        back = Similarity(1.0 / self.scale, (w, -x, -y, -z))
        return Similarity(back.scale, back.rotation, tuple(-back(np.array(self.translation))))

    def conjugate(self, move: Similarity) -> Similarity:
        """What a rigid `move` becomes when everything it moves is taken through this map."""
        taken = self @ move @ self.inverse()
        return Similarity(1.0, taken.rotation, taken.translation)

    def matrix(self) -> np.ndarray:
        """(4, 4) float64 homogeneous matrix."""
        result = np.eye(4)
        result[:3, :3] = self.scale * rotation_matrix(self.rotation)
        result[:3, 3] = self.translation
        return result


def rigid_moves(value: Sequence[Similarity], name: str) -> tuple[Similarity, ...]:
    """`value` as similarities of scale 1, but for rounding.

    Raises:
        ParameterError: one of them scales, or is something else.
    """
    moves = tuple(value)
    for i, move in enumerate(moves):
        if not isinstance(move, Similarity) or abs(move.scale - 1.0) > 1e-9:
            raise ParameterError(f"{name}[{i}]: expected a Similarity of scale 1, got {move!r:.80}")
    return tuple(move if move.scale == 1.0 else replace(move, scale=1.0) for move in moves)


def quaternions(rotations: np.ndarray) -> np.ndarray:
    """Unit quaternions (..., 4) of rotations (..., 3, 3), by way of the largest component (Shepperd 1978)."""
    diagonal = np.diagonal(rotations, axis1=-2, axis2=-1)
    trace = sums(diagonal)[..., None]
    turned = np.swapaxes(rotations, -1, -2)
    symmetric = rotations + turned
    twist = (turned - rotations)[..., (1, 2, 0), (2, 0, 1)]
    ways = np.empty((*rotations.shape[:-2], 4, 4))
    ways[..., 0, 0] = 1.0 + trace[..., 0]
    ways[..., 0, 1:] = ways[..., 1:, 0] = twist
    ways[..., 1:, 1:] = symmetric
    places = np.arange(1, 4)
    ways[..., places, places] = 1.0 + 2.0 * diagonal - trace
    largest = np.concatenate([trace, diagonal], axis=-1).argmax(axis=-1)
    found = np.take_along_axis(ways, largest[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(found / lengths(found)[..., None])


def _quaternion(rotation: np.ndarray) -> Quaternion:
    w, x, y, z = quaternions(rotation).tolist()
    return w, x, y, z
