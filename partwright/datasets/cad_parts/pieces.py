"""What CAD parts are put together from: placed solids, patterns, fillets. Lengths in millimetres, Z up.

What is joined overlaps: faces that only touch would leave cracks where a turn rounds their corners.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.fields import Box, Cylinder, Field, Frustum, Quadric

Point = tuple[float, float, float]
_HALF = math.sqrt(0.5)
# the direction that the solid's own z takes
ALONG = {"z": (1.0, 0.0, 0.0, 0.0), "x": (_HALF, 0.0, _HALF, 0.0), "y": (_HALF, -_HALF, 0.0, 0.0)}
THROUGH = 1.0  # what a cut goes beyond the faces it opens, and a joined piece into what it stands on


def placed(field: Field, at: Point, along: str = "z", name: str = "") -> Part:
    x, y, z = (float(v) for v in at)
    return Part(field, (x, y, z), ALONG[along], name=name)


def block(x: float, y: float, z: float, at: Point, name: str = "block") -> Part:
    """A cuboid with the middle of its lower face at a place."""
    size = (float(x), float(y), float(z))
    return placed(Box(size), (at[0], at[1], at[2] + z / 2), name=name)


def rod(radius: float, height: float, at: Point, along: str = "z", name: str = "rod") -> Part:
    """A cylinder whose lower end has its middle at a place."""
    return placed(Cylinder(float(radius), float(height)), _lifted(at, height / 2, along), along, name)


def cone(bottom: float, top: float, height: float, at: Point, along: str = "z", name: str = "cone") -> Part:
    """A frustum, neither end a point, whose lower end has its middle at a place; it may widen upwards."""
    field = Frustum(float(max(bottom, top)), float(min(bottom, top)), float(height))
    part = placed(field, _lifted(at, height / 2, along), along, name)
    if bottom >= top:
        return part
    over = Similarity(rotation=(0.0, 1.0, 0.0, 0.0) if along != "x" else (0.0, 0.0, 1.0, 0.0))
    centre = np.array(part.translation)
    shift = centre - over(centre)
    return part.transformed(Similarity(1.0, over.rotation, tuple(shift.tolist())))


def hole(radius: float, depth: float, at: Point, along: str = "z", name: str = "hole") -> Part:
    """A cylinder from beyond a face, at a place on it, down to a depth (against its direction)."""
    return rod(radius, depth + THROUGH, _lifted(at, -depth, along), along, name)


def _lifted(at: Point, by: float, along: str) -> Point:
    step = {"x": (by, 0.0, 0.0), "y": (0.0, by, 0.0), "z": (0.0, 0.0, by)}[along]
    x, y, z = (float(a + b) for a, b in zip(at, step, strict=True))
    return x, y, z


def repeated(part: Part, moves: Iterable[Similarity]) -> Part:
    """The part and a copy for each move."""
    return Part(part.field, part.translation, part.rotation, name=part.name, instances=tuple(moves))


def at_places(part: Part, places: list[Point]) -> Part:
    """The part with its origin's offset at each of the places, the first of which it stands at."""
    first = np.array(places[0])
    moves = [Similarity(translation=tuple((np.array(p) - first).tolist())) for p in places[1:]]
    return repeated(part.translated(tuple(first.tolist())), moves)


def around(part: Part, count: int) -> Part:
    """Copies turned about z, evenly."""
    turns = [2 * math.pi * i / count for i in range(1, count)]
    return repeated(part, [Similarity(rotation=(math.cos(t / 2), 0, 0, math.sin(t / 2))) for t in turns])


def corners(x: float, y: float, z: float = 0.0) -> list[Point]:
    return [(sx * x, sy * y, z) for sx in (-1, 1) for sy in (-1, 1)]


def union(*nodes: Node) -> Node:
    return nodes[0] if len(nodes) == 1 else Assembly(tuple(nodes))


def without(body: Node, cuts: list[Node]) -> Node:
    return Assembly((body, *cuts), "difference") if cuts else body


def rounded_plate(x: float, y: float, z: float, radius: float, at: Point = (0.0, 0.0, 0.0)) -> Node:
    """A slab whose upright edges are rounded; from its lower face's middle up."""
    if radius <= 0:
        return block(x, y, z, at, "plate")
    cx, cy, cz = at
    rounding = rod(radius, z, (cx, cy, cz), name="corner")
    return union(
        block(x - 2 * radius, y, z, at, "plate"),
        block(x, y - 2 * radius, z, at, "plate"),
        at_places(rounding, corners(x / 2 - radius, y / 2 - radius)),
    )


def slot(length: float, radius: float, depth: float, at: Point) -> Node:
    """A long hole with round ends along x, cut down to a depth from a place on an upper face."""
    x, y, z = at
    end = hole(radius, depth, (x - length / 2, y, z), name="slot_end")
    middle = block(length, 2 * radius, depth + THROUGH, (x, y, z - depth), "slot")
    return union(middle, repeated(end, [Similarity(translation=(length, 0.0, 0.0))]))


def fillet(radius: float, length: float, at: Point, toward: tuple[int, int]) -> Node:
    """Fills the inner edge along y at a place with a concave rounding towards (+-x, +-z)."""
    x, y, z = at
    sx, sz = toward
    side, middle = radius + THROUGH, (radius - THROUGH) / 2
    fill = placed(Box((side, length, side)), (x + sx * middle, y, z + sz * middle), name="fillet")
    centre = (x + sx * radius, y, z + sz * radius)
    curve = placed(Cylinder(radius, length + 2 * THROUGH), centre, "y", "fillet_curve")
    return Assembly((fill, curve), "difference")


def gusset(width: float, height: float, thickness: float, at: Point) -> Node:
    """A triangular rib in the xz-plane: the right angle at a place, legs along +x and +z."""
    x, y, z = at
    foot = (x + (width - THROUGH) / 2, y, z - THROUGH)
    body = block(width + THROUGH, thickness, height + THROUGH, foot, "rib")
    length = math.hypot(width, height)
    n = (height / length, 0.0, width / length)
    slope = Quadric.plane(n, n[0] * (x + width) + n[2] * z)
    return Assembly((body, Part(slope, name="rib_slope")), "intersection")


def chamfered(body: Part, radius: float, end: Point, outward: float) -> Node:
    """A rod along x whose edge at `end` is cut off at 45 degrees, down to `radius` at the end."""
    x, y, z = end
    edge = Quadric.cone(1.0, (1.0, 0.0, 0.0), (x + outward * radius, y, z))
    return Assembly((body, Part(edge, name="chamfer")), "intersection")
