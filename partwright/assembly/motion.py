"""Rigid motions that may mirror: how a group and its copies and images lie to one another."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations, product
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from partwright.assembly.mirroring import mirrored
from partwright.assembly.similarity import Similarity, rotation_matrix

if TYPE_CHECKING:
    from partwright.assembly.tree import Assembly, Part

Placed = TypeVar("Placed", "Part", "Assembly")


@dataclass(frozen=True)
class Motion:
    """Mirrored in the plane x = 0, where `mirror` says so, then moved by a rigid move."""

    move: Similarity = Similarity()  # noqa: RUF009 - frozen, as all defaults have to be
    mirror: bool = False

    @property
    def linear(self) -> np.ndarray:
        """(3, 3) what it does to directions."""
        flip = np.array([-1.0, 1.0, 1.0] if self.mirror else [1.0, 1.0, 1.0])
        return rotation_matrix(self.move.rotation) * flip

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Map points (N, 3) or one point (3,), in float64."""
        points = np.asarray(points, dtype=np.float64)
        return self.move(points * [-1.0, 1.0, 1.0] if self.mirror else points)

    def __matmul__(self, first: Motion) -> Motion:
        """`first`, then this one."""
        inner = _seen_in_the_mirror(first.move) if self.mirror else first.move
        return Motion(self.move @ inner, self.mirror != first.mirror)

    def inverse(self) -> Motion:
        back = self.move.inverse()
        return Motion(_seen_in_the_mirror(back) if self.mirror else back, self.mirror)

    def of(self, node: Placed) -> Placed:
        """The part there, with all its copies, or the group; names stay.

        Raises:
            ParameterError: a learned part is among it, which cannot be mirrored.
        """
        from partwright.assembly.tree import Assembly

        if self.mirror:
            (image,) = mirrored(Assembly((node,)), "x", suffix="").children
            node = cast(Placed, image)
        return node.transformed(self.move)


def signed_permutations() -> tuple[np.ndarray, ...]:
    """The 48 (3, 3) that map axes onto axes, either way along them: turns, and mirrors (determinant -1)."""
    made = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        matrix = np.zeros((3, 3))
        matrix[range(3), order] = signs
        made.append(matrix)
    return tuple(made)


def _seen_in_the_mirror(move: Similarity) -> Similarity:
    """M S M of the mirror M in the plane x = 0: turns about x stay as they are, others go the other way."""
    w, a, b, c = move.rotation
    x, y, z = move.translation
    return Similarity(1.0, (w, a, -b, -c), (-x, y, z))
