"""Round holes of a mesh, by their own facets: a ring of narrow faces around an axis that all look at it, and
the cones in which it ends, as countersinks and chamfers do.

They are found however little of the volume they hold, which no sample need tell.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.chains import circle_through
from partwright.approximation.sketches.directions import frame_along, snapped
from partwright.approximation.sketches.hole_mouths import Mouth, MouthSearch, closes
from partwright.assembly import Part
from partwright.assembly.similarity import quaternions
from partwright.fields import Cylinder
from partwright.rows import units
from partwright.shapes.topology import EdgeTable, area_vectors, components

Floats = NDArray[np.float64]

_FLAT = math.cos(math.radians(0.5))  # between normals of one flat face
_TURN = math.cos(math.radians(41))  # between those of chords of a circle: of an octagon they turn by more
_FEWEST = 9  # chords that close around, which turn by as much
_PARALLEL = math.cos(math.radians(3))  # edges of one wall may lean so much: chords need not be quads
_UPRIGHT = 0.01  # cosine between a wall and its axis
_AXES = 8  # of one smooth region, that are looked along
_ROUND = 0.02  # of the radius, by which corners of a wall may be off its circle
_LEAST = 4e-3  # unit lengths: radius and depth of a hole


@dataclass(frozen=True)
class RoundHole:
    """What a ring of facets goes around. start, end: (3,) on its axis, unit lengths like the radius.
    mouths: the cones that go on from there."""

    radius: float
    start: Floats
    end: Floats
    mouths: tuple[Mouth | None, Mouth | None] = (None, None)

    @property
    def middle(self) -> Floats:
        return (self.start + self.end) / 2

    def part(self) -> Part:
        """The cylinder that is cut for it."""
        along = self.end - self.start
        height = float(np.linalg.norm(along))
        x, y, z = self.middle.tolist()
        w, i, j, k = quaternions(frame_along(along / height)).tolist()
        return Part(Cylinder(self.radius, height), (x, y, z), (w, i, j, k))


def round_holes(vertices: Floats, faces: NDArray[np.int64]) -> list[RoundHole]:
    """Those of a closed mesh, vertices (V, 3) in the unit frame, the widest first; whether anything stands in
    them is not asked."""
    normals = units(area_vectors(vertices[faces]))
    edges, beside = EdgeTable(faces).pairs
    ways = vertices[edges[:, 1]] - vertices[edges[:, 0]]
    along, length = units(ways), np.linalg.norm(ways, axis=1)
    one, two = normals[beside[:, 0]], normals[beside[:, 1]]
    cosine = (one * two).sum(axis=1)
    inner = (np.cross(one, two) * along).sum(axis=1) < 0
    flat = cosine > _FLAT
    turns = inner & (cosine > _TURN) & ~flat
    smooth = turns | flat
    region = components(len(faces), *beside[smooth].T)
    search = MouthSearch(vertices, faces, normals, edges, beside)
    found: list[RoundHole] = []
    order = np.flatnonzero(smooth)
    order = order[np.argsort(region[beside[order, 0]], kind="stable")]
    starts = np.flatnonzero(np.diff(region[beside[order, 0]])) + 1
    for own in np.split(order, starts):
        rulings = own[turns[own]]
        if len(rulings) < _FEWEST:
            continue
        for axis in _axes(along[rulings], length[rulings]):
            upright = (np.abs(normals[beside[own]] @ axis) < _UPRIGHT).all(axis=1)
            ring = own[upright & (flat[own] | (np.abs(along[own] @ axis) > _PARALLEL))]
            found += _rings(search, beside[ring], axis)
    return sorted(found, key=lambda hole: -hole.radius)


def _axes(along: Floats, length: Floats) -> Iterator[Floats]:
    """Unit vectors (3,) that as many edges (E, 3) run along as a hole has, those of the most length first."""
    left = np.arange(len(along))
    for _ in range(_AXES):
        if not len(left):
            return
        first = along[left[length[left].argmax()]]
        near = np.abs(along[left] @ first) > _PARALLEL
        own = along[left[near]] * np.sign(along[left[near]] @ first)[:, None]
        if len(own) >= _FEWEST:
            mean = (own * length[left[near], None]).sum(axis=0)
            yield snapped(mean / np.linalg.norm(mean))
        left = left[~near]


def _rings(search: MouthSearch, beside: NDArray[np.int64], axis: Floats) -> Iterator[RoundHole]:
    """Those of connected walls, pairs (P, 2) of which hang together, that close around an axis."""
    vertices, faces = search.vertices, search.faces
    own, pairs = np.unique(beside, return_inverse=True)
    label = components(len(own), *pairs.reshape(-1, 2).T)
    frame = frame_along(axis)
    for k in range(int(label.max(initial=-1)) + 1):
        walls = own[label == k]
        points = vertices[np.unique(faces[walls])] @ frame
        centre, radius, off = circle_through(points[:, :2])
        low, high = float(points[:, 2].min()), float(points[:, 2].max())
        if min(radius, high - low) < _LEAST or not off <= _ROUND * radius < math.inf:
            continue
        if closes((vertices[faces[walls]] @ frame)[..., :2] - centre):
            start, end = (frame @ (*centre, height) for height in (low, high))
            mouths = search.mouth(walls, start, -axis, radius), search.mouth(walls, end, axis, radius)
            yield RoundHole(float(radius), start, end, mouths)
