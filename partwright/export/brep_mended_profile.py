"""Profiles that OpenCASCADE takes, near to others, whose outlines touch or cross themselves."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from manifold3d import CrossSection, FillRule

from partwright.approximation.sketches.pinches import unpinched
from partwright.approximation.sketches.slits import section_of, touches_itself, without_slits
from partwright.errors import ParameterError
from partwright.export.brep_crossed_corners import uncrossed
from partwright.fields import Extrusion, Revolution, Swept
from partwright.fields.profile import Loop, Profile

_APART = 2e-4  # of the profile's size: how far corners that are one are moved apart
_CHORD = 5e-4  # of the profile's size: how far the chords of an arc lie from it
_SAME_AREA = 5e-3  # by which closed slits may change the area
_MOST_ARCS = 24  # that are tried one by one


def mended(field: Swept) -> Iterator[tuple[Swept, float]]:
    """Fields of nearly the same profile, and how far each is off: as a length."""
    profile = field.profile
    distance = _APART * profile.size
    loops, width = uncrossed(profile)
    if width:
        yield from _with_profile(field, loops, width)
    outline, holes = unpinched(profile.outline, distance / 2)
    if holes:
        yield from _with_profile(field, (outline, *profile.holes, *holes), distance)
    chord = _CHORD * profile.size
    if touches_itself(profile.loops, distance / 10):
        for apart in without_slits(section_of(profile, chord), distance):
            if abs(apart.area() / profile.area - 1) < _SAME_AREA:
                yield from _with_profile(field, _loops_of(apart), chord + distance)
    arcs = [(i, k) for i, sides in enumerate(profile.sides) for k, side in enumerate(sides) if side.sweep]
    for arc in arcs[:_MOST_ARCS]:
        yield from _with_profile(field, _in_chords(profile, {arc}, chord), chord)
    yield from _with_profile(field, _in_chords(profile, set(arcs), chord), chord)


def _loops_of(section: CrossSection) -> tuple[Loop, ...]:
    lines = [np.asarray(line) for line in section.to_polygons()]
    lines.sort(key=lambda line: -CrossSection([line], FillRule.EvenOdd).area())
    return tuple(tuple((x, y, 0.0) for x, y in line.tolist()) for line in lines)


def _with_profile(field: Swept, loops: tuple[Loop, ...], off: float) -> Iterator[tuple[Swept, float]]:
    with suppress(ParameterError):
        yield _of_profile(field, Profile.of_loops(loops)), off


def _of_profile(field: Swept, profile: Profile) -> Swept:
    if isinstance(field, Revolution):
        return dataclasses.replace(field, profile=profile)
    assert isinstance(field, Extrusion)
    return dataclasses.replace(field, profile=profile)


def _in_chords(profile: Profile, arcs: set[tuple[int, int]], tolerance: float) -> tuple[Loop, ...]:
    """The loops with arcs, by loop and place in it, as lines between points of theirs."""
    loops = []
    for i, (loop, sides) in enumerate(zip(profile.loops, profile.sides, strict=True)):
        corners: list[tuple[float, float, float]] = []
        for k, (corner, side) in enumerate(zip(loop, sides, strict=True)):
            if (i, k) not in arcs or side.centre is None:
                corners.append(corner)
                continue
            widest = 2 * math.acos(max(1 - tolerance / side.radius, -1.0))
            count = max(2, math.ceil(abs(side.sweep) / widest))
            (x, y), (px, py) = side.centre, side.start
            for turn in (side.sweep * j / count for j in range(count)):
                c, s = math.cos(turn), math.sin(turn)
                dx, dy = px - x, py - y
                corners.append((x + c * dx - s * dy, y + s * dx + c * dy, 0.0))
        loops.append(tuple(corners))
    return tuple(loops)
