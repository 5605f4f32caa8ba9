"""Round holes that the parts of a search close, cut in the end, each size once.

What a hole in a thin wall holds is little, and growth hardly feels what closes it. A person sees it first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.ends import BEYOND, STEPS, with_open_ends
from partwright.approximation.sketches.holes import merged_holes
from partwright.assembly import Part
from partwright.assembly.rows import rows
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder
from partwright.fields.columns import Column
from partwright.shapes import Shape
from partwright.superfrusta.families import locked_values
from partwright.superfrusta.feature_drilling import empty_round_holes
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded
from partwright.superfrusta.symmetry import Isometry

Floats = NDArray[np.float64]
Span = tuple[float, float] | Floats
Distance = Callable[[NDArray[np.float32]], NDArray[np.float32]]

_STEP = 2e-3  # unit lengths between sections that are looked at
_WITHIN = 5e-4  # unit lengths within a solid, from which on a point is closed
_RINGS = ((0.0, 1), (0.35, 6), (0.7, 8))  # of the radius, and points of a section there
_CLOSED = 0.5  # of a section's points


def with_round_holes(
    shape: Shape, samples: FitSamples, leaves: list[RepeatedPart], settings: Settings
) -> list[RepeatedPart]:
    """Leaves, and what is subtracted for the round holes of the shape that they close somewhere; as many as a
    part budget has room for, the widest holes first. The same leaves where the family has nothing round.

    A hole is known by its own facets, so nothing is fitted.
    """
    there = expanded(leaves)
    if locked_values(settings.family, settings.smooth).get(Column.ROUNDNESS, 1.0) != 1.0:
        return leaves

    def distance(points: NDArray[np.float32]) -> NDArray[np.float32]:
        return samples.distance_of(there, points)

    bores = [_Bore(hole.part(), samples.measure, distance) for hole in empty_round_holes(shape)]
    closed = [bore.hole for bore in bores if bore.may_be_closed and bore.is_closed]
    holes = merged_holes(closed, samples.measure)
    cuts = [_Bore(hole, samples.measure, distance).cut for hole in holes]
    most = settings.max_parts
    room = len(cuts) if most is None else max(0, most - len(leaves))
    return [*leaves, *map(_subtracted, cuts[:room])] if cuts[:room] else leaves


@dataclass(frozen=True)
class _Bore:
    """A drilled hole, perhaps with copies, in a solid that may close it. measure, distance: of the shape and
    of the solid at points (N, 3), unit lengths."""

    hole: Part
    measure: Distance
    distance: Distance

    @property
    def may_be_closed(self) -> bool:
        """Asks nothing of the shape, which takes longer than the solid."""
        span = -self.half - BEYOND, self.half + BEYOND
        return any(len(self.filled(copy, span, self.distance)) for copy in self.copies)

    @property
    def is_closed(self) -> bool:
        """In one of the sections that are to be cut."""
        return any(len(self.filled(copy, self.span(copy), self.distance)) for copy in self.copies)

    @property
    def cut(self) -> Part:
        """The cylinder to cut, with all copies."""
        low, high = np.array([self.span(copy) for copy in self.copies]).T
        down, up = float(low.max()), float(high.min())
        x, y, z = (self.hole.translation + (down + up) / 2 * self.axis).tolist()
        return replace(self.hole, field=Cylinder(self.radius, up - down), translation=(x, y, z))

    @property
    def copies(self) -> tuple[Part, ...]:
        return self.hole.copies

    @property
    def axis(self) -> Floats:
        return np.asarray(rotation_matrix(self.hole.rotation)[:, 2])

    @property
    def radius(self) -> float:
        return float(self.hole.field.bounds()[1][0])

    @property
    def half(self) -> float:
        return float(self.hole.field.bounds()[1][2])

    @cached_property
    def open_ends(self) -> tuple[bool, bool]:
        """The lower and the upper, in the shape."""
        longer = with_open_ends(self.hole, False, self.measure)
        more = longer.field.bounds()[1][2] - self.half
        shift = (np.array(longer.translation) - self.hole.translation) @ self.axis
        # Where the former does not look: a floor may be thin.
        near = np.array([self.half, self.half + STEPS[0]])
        low, high = (
            more + side * shift > BEYOND / 2
            and not any(len(self.filled(copy, np.sort(side * near), self.measure)) for copy in self.copies)
            for side in (-1.0, 1.0)
        )
        return bool(low), bool(high)

    def span(self, copy: Part) -> tuple[float, float]:
        """From where to where on its axis a copy is to be cut, from its middle.

        Where an end is open it goes on, so that no skin is left of what lies further out than in the shape.
        Where it is not, a floor of the solid stays that lies a little higher: cut to the true depth, a thin
        one would be open.
        """
        below, above = self.open_ends
        low = -self.half - BEYOND if below else -self.half + self.floor(copy, -1.0)
        high = self.half + BEYOND if above else self.half - self.floor(copy, 1.0)
        return low, high

    def floor(self, copy: Part, side: float) -> float:
        """How high over a closed end the solid fills a copy; 0 where that is more than a floor."""
        within = min(BEYOND, self.half)
        near = np.array([self.half - within, self.half])
        filled = side * self.filled(copy, np.sort(side * near), self.distance)
        over = self.half - float(filled.min()) + _STEP if len(filled) else 0.0
        return over if over < within else 0.0

    def filled(self, copy: Part, span: Span, distance: Distance) -> Floats:
        """(K,) where on its axis, from its middle, a copy is closed by what the distance is of."""
        low, high = span
        heights = np.linspace(low, high, int((high - low) / _STEP) + 2)
        section = [
            (share * self.radius * np.cos(angle), share * self.radius * np.sin(angle))
            for share, count in _RINGS
            for angle in np.linspace(0, 2 * np.pi, count, endpoint=False)
        ]
        across = np.tile(section, (len(heights), 1))
        local = np.column_stack([across, heights.repeat(len(section))])
        points = local @ rotation_matrix(copy.rotation).T + copy.translation
        inside = distance(points.astype(np.float32)) < -_WITHIN
        return heights[inside.reshape(len(heights), -1).mean(axis=1) > _CLOSED]


def _subtracted(hole: Part) -> RepeatedPart:
    (row,) = rows(hole.copies[:1])
    copies = (Isometry(rotation_matrix(move.rotation), np.array(move.translation)) for move in hole.instances)
    return RepeatedPart(np.append(row, -1.0).astype(np.float32), tuple(copies))
