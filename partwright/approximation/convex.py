"""Parts as straight ones: a bent part along its arc, a hollow box as its walls."""

from __future__ import annotations

import dataclasses
import math

from partwright.assembly import Part, Similarity
from partwright.assembly.rows import as_superfrustum
from partwright.fields import Box, SuperFrustum

MOST_SEGMENTS = 12
_STRAIGHT = 1e-3  # radians


def segments(part: Part, allowed: float) -> list[Part]:
    """The part as straight ones along its arc, whose chords leave the arc by no more than `allowed`,
    nor by half the part's thickness.

    Each has the cross-section, taper, hole and dilation that the part has there. A straight part is one.
    """
    f = as_superfrustum(part.field)
    angle, h = f.bulge * math.pi / 2, f.size[2] / 2
    if angle < _STRAIGHT or h == 0:
        return [part]
    radius = h / math.sin(angle)
    outermost = radius + max(1.0, f.taper) * f.size[0] / 2 + f.dilation
    step = math.acos(max(1 - min(allowed, f.thinnest / 2) / outermost, 0.0))
    count = min(max(math.ceil(angle / step), 2), MOST_SEGMENTS)
    pose = part.pose
    result = []
    for i in range(count):
        turn = angle * ((2 * i + 1) / count - 1)
        place = (radius * (math.cos(angle) - math.cos(turn)), 0.0, radius * math.sin(turn))
        local = pose @ Similarity(1.0, (math.cos(turn / 2), 0.0, math.sin(turn / 2), 0.0), place)
        field = _segment(f, i / count, (i + 1) / count, 2 * radius * math.tan(angle / count))
        name = f"{part.name}/{i + 1}"
        result.append(Part(field, local.translation, local.rotation, part.blend, name))
    return result


def walls(part: Part) -> list[Part]:
    """The four walls of a hollow box, each a box; none of a part that is no hollow box."""
    own = part.field.superfrustum()
    if own is None or not own.hollow or own.roundness or own.dilation or own.bulge or own.taper != 1.0:
        return []
    x, y, z = own.size
    wall = (1 - own.onion) * min(x, y) / 2
    if wall <= 0:
        return []
    pose = part.pose
    placed = [
        (Box((x, wall, z)), (0.0, (y - wall) / 2, 0.0)),
        (Box((x, wall, z)), (0.0, (wall - y) / 2, 0.0)),
        (Box((wall, y - 2 * wall, z)), ((x - wall) / 2, 0.0, 0.0)),
        (Box((wall, y - 2 * wall, z)), ((wall - x) / 2, 0.0, 0.0)),
    ]
    return [
        Part(field, (one := pose @ Similarity(translation=place)).translation, one.rotation, part.blend)
        for field, place in placed
    ]


def _segment(f: SuperFrustum, start: float, stop: float, height: float) -> SuperFrustum:
    """The stretch of the part between two shares of its height, on a height of its own."""
    m = min(f.size[:2]) / 2
    first, last = (m * (f.taper - 1) * share for share in (start, stop))
    corner = max(f.roundness * m + first, 0.0)
    middle = m + first
    if middle <= 0:  # beyond a tip
        return dataclasses.replace(f, size=(0.0, 0.0, height), bulge=0.0)
    return SuperFrustum(
        (f.size[0] + 2 * first, f.size[1] + 2 * first, height),
        min(corner / middle, 1.0),
        f.dilation,
        min(max((m + last) / middle, 0.0), 2.0),
        0.0,
        f.onion,
    )
