"""The space between the facets of a tessellated round wall and the arc whose chords they are.

A part that was drawn round is off its own coarse mesh by the height of the arcs over their chords. What
follows the chords instead would explain more of such a mesh and be no part that was drawn, so neither is to
be told by what lies in between. Facets are chords under the conditions of sides of an outline (`outlines`):
they turn by at most 37 degrees from one to the next, alike on both sides; but from four on, as
three sides that turn alike lie on a circle in any case.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.rows import units
from partwright.shapes.topology import EdgeTable, area_vectors, components

_FLAT, _LEAST, _MOST = (math.radians(angle) for angle in (0.1, 1.0, 37.0))
_OPPOSITE, _ACROSS = -0.9, 0.5  # cosines between the ways from two edges into a facet
_ALIKE = 1.6  # times a facet's turn at one edge, that the one at the other may be
_EVEN = 1.4  # times a chord's length, that the last one beside it may have
_MARGIN = 1.1  # of the arc's height: an arc through noisy corners is not all the same


@dataclass(frozen=True)
class ChordSkins:
    """Strips between two edges of facets: one row for each facet, two where a wall is round both ways.

    of_face: (F,) facet of each triangle. start, end (K, 2, 3): a point on either edge of a strip; into, back
    (K, 2, 3): unit ways from it into the facet; turn (K, 2): of the wall at the edges, positive where it is
    convex, 0 where there is no strip."""

    of_face: NDArray[np.int64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    into: NDArray[np.float64]
    back: NDArray[np.float64]
    turn: NDArray[np.float64]

    @classmethod
    def of(cls, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> ChordSkins:
        sides = _Sides.of(vertices, faces)
        count = int(sides.of_face.max(initial=-1)) + 1
        start, end, into, back = np.zeros((4, count, 2, 3))
        made = cls(sides.of_face, start, end, into, back, np.zeros((count, 2)))
        left = np.arange(len(sides.facet))
        for way in (0, 1):
            first, last = sides.opposite(left)
            made._set(way, sides, first, last)
            if way == 0:
                made._leave_out_single(sides)
                made._set_ends(sides, vertices, faces)
            along = np.full((count, 3), np.nan)
            along[sides.facet[first]] = sides.into[first]
            cosine = np.einsum("ni,ni->n", along[sides.facet[left]], sides.into[left])
            left = left[np.abs(cosine) < _ACROSS]
        return made

    @property
    def reach(self) -> float:
        """The farthest that any goes from the surface."""
        width = np.einsum("nki,nki->nk", self.end - self.start, self.into)
        return _MARGIN * float((width * np.abs(self.turn)).sum(axis=1).max(initial=0.0)) / 8

    def hold(
        self, points: NDArray[np.floating], distance: NDArray[np.floating], face: NDArray[np.integer]
    ) -> NDArray[np.bool_]:
        """(N,) whether points (N, 3) at signed distances (N,) from their nearest triangles (N,) lie there."""
        facet = self.of_face[face]
        turn = self.turn[facet]
        one = np.einsum("nki,nki->nk", points[:, None] - self.start[facet], self.into[facet])
        two = np.einsum("nki,nki->nk", points[:, None] - self.end[facet], self.back[facet])
        height = np.maximum(one, 0) * np.maximum(two, 0) / np.maximum(one + two, 1e-12) * turn / 2
        height = height.sum(axis=1)
        return (distance * height > 0) & (np.abs(distance) < _MARGIN * np.abs(height))

    def _set(self, way: int, sides: _Sides, first: NDArray[np.int64], last: NDArray[np.int64]) -> None:
        facet = sides.facet[first]
        self.start[facet, way], self.into[facet, way] = sides.place[first], sides.into[first]
        self.end[facet, way], self.back[facet, way] = sides.place[last], sides.into[last]
        self.turn[facet, way] = (sides.turn[first] + sides.turn[last]) / 2

    def _set_ends(self, sides: _Sides, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> None:
        """Facets that have a strip on one side alone: the last chords of an arc, to their farthest corner."""
        known, beside = self.turn[:, 0] != 0, sides.beside
        width = self._width
        at_end = np.flatnonzero(~known[sides.facet] & (self.turn[beside, 0] * sides.turn > 0))
        facet, chosen = np.unique(sides.facet[at_end], return_index=True)
        row = np.full(len(known), -1)
        row[facet] = at_end[chosen]
        face = np.flatnonzero(row[self.of_face] >= 0)
        own = row[self.of_face[face]]
        off = vertices[faces[face]] - sides.place[own][:, None]
        reach = np.zeros(len(known))
        np.maximum.at(reach, self.of_face[face], np.einsum("nki,ni->nk", off, sides.into[own]).max(axis=1))
        facet = facet[reach[facet] <= _EVEN * width[beside[row[facet]]]]
        one, into = row[facet], sides.into[row[facet]]
        self.start[facet, 0], self.into[facet, 0], self.turn[facet, 0] = (
            sides.place[one],
            into,
            sides.turn[one],
        )
        self.end[facet, 0], self.back[facet, 0] = sides.place[one] + reach[facet, None] * into, -into

    def _leave_out_single(self, sides: _Sides) -> None:
        """Facets that turn alike on both sides, but to none that does so too and is about as wide: of bevels,
        and of three sides that lie on a circle as any such do."""
        width = self._width
        one, two = width[sides.facet], width[sides.beside]
        even = (np.minimum(one, two) > 0) & (np.maximum(one, two) < _EVEN * np.minimum(one, two))
        chained = np.zeros(len(width), bool)
        chained[sides.facet[even]] = True
        self.turn[~chained, 0] = 0.0

    @property
    def _width(self) -> NDArray[np.float64]:
        """(K,) of the first strip of each facet, 0 where there is none."""
        across = np.einsum("ni,ni->n", self.end[:, 0] - self.start[:, 0], self.into[:, 0])
        return np.where(self.turn[:, 0] != 0, across, 0.0)


@dataclass(frozen=True)
class _Sides:
    """Edges at which a wall turns as between chords, once for the facet on either side of each.

    facet, beside: (S,) that facet and the other; place, into (S, 3): a point on the edge, and the unit way
    from it into the facet; turn, length (S,)."""

    of_face: NDArray[np.int64]
    facet: NDArray[np.int64]
    beside: NDArray[np.int64]
    place: NDArray[np.float64]
    into: NDArray[np.float64]
    turn: NDArray[np.float64]
    length: NDArray[np.float64]

    @classmethod
    def of(cls, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> _Sides:
        edge, beside = EdgeTable(faces).pairs
        normal = units(area_vectors(vertices[faces]))
        along = vertices[edge[:, 1]] - vertices[edge[:, 0]]
        length, along = np.linalg.norm(along, axis=1), units(along)
        left, right = (normal[beside[:, k]] for k in (0, 1))
        sine = np.einsum("ni,ni->n", np.cross(left, right), along)
        turn = np.arctan2(sine, np.einsum("ni,ni->n", left, right))
        flat, bent = np.abs(turn) < _FLAT, (np.abs(turn) > _LEAST) & (np.abs(turn) < _MOST)
        of_face = components(len(faces), *beside[flat].T)
        facets = of_face[beside[bent]]
        into = np.concatenate([np.cross(left[bent], along[bent]), np.cross(along[bent], right[bent])])
        place, turn, length = vertices[edge[bent, 0]], turn[bent], length[bent]
        return cls(
            of_face,
            facets.T.ravel(),
            facets[:, ::-1].T.ravel(),
            np.tile(place, (2, 1)),
            into,
            np.tile(turn, 2),
            np.tile(length, 2),
        )

    def opposite(self, chosen: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Of the chosen ones the longest of each facet, and the one across it that turns alike; for facets
        that have such."""
        order = chosen[np.lexsort([-self.length[chosen], self.facet[chosen]])]
        begin = np.unique(self.facet[order], return_index=True)[1]
        longest = np.repeat(order[begin], np.diff(np.append(begin, len(order))))
        cosine = np.einsum("ni,ni->n", self.into[order], self.into[longest])
        ratio = self.turn[order] / self.turn[longest]
        cosine[(ratio < 1 / _ALIKE) | (ratio > _ALIKE)] = 1.0
        order_across = np.lexsort([cosine, self.facet[order]])
        across = order_across[begin]
        good = cosine[across] < _OPPOSITE
        return order[begin][good], order[across][good]
