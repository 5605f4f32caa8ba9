"""The unit frame: bounding box centred at the origin, longest side 1.8; and the way back."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright.errors import EmptyShapeError, FlatShapeError, NotFiniteError

LONGEST_SIDE = 1.8


@dataclass(frozen=True)
class UnitFrame:
    """unit = (p - centre) * scale. `centre` is in the shape's own units, `scale` in 1/own unit."""

    centre: tuple[float, float, float]
    scale: float

    @classmethod
    def of(cls, points: ArrayLike) -> UnitFrame:
        """Frame of the bounding box of finite points (N, 3).

        Raises EmptyShapeError without points, FlatShapeError when all of them coincide, NotFiniteError.
        """
        array = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        if len(array) == 0:
            raise EmptyShapeError("no points: the unit frame needs at least two that differ")
        lower, upper = array.min(axis=0), array.max(axis=0)
        with np.errstate(over="ignore"):
            longest = float((upper - lower).max())
        if not np.isfinite(longest):
            raise NotFiniteError(
                "coordinates are NaN, infinite, or too large to subtract; scale the shape down"
            )
        if longest < np.finfo(np.float64).tiny:
            raise FlatShapeError("all vertices lie at one point; a shape with volume was expected")
        x, y, z = (0.5 * lower + 0.5 * upper).tolist()
        return cls((x, y, z), LONGEST_SIDE / longest)

    def to_unit(self, points: ArrayLike) -> NDArray[np.float64]:
        """Points (N, 3) in own units -> unit frame."""
        return (np.asarray(points, dtype=np.float64) - self.centre) * self.scale

    def from_unit(self, points: ArrayLike) -> NDArray[np.float64]:
        """Points (N, 3) in the unit frame -> own units."""
        return np.asarray(points, dtype=np.float64) / self.scale + self.centre

    def length_to_unit(self, length: ArrayLike) -> NDArray[np.float64]:
        """Lengths of any shape in own units -> unit frame."""
        return np.asarray(length, dtype=np.float64) * self.scale

    def length_from_unit(self, length: ArrayLike) -> NDArray[np.float64]:
        """Lengths of any shape in the unit frame -> own units."""
        return np.asarray(length, dtype=np.float64) / self.scale
