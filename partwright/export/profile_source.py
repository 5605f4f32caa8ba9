"""Profiles in the sources for CAD programs: circles and rectangles by name, other loops as corners."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from partwright.fields import Extrusion, Profile, Swept
from partwright.fields.extrusion import RIMS
from partwright.fields.profile import Loop, circle_of

_SAME = 1e-9  # of a rectangle's longer side

SCAD_SOURCE = """\
// The points of a closed loop of lines and arcs. Corners are [x, y] or [x, y, bulge]; the bulge of the side
// to the next corner is the tangent of a quarter of its arc's angle, as in DXF: 0 a line, 1 half a circle.
function loop(corners) = [
    for (i = [0 : len(corners) - 1])
        let (a = corners[i], b = corners[(i + 1) % len(corners)], bulge = len(a) > 2 ? a[2] : 0)
        each side_points([a[0], a[1]], [b[0], b[1]], bulge)
];
function side_points(a, b, bulge) = bulge == 0 ? [a] :
    let (
        half = (b - a) / 2,
        centre = (a + b) / 2 + (1 - bulge * bulge) / (2 * bulge) * [-half[1], half[0]],
        angle = 4 * atan(bulge),
        steps = max(1, ceil(abs(angle) / 360 * $fn))
    )
    [for (i = [0 : steps - 1]) let (t = angle * i / steps, d = a - centre)
        centre + [d[0] * cos(t) - d[1] * sin(t), d[0] * sin(t) + d[1] * cos(t)]];
"""

SCAD_RIMS = """\
// The outline extruded, with the edges at its ends rounded or cut off: [fillet, chamfer] of the bottom and
// of the top. In slices, of an outline that is convex within their hull; each of the others goes on a little
// into the wider one before it, as what only touches would be a body of its own.
module extrude_with_rims(height, bottom, top, convex) {
    if (convex) hull() rim_slices(height, bottom, top, true) children();
    else {
        rim_slices(height, bottom, top, false) children();
        wall = height - max(bottom) - max(top);
        if (wall > 0) translate([0, 0, max(bottom) - height / 2]) linear_extrude(wall) children();
    }
}
module rim_slices(height, bottom, top, thin) {
    count = ceil($fn / (thin ? 4 : 8));
    for (end = [[-1, bottom], [1, top]])
        let (rim = end[1], steps = max(rim) == 0 ? 0 : rim[0] > 0 ? count : thin ? 1 : count)
        for (i = [0 : thin ? steps : steps - 1])
            let (
                from = rim_point(rim, i / max(steps, 1)),
                to = rim_point(rim, (i + 1) / max(steps, 1)),
                depth = thin ? from[0] : rim_point(rim, (i + 0.5) / steps)[0],
                lap = height / 10000,
                thick = thin ? min(lap, height / 2 - from[1]) : from[1] - to[1] + lap,
                low = end[0] < 0 ? (thin ? from[1] : to[1]) : height - from[1] - (thin ? thick : lap)
            )
            if (thick > 0)
                translate([0, 0, low - height / 2]) linear_extrude(thick) offset(r = -depth) children();
}
// Along a rim, from the wall (0) to the end (1): how deep within the outline, and how far from the end.
function rim_point(rim, t) = rim[0] > 0
    ? [rim[0] * (1 - cos(90 * t)), rim[0] * (1 - sin(90 * t))]
    : [rim[1] * t, rim[1] * (1 - t)];
"""

BUILD123D_SOURCE = '''\
def loop(*corners):
    """The face within lines and arcs. Corners are (x, y) or (x, y, bulge); the bulge of the side to the next
    corner is the tangent of a quarter of its arc's angle, as in DXF: 0 a line, 1 half a circle."""
    sides = []
    for (x, y, *bulge), (u, v, *_) in zip(corners, corners[1:] + corners[:1]):
        b = bulge[0] if bulge else 0
        middle = ((x + u + b * (v - y)) / 2, (y + v - b * (u - x)) / 2)
        sides.append(bd.ThreePointArc((x, y), middle, (u, v)) if b else bd.Line((x, y), (u, v)))
    return bd.make_face(sides)
'''


def swept_parameters(field: Swept) -> dict[str, Any]:
    """By name: the profile's loops, then the field's other numbers where they say anything."""
    result: dict[str, Any] = {}
    for name, loop in zip(_names(field.profile), field.profile.loops, strict=True):
        result |= {f"{name}_{what}" if what else name: value for what, value in _loop(loop).items()}
    if isinstance(field, Extrusion):
        rest = {name: value for name in ("taper", *RIMS) if (value := getattr(field, name))}
        return result | {"height": field.height} | rest
    return result | ({} if field.full else {"angle": field.angle})  # type: ignore[attr-defined]


def _names(profile: Profile) -> list[str]:
    holes = len(profile.holes)
    return ["outline", *(f"hole_{i}" if holes > 1 else "hole" for i in range(1, holes + 1))]


def meaning(name: str) -> str | None:
    """What a parameter of a profile is; None for any other."""
    if not name.startswith(("outline", "hole")):
        return None
    for end, text in (("radius", "radius of the circle"), ("size", "width and height of the rectangle")):
        if name.endswith("_" + end):
            return text
    return "its centre" if name.endswith("_centre") else "corners x, y and the bulge of the arc that follows"


def _loop(loop: Loop) -> dict[str, Any]:
    """As few numbers as say it."""
    circle = circle_of(loop)
    if circle is not None:
        radius, centre = circle
        return {"radius": radius} | _centre(centre, radius)
    box = _rectangle(loop)
    if box is not None:
        size, centre = box
        return {"size": size} | _centre(centre, max(size))
    return {"": tuple((x, y, b) if b else (x, y) for x, y, b in loop)}


def _centre(centre: tuple[float, float], size: float) -> dict[str, Any]:
    return {"centre": centre} if max(map(abs, centre)) > _SAME * size else {}


def _rectangle(loop: Loop) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Width and height, and the centre, of a loop whose four sides run along the axes."""
    if len(loop) != 4 or any(bulge for _, _, bulge in loop):
        return None
    xs, ys = ([corner[axis] for corner in loop] for axis in (0, 1))
    low, high = (min(xs), min(ys)), (max(xs), max(ys))
    same = _SAME * max(high[0] - low[0], high[1] - low[1])
    if any(
        min(abs(v - a), abs(v - b)) > same for vs, a, b in zip((xs, ys), low, high, strict=True) for v in vs
    ):
        return None
    if any(abs(a[0] - b[0]) > same and abs(a[1] - b[1]) > same for a, b in pairwise(loop)):
        return None
    width, height = high[0] - low[0], high[1] - low[1]
    return (width, height), ((low[0] + high[0]) / 2, (low[1] + high[1]) / 2)


@dataclass(frozen=True)
class LoopSyntax:
    """How a language writes a loop: patterns around a variable; `moved` comes before, {} is the centre."""

    moved: str
    circle: str
    rectangle: str
    corners: str


SCAD = LoopSyntax("translate({}) ", "circle(r = {});", "square({}, center = true);", "polygon(loop({}));")
BUILD123D = LoopSyntax("bd.Pos(*{}) * ", "bd.Circle({})", "bd.Rectangle(*{})", "loop(*{})")


def loops(field: Swept, names: dict[str, str], syntax: LoopSyntax) -> Iterator[str]:
    """An expression for each loop of the field; names: parameter -> variable."""
    for name in _names(field.profile):
        centre = names.get(f"{name}_centre")
        moved = syntax.moved.format(centre) if centre else ""
        if f"{name}_radius" in names:
            yield moved + syntax.circle.format(names[f"{name}_radius"])
        elif f"{name}_size" in names:
            yield moved + syntax.rectangle.format(names[f"{name}_size"])
        else:
            yield syntax.corners.format(names[name])


def draws_loops(fields: list[Swept]) -> bool:
    """Whether any of them has a loop that is given by its corners."""
    return any(
        name in ("outline", "hole") or name[5:].isdigit() for f in fields for name in swept_parameters(f)
    )
