"""Cones in which drilled holes end, as countersinks and chamfers do: part of the hole, as they are drawn.
Those that no hole has are told."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.profile_parts import revolved_part
from partwright.approximation.sketches.ends import STEPS
from partwright.approximation.sketches.hole_mouths import Mouth
from partwright.approximation.sketches.round_holes import RoundHole
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder
from partwright.fields.profile import Profile
from partwright.metrics.deviation import places_in
from partwright.rows import units
from partwright.shapes import Shape, length_text

Floats = NDArray[np.float64]
Distance = Callable[[NDArray[np.float32]], NDArray[np.float32]]

ASIDE = 1e-3  # unit lengths: how far axes of one hole may lie apart, and numbers of copies differ
PARALLEL = 1e-6  # of a cosine
WALL = 0.01  # of a radius, by which that of a mesh's wall may differ, whose corners may lie on chords
_AROUND = 8  # points around a mouth
_WITHIN = 0.5, 0.8  # of a mouth's depth, at which it is looked at
_ACROSS = 0.5, 0.95  # of a mouth's radius, at which what lies beyond is
_FILLED = 0.5  # of a mouth's points, that are filled where it is not there


class _Cone(NamedTuple):
    """Of a hole along its own axis: from which height to which, and the radius there. over: how far it goes
    on beyond, in the open. Unit lengths."""

    start: float
    end: float
    radius: float
    over: float


class _End(NamedTuple):
    """Of a hole's wall: how far from its middle, towards its side, and what follows. Unit lengths."""

    height: float
    mouth: Mouth | None


Cones = tuple[_Cone | None, _Cone | None]
_NONE: Cones = None, None


@dataclass(frozen=True)
class HoleMouths:
    """holes: of a shape; empty, fold: distance (N,) at points (N, 3), unit lengths, of the shape and of what
    the holes are cut from. reach: unit lengths that a mouth goes on in the open."""

    holes: Sequence[RoundHole]
    empty: Distance
    fold: Distance
    reach: float

    def of(self, hole: Part) -> Iterator[Part]:
        """A drilled hole with the mouths that the shape has, where the fold fills one of its copies'; copies
        that end otherwise are a hole by themselves."""
        assert isinstance(hole.field, Cylinder)
        copies = hole.copies
        sorts: list[tuple[Cones, list[int]]] = []
        for k, cones in enumerate(map(self._cones, copies)):
            _sort_in(sorts, cones, [k])
        needed: list[tuple[Cones, list[int]]] = []
        for cones, own in sorts:
            filled = any(self._is_filled(copies[k], cones) for k in own)
            _sort_in(needed, cones if filled else _NONE, own)
        moves = (Similarity(), *hole.instances)
        for cones, (first, *others) in needed:
            back = moves[first].inverse()
            part = copies[first] if cones == _NONE else _turned(copies[first], cones)
            further = hole.instances if len(needed) == 1 else [moves[k] @ back for k in others]
            yield replace(part, name=hole.name, instances=tuple(further))

    def are_missing(self, hole: Part) -> bool:
        """Whether the fold fills a mouth of one of the copies of a drilled hole."""
        return any(self._is_filled(copy, self._cones(copy)) for copy in hole.copies)

    def _cones(self, copy: Part) -> Cones:
        """At its lower and its upper end."""
        axis, ends = rotation_matrix(copy.rotation)[:, 2], [_End(-np.inf, None), _End(-np.inf, None)]
        for hole in self.holes:
            if not _is_of(hole, copy, axis):
                continue
            order = (0, 1) if axis @ (hole.end - hole.start) > 0 else (1, 0)
            for k, side, wall in zip((0, 1), (-1.0, 1.0), order, strict=True):
                at = (hole.start, hole.end)[wall]
                own = _End(side * float((at - copy.translation) @ axis), hole.mouths[wall])
                ends[k] = max(ends[k], own, key=_height)
        return self._cone(copy, -1.0, ends[0]), self._cone(copy, 1.0, ends[1])

    def _cone(self, copy: Part, side: float, wall: _End) -> _Cone | None:
        """The mouth that follows the wall towards one side of a copy."""
        if wall.mouth is None:
            return None
        radius, end = wall.mouth.radius, wall.height + wall.mouth.depth
        beyond = [(share * radius, end + step) for share in _ACROSS for step in STEPS]
        is_open = bool((self.empty(around(copy, side, beyond)) > 0).all())
        assert isinstance(copy.field, Cylinder)
        if not is_open and end < copy.field.height / 2 - ASIDE:
            return None  # the hole goes on, by its own wall
        return _Cone(wall.height, end, radius, self.reach if is_open else 0.0)

    def _is_filled(self, copy: Part, cones: Cones) -> bool:
        """Whether the fold is where one of the cones would be."""
        assert isinstance(copy.field, Cylinder)
        radius = copy.field.radius
        for side, cone in zip((-1.0, 1.0), cones, strict=True):
            if cone is not None:
                within = _within(radius, cone.radius, cone.start, cone.end)
                if _is_filled(self.fold, copy, side, within):
                    return True
        return False


@dataclass(frozen=True)
class LeftOut:
    """A mouth that a shape has and what was fitted fills. place: (3,) where it is widest, on its axis;
    radius: there; unit lengths."""

    place: Floats
    radius: float

    def is_beside(self, point: Floats) -> bool:
        """Whether a point (3,) is one of its own."""
        return float(np.linalg.norm(point - self.place)) < self.radius


def mouths_left_out(holes: Sequence[RoundHole], distance: Distance) -> list[LeftOut]:
    """Those of holes of a shape that a solid fills, the widest first, those alike by their place; distance:
    (N,) of that at points (N, 3), unit lengths."""
    found: list[LeftOut] = []
    for hole in holes:
        part, half = hole.part(), float(np.linalg.norm(hole.end - hole.start)) / 2
        axis = units(hole.end - hole.start)
        for side, mouth in zip((-1.0, 1.0), hole.mouths, strict=True):
            if mouth is None:
                continue
            top = half + mouth.depth
            if _is_filled(distance, part, side, _within(hole.radius, mouth.radius, half, top)):
                found.append(LeftOut(hole.middle + side * top * axis, mouth.radius))
    return sorted(found, key=lambda mouth: (-round(mouth.radius, 4), *mouth.place.round(3)))


def mouth_warnings(shape: Shape, mouths: Sequence[LeftOut]) -> tuple[str, ...]:
    """One sentence for all that no feature has; none where there are none."""
    if not mouths:
        return ()
    wide = float(shape.frame.length_from_unit(2 * max(mouth.radius for mouth in mouths)))
    several = f"countersinks or chamfers of {len(mouths)} holes, up to"
    many = several if len(mouths) > 1 else "a countersink or chamfer of a hole,"
    places = places_in(shape, (mouth.place for mouth in mouths))
    it = "them" if len(mouths) > 1 else "it"
    return (f"left out: {many} {length_text(wide, shape.unit)} wide, at the {places}: no feature has {it}",)


def _within(narrow: float, wide: float, low: float, high: float) -> list[tuple[float, float]]:
    """Distances from the axis and heights in a cone from one height to another, outside of the hole."""
    return [(narrow + share / 2 * (wide - narrow), low + share * (high - low)) for share in _WITHIN]


def _is_filled(distance: Distance, hole: Part, side: float, rings: Sequence[tuple[float, float]]) -> bool:
    """Whether a solid is at most points of rings around a hole's axis, towards one side."""
    return float((distance(around(hole, side, rings)) < 0).mean()) > _FILLED


def _sort_in(sorts: list[tuple[Cones, list[int]]], cones: Cones, own: list[int]) -> None:
    """Some copies to those that end as they do."""
    same = next((others for known, others in sorts if _are_same(known, cones)), None)
    if same is None:
        sorts.append((cones, list(own)))
    else:
        same += own


def _height(end: _End) -> float:
    return end.height


def _is_of(hole: RoundHole, copy: Part, axis: Floats) -> bool:
    """Whether a hole of the mesh is a piece of a copy of a drilled one."""
    assert isinstance(copy.field, Cylinder)
    way, middle = units(hole.end - hole.start), hole.middle - copy.translation
    height = float(middle @ axis)
    aside = float(np.linalg.norm(middle - height * axis))
    return (
        abs(float(axis @ way)) > 1 - PARALLEL
        and abs(height) < copy.field.height / 2
        and aside < ASIDE
        and abs(copy.field.radius - hole.radius) < WALL * copy.field.radius
    )


def around(copy: Part, side: float, rings: Sequence[tuple[float, float]]) -> NDArray[np.float32]:
    """(N, 3) points around its axis: at distances from it and heights towards one side."""
    turns = np.arange(_AROUND) * (2 * np.pi / _AROUND)
    local = [
        np.column_stack([r * np.cos(turns), r * np.sin(turns), np.full(_AROUND, side * z)]) for r, z in rings
    ]
    return (np.concatenate(local) @ rotation_matrix(copy.rotation).T + copy.translation).astype(np.float32)


def _are_same(one: Cones, other: Cones) -> bool:
    return all(
        a is b or (a is not None and b is not None and np.allclose(a, b, rtol=0, atol=ASIDE))
        for a, b in zip(one, other, strict=True)
    )


def _turned(hole: Part, cones: Cones) -> Part:
    """A copy of a drilled hole, with cones at its ends."""
    assert isinstance(hole.field, Cylinder)
    radius, half = hole.field.radius, hole.field.height / 2
    lower, upper = (_wall(cone, radius, half) for cone in cones)
    wall = [(r, -z) for r, z in reversed(lower)] + upper
    frame = rotation_matrix(hole.rotation)
    x, y, z = (frame.T @ np.array(hole.translation)).tolist()
    profile = Profile.polygon([(0.0, wall[0][1]), *wall, (0.0, wall[-1][1])])
    return revolved_part(profile.moved((0.0, z)), frame, np.array([x, y, 0.0]))


def _wall(cone: _Cone | None, radius: float, half: float) -> list[tuple[float, float]]:
    """Distance from the axis and height of the wall's corners from the middle to an end."""
    if cone is None:
        return [(radius, half)]
    top = cone.end + cone.over
    beyond = [(cone.radius, top)] if cone.over else []
    further = [(radius, top), (radius, half)] if top < half - ASIDE else []  # as in a counterbore
    return [(radius, cone.start), (cone.radius, cone.end), *beyond, *further]
