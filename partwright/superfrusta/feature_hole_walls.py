"""Round cuts that are not as wide as the shape's walls around them: a section across a countersink has a
radius of its own, and one above a step that of the wider wall alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.round_holes import RoundHole
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder
from partwright.superfrusta.feature_mouths import ASIDE, PARALLEL, WALL, around

Floats = NDArray[np.float64]
Distance = Callable[[NDArray[np.float32]], NDArray[np.float32]]

_LEVELS = 48  # along a cut, at which it is asked whether there is a wall around it
_BEYOND = 0.05, 0.5  # of its radius: how far outside of a cut that is asked
_SEEN = 0.1  # of a cut's length, that a wall which tells against it has at least


@dataclass(frozen=True)
class _Wall:
    """Of a hole of the shape along a cut's axis: from which height to which; reach: with the cones at its
    ends."""

    hole: RoundHole
    low: float
    high: float
    reach: tuple[float, float]

    def along(self, copy: Part) -> Part:
        """What is cut for it on the axis of a copy, so that what is parallel stays so."""
        axis = rotation_matrix(copy.rotation)[:, 2]
        x, y, z = (copy.translation + (self.low + self.high) / 2 * axis).tolist()
        return Part(Cylinder(self.hole.radius, self.high - self.low), (x, y, z), copy.rotation)


@dataclass(frozen=True)
class HoleWalls:
    """holes: of a shape, with nothing of it in them; distance: (N,) of it at points (N, 3); unit lengths."""

    holes: Sequence[RoundHole]
    distance: Distance

    def of(self, cut: Part) -> list[Part] | None:
        """The shape's own holes in place of a round cut, if another radius than the cut's is theirs wherever
        there is a wall around a copy; None where the cut is right, or some wall is no hole's."""
        if not isinstance(cut.field, Cylinder):
            return None
        found = [self._along(copy) for copy in cut.copies]
        if not any(_is_wrong(copy, walls) for copy, walls in zip(cut.copies, found, strict=True)):
            return None
        if not all(self._is_all(copy, walls) for copy, walls in zip(cut.copies, found, strict=True)):
            return None
        return [wall.along(copy) for copy, walls in zip(cut.copies, found, strict=True) for wall in walls]

    def _along(self, copy: Part) -> list[_Wall]:
        """The holes whose walls go around the same axis as a copy, where that is."""
        assert isinstance(copy.field, Cylinder)
        axis, half = rotation_matrix(copy.rotation)[:, 2], copy.field.height / 2
        found = []
        for hole in self.holes:
            ends = np.stack([hole.start, hole.end]) - copy.translation
            heights = ends @ axis
            aside = np.linalg.norm(ends - heights[:, None] * axis, axis=1)
            way = np.diff(heights)[0] / np.linalg.norm(hole.end - hole.start)
            if abs(way) < 1 - PARALLEL or aside.max() > ASIDE:
                continue
            depths = [0.0 if mouth is None else mouth.depth for mouth in hole.mouths]
            if way < 0:
                heights, depths = heights[::-1], depths[::-1]
            low, high = heights.tolist()
            if low < half and high > -half:
                found.append(_Wall(hole, low, high, (low - depths[0], high + depths[1])))
        return found

    def _is_all(self, copy: Part, walls: Sequence[_Wall]) -> bool:
        """Whether there is no wall around a copy but those, and the cones in which they end."""
        assert isinstance(copy.field, Cylinder)
        radius, half = copy.field.radius, copy.field.height / 2
        levels = (np.arange(_LEVELS) + 0.5) / _LEVELS * 2 * half - half
        rings = [((1 + share) * radius, float(level)) for level in levels for share in _BEYOND]
        points = around(copy, 1.0, rings)
        has_wall = (self.distance(points) < 0).reshape(_LEVELS, -1).any(axis=1)
        near = half / _LEVELS  # where one wall ends another begins
        told = np.zeros(_LEVELS, bool)
        for wall in walls:
            told |= (levels > wall.reach[0] - near) & (levels < wall.reach[1] + near)
        return bool(told[has_wall].all())


def _is_wrong(copy: Part, walls: Sequence[_Wall]) -> bool:
    """Whether a wall that is narrower than a copy goes along it, or none is as wide."""
    assert isinstance(copy.field, Cylinder)
    radius, height = copy.field.radius, copy.field.height
    shares = [(min(wall.high, height / 2) - max(wall.low, -height / 2)) / height for wall in walls]
    seen = [wall.hole.radius for wall, share in zip(walls, shares, strict=True) if share > _SEEN]
    narrower = any(own < (1 - WALL) * radius for own in seen)
    return bool(seen) and (narrower or all(own > (1 + WALL) * radius for own in seen))
