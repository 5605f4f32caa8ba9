"""Which fillets and chamfers of a shape were left off: its features have sharp edges there.

They hardly show in any score, and a drawing without them is another one. Where a shape leans on the walls of
what it was fitted by, along a narrow strip, the result has an edge with more, or an inner one with less.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from partwright.metrics.deviation import place_in
from partwright.rows import units
from partwright.shapes import Shape, length_text
from partwright.shapes.topology import EdgeTable, area_vectors, components
from partwright.superfrusta.far_places import Solid
from partwright.superfrusta.feature_mouths import LeftOut
from partwright.superfrusta.left_out import Detail

_LEAST, _MOST = 3e-3, 0.1  # unit lengths, that a strip is off in its middle
_OWN = 1e-3  # unit lengths, that what belongs to one is off at least
_GOOD = 0.95  # of the rest of the surface, that is off by less: else strips are effects of other faults
_LEANS = np.cos(np.radians([80.0, 10.0]))  # between a strip and the wall that is nearest
_LONG = 6.0  # times as long as it is off
_CHAMFER, _FILLET = 0.5, 1 - math.sqrt(0.5)  # of their size, that they are off in the middle
_OPEN, _CLOSED = 0.2, 0.85  # of what the middle is off, and of a strip's outline, which has to be nearer
_ON = 0.2  # of what the middle is off, that a chamfer's outline may be
_MIDDLE, _BEYOND = 0.7, 2.5  # of what the middle is off: what counts as that, and how near an edge is to it
_SHARP, _SPACING = 0.77, 2e-3  # cosine between faces at a sharp edge, and unit lengths between its points
_AT_45 = np.cos(np.radians([53.0, 37.0]))  # between a chamfer and both walls
_ALIKE = 1.15  # times another's size
_TOLD = 4  # sizes at most
_MANY = 60_000  # triangles, from which on only their middles are looked at


@dataclass(frozen=True)
class _Strip:
    """name: of what was there. size: unit lengths. middle: (3,). length: about so long."""

    name: str
    size: float
    middle: NDArray[np.float64]
    length: float

    def is_like(self, other: _Strip) -> bool:
        return self.name == other.name and 1 / _ALIKE < self.size / other.size < _ALIKE


def sharp_edge_warnings(
    shape: Shape, fitted: Solid, details: Sequence[Detail | LeftOut] = ()
) -> tuple[str, ...]:
    """A sentence for each size of what was left off, the longest first. fitted: what the shape was fitted by,
    in its unit frame. details: that are told by themselves, with their walls, which may lean."""
    strips = [one for one in _strips(shape, fitted) if not any(d.is_beside(one.middle) for d in details)]
    found: list[list[_Strip]] = []
    for strip in sorted(strips, key=lambda strip: -strip.length):
        alike = next((group for group in found if strip.is_like(group[0])), None)
        if alike is None:
            found.append([strip])
        else:
            alike.append(strip)
    return tuple(_sentence(shape, alike) for alike in found[:_TOLD])


def _sentence(shape: Shape, strips: list[_Strip]) -> str:
    size = float(shape.frame.length_from_unit(max(strips, key=lambda strip: strip.length).size))
    places = list(dict.fromkeys(place_in(shape, strip.middle) for strip in strips))
    more = f" and {len(strips) - 1} more places" if len(strips) > 2 else " and one more place"
    return (
        f"left sharp: {strips[0].name} of about {length_text(size, shape.unit, 2)} at the "
        f"{places[0]}{more if len(strips) > 1 else ''}: no feature has it"
    )


def _strips(shape: Shape, fitted: Solid) -> list[_Strip]:
    seen = _Seen.of(shape, fitted)
    if seen.good < _GOOD:
        return []
    return [strip for index in seen.long_and_narrow() if (strip := seen.strip(index)) is not None]


@dataclass(frozen=True)
class _Seen:
    """Triangles of a shape beside the surface that was fitted to it.

    middle (F, 3), area (F,); deep (F, P): how far points of each that lean on the nearest wall are off it,
    positive outside, else 0; cosine (F,) between both at the farthest; beyond (F, P): how far its points are
    from the nearest sharp edge. good: the share of the rest's area that is hardly off. label (F,): which lean
    the same way side by side; around: their outlines.
    """

    middle: NDArray[np.float64]
    area: NDArray[np.float64]
    deep: NDArray[np.floating]
    cosine: NDArray[np.float64]
    beyond: NDArray[np.float64]
    good: float
    label: NDArray[np.int64]
    around: _Around

    @classmethod
    def of(cls, shape: Shape, fitted: Solid) -> _Seen:
        vertices, faces = shape.unit_mesh
        corners = vertices[faces]
        middle, normal = corners.mean(axis=1), area_vectors(corners)
        halfway = [(corners[:, k] + corners[:, k - 1]) / 2 for k in range(3)] if len(faces) < _MANY else []
        points = np.stack([middle, *halfway], axis=1)
        signed, nearest = fitted.surface.signed_nearest(points.reshape(-1, 3))
        off, walls = signed.reshape(points.shape[:2]), fitted.walls[nearest]
        cosine = np.einsum("fki,fi->fk", walls.reshape(points.shape), units(normal))
        leans = (cosine > _LEANS[0]) & (cosine < _LEANS[1]) & (np.abs(off) > _OWN)
        deep = np.where(leans, off, 0.0)
        farthest = np.arange(len(faces)), np.abs(deep).argmax(axis=1)
        edges, beside = EdgeTable(faces).pairs
        one, other = deep[farthest][beside].T
        label = components(len(faces), *beside[one * other > 0].T)
        around = _Around.of(vertices, edges, label[beside], np.abs(fitted.surface.signed(vertices)))
        beyond = _from_edges(fitted, points.reshape(-1, 3)).reshape(off.shape)
        area = np.linalg.norm(normal, axis=1) / 2
        rest = np.where((deep == 0).all(axis=1), area, 0.0)
        good = float(rest[np.abs(off[:, 0]) < _LEAST].sum() / max(rest.sum(), 1e-300))
        return cls(middle, area, deep, cosine[farthest], beyond, good, label, around)

    def long_and_narrow(self) -> list[int]:
        """Labels of those that are much longer than they are off."""
        depth, area = np.zeros(int(self.label.max(initial=-1)) + 1), np.bincount(self.label, self.area)
        np.maximum.at(depth, self.label, np.abs(self.deep).max(axis=1))
        long = _length(area, depth) > _LONG * depth
        return np.flatnonzero((depth > _LEAST) & (depth < _MOST) & long).tolist()

    def strip(self, index: int) -> _Strip | None:
        """What was left off there; None where it is another fault: beside no sharp edge, or open at its
        sides."""
        own = np.flatnonzero(self.label == index)
        deep, area = self.deep[own], self.area[own]
        depth = float(np.abs(deep).max())
        at_edge = self.beyond[own][np.abs(deep) > _MIDDLE * depth] < _BEYOND * depth
        if at_edge.mean() < _CLOSED or self.around.share(index, _OPEN * depth) < _CLOSED:
            return None
        at_45 = (self.cosine[own] > _AT_45[0]) & (self.cosine[own] < _AT_45[1])
        is_chamfer = at_45.all() and self.around.share(index, _ON * depth) > _CLOSED
        kind, share = ("chamfer", _CHAMFER) if is_chamfer else ("fillet", _FILLET)
        name = f"{'an inner' if deep.sum() > 0 else 'a'} {kind}"
        place = np.average(self.middle[own], axis=0, weights=area)
        return _Strip(name, depth / share, place, float(_length(area.sum(), depth)))


def _length(area: Any, depth: Any) -> Any:
    """Of a chamfer of such an area, or about that of a fillet."""
    return area / (2 * math.sqrt(2) * np.maximum(depth, 1e-300))


def _from_edges(fitted: Solid, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far (N,) points (N, 3) are from the nearest sharp edge of a surface."""
    vertices, faces = fitted.mesh
    edges, beside = EdgeTable(faces).pairs
    cosine = np.einsum("ni,ni->n", *fitted.walls[beside].transpose(1, 0, 2))
    start, end = vertices[edges[np.abs(cosine) < _SHARP]].transpose(1, 0, 2)
    if not len(start):
        return np.full(len(points), np.inf)
    pieces = np.ceil(np.linalg.norm(end - start, axis=1) / _SPACING).astype(int)
    edge = np.repeat(np.arange(len(pieces)), pieces)
    share = (np.arange(len(edge)) - np.repeat(np.cumsum(pieces) - pieces, pieces) + 0.5) / pieces[edge]
    found = start[edge] + share[:, None] * (end - start)[edge]
    return np.asarray(cKDTree(found).query(points, distance_upper_bound=_BEYOND * _MOST)[0])


@dataclass(frozen=True)
class _Around:
    """Edges around sets of triangles: that set, how far the edge is off, and its length (E,)."""

    label: NDArray[np.int64]
    off: NDArray[np.float64]
    length: NDArray[np.float64]

    @classmethod
    def of(
        cls,
        vertices: NDArray[np.float64],
        edges: NDArray[np.int64],
        sets: NDArray[np.int64],
        at_corners: NDArray[np.floating],
    ) -> _Around:
        """edges (E, 2) of vertices (V, 3) that are so far off (V,), and the sets (E, 2) on both sides."""
        outer = sets[:, 0] != sets[:, 1]
        length = np.linalg.norm(vertices[edges[outer, 0]] - vertices[edges[outer, 1]], axis=1)
        off = at_corners[edges[outer]].max(axis=1)
        return cls(sets[outer].T.ravel(), np.tile(off, 2), np.tile(length, 2))

    def share(self, index: int, near: float) -> float:
        """Of the length around a set, what is not further off."""
        own = self.label == index
        return float(self.length[own & (self.off < near)].sum() / max(self.length[own].sum(), 1e-300))
