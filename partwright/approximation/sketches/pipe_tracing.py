"""Middles of round rods and tubes that bend, traced from section to section of a closed surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.chains import circle_through
from partwright.approximation.sketches.directions import frame_along
from partwright.rows import units
from partwright.shapes.topology import EdgeTable, area_vectors

Floats = NDArray[np.float64]

_SMOOTH = math.cos(math.radians(41))  # between normals of chords of a circle
_CURVED = math.cos(math.radians(0.7))
_SEEDS = 12  # faces from which tracing begins, on each of which it may fail at once
_ROUND = 0.04  # of the radius, by which a wall may be off its circle
_GAP = math.radians(66)  # around a section, that chords and a flat may leave between places on its wall
_SEEN = 0.4  # of a turn, that a wall goes around, beside what meets it
_CLOSED = 0.85  # the same where tracing begins
_WIDE = 1.5  # radii from the middle, up to which sections are looked at
_LEAST, _MOST = 4e-3, 0.35  # radius, unit lengths
_STEP = 0.3  # radii from section to section
_TURNS = 4  # of a section, until it stands across
_UPRIGHT, _NEARLY = 1 - 1e-6, 0.8  # cosine between sections that are the same, and that one turns by
_FEWEST = 6  # places on a wall that say how wide it is
_HALVINGS = 9  # of a step, for where a rod ends
_MOST_STEPS = 600
_SAME = 0.04  # of the radius, by which that of the next section may differ
_HOLLOW = (0.1, 0.97)  # of the radius, between which that of a bore may be


class Ring(NamedTuple):
    """A round section: its middle (3,), the direction (3,) across it, its radius and that of a bore or 0, and
    places on its wall (N, 3)."""

    middle: Floats
    way: Floats
    radius: float
    bore: float
    wall: Floats


class _Section(NamedTuple):
    """Where edges of faces cross a plane (K, 2), from its middle along `frame` (3, 2); and where these faces
    look, unit vectors in the plane (K, 2) and in space (K, 3)."""

    flat: Floats
    out: Floats
    normals: Floats
    frame: Floats


@dataclass(frozen=True)
class Traced:
    """Middles (K, 3) in order, unit tangents (K, 3) there, the radius, that of the bore or 0, and places on
    the wall (N, 3)."""

    middles: Floats
    ways: Floats
    radius: float
    bore: float
    wall: Floats

    @property
    def bends(self) -> bool:
        """Whether it turns anywhere."""
        return bool((self.ways @ self.ways[0]).min() < math.cos(math.radians(8)))


class PipeTracing:
    """The surface whose rods are traced: vertices (V, 3) and faces (F, 3) of a closed mesh, unit lengths."""

    def __init__(self, vertices: Floats, faces: NDArray[np.int64]) -> None:
        self.vertices = np.asarray(vertices, dtype=np.float64)
        self.faces = np.asarray(faces, dtype=np.int64)
        corners = self.vertices[self.faces]
        self._normals = units(area_vectors(corners))
        self._low, self._high = corners.min(axis=1), corners.max(axis=1)

    def found(self) -> list[Traced]:
        """Rods and tubes that bend, each once."""
        found: list[Traced] = []
        for middle, way, face in self._seeds():
            if any(_covers(known, middle, self._normals[face]) for known in found):
                continue
            traced = self._traced(middle, way, self._normals[face])
            if traced is not None and traced.bends and not _again(traced, found):
                found.append(traced)
        return found

    def _seeds(self) -> list[tuple[Floats, Floats, int]]:
        """Middles of faces that are curved both ways, as the walls of a bend are, the direction along which
        they are curved less, and the face; spread over all such."""
        _, beside = EdgeTable(self.faces).pairs
        one, two = self._normals[beside[:, 0]], self._normals[beside[:, 1]]
        cosine = (one * two).sum(axis=1)
        turns = (cosine < _CURVED) & (cosine > _SMOOTH)
        axis = np.cross(one[turns], two[turns])
        sine = np.linalg.norm(axis, axis=1)
        axis /= sine[:, None]
        pairs = beside[turns]
        # Of each face the axis about which it turns most, and whether it turns about another one, too.
        order = np.argsort(sine)
        main = np.zeros((len(self.faces), 3))
        for column in (0, 1):
            main[pairs[order, column]] = axis[order]
        doubly = np.zeros(len(self.faces), bool)
        for column in (0, 1):
            across = np.abs((main[pairs[:, column]] * axis).sum(axis=1)) < 0.8
            doubly[pairs[across, column]] = True
        curved = np.flatnonzero(doubly)
        if not len(curved):
            return []
        middles = self.vertices[self.faces[curved]].mean(axis=1)
        chosen = _spread(middles, min(_SEEDS, len(curved)))
        return [(middles[k], main[curved[k]], int(curved[k])) for k in chosen]

    def _traced(self, place: Floats, way: Floats, normal: Floats) -> Traced | None:
        """From a place on a wall both ways along it, to where it ends."""
        first = self._first(place, way, normal)
        if first is None:
            return None
        forwards = self._onwards(first)
        backwards = self._onwards(first._replace(way=-first.way)) if forwards else []
        rings = [*(one._replace(way=-one.way) for one in backwards[:0:-1]), *forwards]
        if not forwards or len(rings) < 4:
            return None
        middles = np.array([ring.middle for ring in rings])
        bores = [ring.bore for ring in rings]
        hollow = np.median(bores) if np.mean(np.array(bores) > 0) > 0.8 else 0.0
        radius = float(np.median([ring.radius for ring in rings]))
        ways = np.array([ring.way for ring in rings])
        wall = np.concatenate([ring.wall for ring in rings])
        return Traced(middles, ways, radius, float(hollow), wall)

    def _first(self, place: Floats, way: Floats, normal: Floats) -> Ring | None:
        """The section through a place on the wall, where it closes around."""
        for reach in (0.08, 0.4):  # of sections of thin rods, most lie near; then what is wider
            section = self._section(place, way, reach)
            inwards = -normal @ section.frame
            inwards = inwards / max(float(np.linalg.norm(inwards)), 1e-12)
            radius = _radius_through(section.flat, section.out, inwards)
            if radius is None or not _LEAST < radius < _MOST:
                continue
            ring = self._standing(place + radius * (section.frame @ inwards), way, radius, _CLOSED)
            if ring is not None:
                return ring
        return None

    def _onwards(self, first: Ring) -> list[Ring]:
        """Rings from the first on, in its direction, the last where the rod ends; none of what goes all
        around."""
        rings = [first]
        while len(rings) < _MOST_STEPS:
            last, step = rings[-1], _STEP * rings[-1].radius
            ahead = self._next(last, step)
            if ahead is None:
                part = 0.0
                for k in range(1, _HALVINGS + 1):
                    more = part + step / 2**k
                    if self._next(last, more) is not None:
                        part = more
                end = self._next(last, part) if part else None
                return [*rings, end] if end is not None else rings
            travelled = len(rings) * step
            if travelled > 8 * first.radius and math.dist(ahead.middle, first.middle) < step:
                return []
            rings.append(ahead)
        return rings

    def _next(self, last: Ring, step: float) -> Ring | None:
        ahead = self._standing(last.middle + step * last.way, last.way, last.radius, _SEEN)
        if ahead is None or abs(ahead.radius - last.radius) > _SAME * last.radius:
            return None
        return ahead if float((ahead.middle - last.middle) @ last.way) > 0.3 * step else None

    def _standing(self, middle: Floats, way: Floats, radius: float, seen: float) -> Ring | None:
        """The ring about nearly this middle, across the wall, which is nearly across a direction."""
        ring = self._across(middle, way, radius, seen)
        for _ in range(_TURNS):
            if ring is None:
                return None
            again = self._across(ring.middle, ring.way, radius, seen)
            if again is not None and float(again.way @ ring.way) > _UPRIGHT:
                return again
            ring = again
        return ring

    def _across(self, middle: Floats, way: Floats, radius: float, seen: float) -> Ring | None:
        """The ring about nearly this middle in the plane across a direction, with that to which the wall is
        square there; None where no wall closes around it."""
        section = self._section(middle, way, _WIDE * radius)
        flat, out, frame = section.flat, section.out, section.frame
        centre, size = np.zeros(2), radius
        wall = np.zeros(len(flat), bool)
        for near in (2 * _ROUND, 2 * _ROUND, _ROUND):
            spokes = flat - centre
            reach = np.linalg.norm(spokes, axis=1)
            along = (spokes * out).sum(axis=1)
            wall = (along > 0.7 * reach) & (np.abs(reach - size) < near * radius)
            if wall.sum() < 8:
                return None
            centre, size, _ = circle_through(flat[wall])
            if not math.isfinite(size) or float(np.hypot(*centre)) > radius:
                return None
        if _share(flat[wall] - centre) < seen:
            return None
        bore = 0.0
        hollow = (along < -0.7 * reach) & (reach < _HOLLOW[1] * size) & (reach > _HOLLOW[0] * size)
        if hollow.sum() >= 8:
            near_it = hollow & (np.abs(reach - np.median(reach[hollow])) < _ROUND * radius)
            bore = float(np.median(reach[near_it])) if _share(spokes[near_it]) >= seen else 0.0
        square = np.linalg.eigh(section.normals[wall].T @ section.normals[wall])[1][:, 0]
        if abs(float(square @ way)) < _NEARLY:
            return None
        places = middle + flat[wall] @ frame.T
        return Ring(middle + frame @ centre, square * np.sign(square @ way), float(size), bore, places)

    def _section(self, middle: Floats, way: Floats, reach: float) -> _Section:
        """Of faces near a place, in the plane through it across a direction."""
        near = ((self._low < middle + reach) & (self._high > middle - reach)).all(axis=1)
        faces = self.faces[near]
        height = (self.vertices[faces] - middle) @ way
        frame = frame_along(way)[:, :2]
        places, looks = [], []
        for a, b in ((0, 1), (1, 2), (2, 0)):
            crossed = (height[:, a] > 0) != (height[:, b] > 0)
            own = faces[crossed]
            above, below = height[crossed, a], height[crossed, b]
            share = (above / (above - below))[:, None]
            corner, other = self.vertices[own[:, a]], self.vertices[own[:, b]]
            places.append((corner + share * (other - corner) - middle) @ frame)
            looks.append(self._normals[near][crossed])
        flat, normals = np.concatenate(places), np.concatenate(looks)
        out = normals @ frame
        length = np.linalg.norm(out, axis=1)
        kept = (length > 0.3) & (np.linalg.norm(flat, axis=1) < reach)  # others lie along it, as an end does
        return _Section(flat[kept], out[kept] / length[kept, None], normals[kept], frame)


def _radius_through(flat: Floats, out: Floats, inwards: Floats) -> float | None:
    """That of the circle through the origin, on a wall, and most others of a section (K, 2), whose walls look
    away from its middle."""
    square, along = (flat**2).sum(axis=1), flat @ inwards
    far = along > 0.05 * np.sqrt(square)
    flat, out, radii = flat[far], out[far], square[far] / (2 * along[far])
    spokes = flat - radii[:, None] * inwards
    looks = (spokes * out).sum(axis=1) > 0.7 * np.linalg.norm(spokes, axis=1)
    if looks.sum() < _FEWEST:
        return None
    values = np.sort(radii[looks])
    ends = np.searchsorted(values, values * (1 + 2 * _ROUND), side="right")
    counts = ends - np.arange(len(values))
    first = int(counts.argmax())
    return float(np.median(values[first : ends[first]])) if counts[first] >= _FEWEST else None


def _share(spokes: Floats) -> float:
    """Of a turn, what lies between spokes that are not far apart."""
    if not len(spokes):
        return 0.0
    turns = np.sort(np.arctan2(spokes[:, 1], spokes[:, 0]))
    gaps = np.diff(np.r_[turns, turns[0] + 2 * math.pi])
    return 1.0 - float(gaps[gaps > _GAP].sum()) / (2 * math.pi)


def _spread(points: Floats, count: int) -> list[int]:
    """So many of points (N, 3), each as far from those before as can be."""
    chosen = [0]
    away = np.linalg.norm(points - points[0], axis=1)
    while len(chosen) < count:
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return chosen


def _covers(known: Traced, place: Floats, normal: Floats) -> bool:
    """Whether a place on the surface is on the wall of a rod."""
    middle = place - known.radius * normal
    return bool(np.linalg.norm(known.middles - middle, axis=1).min() < _STEP * known.radius)


def _again(one: Traced, found: list[Traced]) -> bool:
    return any(
        math.dist(one.middles[len(one.middles) // 2], other.middles[k]) < 0.5 * other.radius
        for other in found
        for k in range(len(other.middles))
    )
