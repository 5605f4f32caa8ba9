"""A body of any form as few extrusions, one upon the other, that follow it within a tolerance."""

from __future__ import annotations

import math

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold, OpType

from partwright.approximation.profile_parts import extruded_part
from partwright.approximation.sketches.sections import View, profile_of
from partwright.assembly import Part

_STEPS = 4  # sections that are looked at in each tolerance of height
_MOST_SECTIONS = 120
_SIMPLER = 0.2  # tolerances, by which corners of an outline may be left out
_OVERLAP = 0.05  # tolerances, by which one reaches into the next: numbers are rounded later
_LEAST = 0.25  # tolerances: half the width of what is drawn


def terraces(
    body: Manifold, frame: np.ndarray, tolerance: float, most: int, about: np.ndarray
) -> list[Part] | None:
    """Extrusions along the frame's third column; None where more than `most` would be needed.

    body: closed. frame: (3, 3), a rotation. tolerance: a length, by which the extrusions' union may lie from
    the body, within a section, and along the frame. about: (N, 3) points; what none of them is within, seen
    along the frame, is left out.
    """
    view = View.along(body, frame)
    if view.body.is_empty():
        return None
    low, high = view.levels[0], view.levels[-1]
    count = int(np.clip(math.ceil((high - low) / tolerance * _STEPS), 2, _MOST_SECTIONS))
    step = (high - low) / count
    square = CrossSection.square((tolerance, tolerance)).translate((-tolerance / 2, -tolerance / 2))
    seen = [square.translate((x, y)) for x, y, _ in about @ frame]
    places = CrossSection.batch_boolean(seen, OpType.Add)
    sections = [_section(view, low + (k + 0.5) * step, tolerance, places) for k in range(count)]
    allowed = max(1, int(tolerance / step))
    parts: list[Part] = []
    start = 0
    while start < count:
        end = start + 1
        while end < count and _stands_for(sections, start, end + 1, allowed, tolerance):
            end += 1
        for region in sections[(start + end) // 2].decompose():
            profile = profile_of(region)
            if profile is None:
                continue
            bottom = low + start * step - (_OVERLAP * tolerance if start else 0.0)
            parts.append(extruded_part(profile, frame, bottom, low + end * step))
            if len(parts) > most:
                return None
        start = end
    return parts or None


def _section(view: View, height: float, tolerance: float, places: CrossSection) -> CrossSection:
    """Regions that meet places, without what is thinner than can be far off."""
    whole = view.body.slice(height)
    thick = whole.offset(-_LEAST * tolerance, JoinType.Miter).offset(_LEAST * tolerance, JoinType.Miter)
    regions = (thick ^ whole).simplify(_SIMPLER * tolerance).decompose()
    kept = [region for region in regions if not (region ^ places).is_empty()]
    return CrossSection.compose(kept) if kept else CrossSection()


def _stands_for(sections: list[CrossSection], start: int, end: int, allowed: int, tolerance: float) -> bool:
    """Whether the middle one of sections is like those between, but for so many at either end."""
    middle = sections[(start + end) // 2]
    wider = middle.offset(tolerance, JoinType.Miter)
    for other in sections[start + allowed : max(start, end - allowed)]:
        if (
            not (other - wider).is_empty()
            or not (middle - other.offset(tolerance, JoinType.Miter)).is_empty()
        ):
            return False
    return True
