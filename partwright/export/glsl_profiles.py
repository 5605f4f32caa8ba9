"""Extrusions and revolutions as GLSL functions: their sides line by line, by the formulas of profile.glsl."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from partwright.assembly import Part
from partwright.export.identifiers import comment
from partwright.fields import Extrusion, Revolution, Swept
from partwright.fields.profile import Side, arc_pieces

Numbers = Callable[[Sequence[float]], str]


def swept_function(name: str, part: Part, numbers: Numbers) -> list[str]:
    """The lines of `float name_sdf(vec3 p)` and of what it calls; numbers: literals of a row."""
    field = part.field
    assert isinstance(field, Swept)
    w, x, y, z = part.rotation
    pose = f"vec3({numbers(part.translation)}), vec4({numbers((x, y, z, w))})"
    head = [
        f"float {name}_sdf(vec3 p) {{  // {comment(part.name)}",
        f"    vec3 v = into_frame(p, {pose});",
    ]
    if isinstance(field, Extrusion):
        angle = math.radians(field.taper)
        lean = f"vec2({numbers((math.sin(angle), math.cos(angle)))})"
        at = f"v.z + {numbers([field.height / 2])}"
        if field.has_rims:
            rims = f"vec4({numbers([number for rim in field.rims for number in rim])})"
            call = f"extruded_with_rims({name}_profile(v.xy), {at}, {numbers([field.height])}, {rims})"
            return [*_profile(f"{name}_profile", field, numbers, True), *head, f"    return {call};", "}", ""]
        result = f"    return extruded({name}_profile(v.xy), {at}, {numbers([field.height])}, {lean});"
        return [*_profile(f"{name}_profile", field, numbers, True), *head, result, "}", ""]
    assert isinstance(field, Revolution)
    side = f"{name}_profile(vec2(length(v.xy), v.z))"
    functions = _profile(f"{name}_profile", field, numbers, False)
    if field.full:
        return [*functions, *head, f"    return {side};", "}", ""]
    end = math.radians(field.angle)
    c, s = numbers([math.cos(end)]), numbers([math.sin(end)])
    return [
        *functions,
        *_profile(f"{name}_end", field, numbers, True),
        *head,
        f"    vec2 first = vec2({name}_end(v.xz), v.y);",
        f"    vec2 last = vec2({name}_end(vec2({c} * v.x + {s} * v.y, v.z)), {c} * v.y - {s} * v.x);",
        f"    return turned_partly({side}, first, last, v.xy, {numbers([end])});",
        "}",
        "",
    ]


def _profile(name: str, field: Swept, numbers: Numbers, axis: bool) -> list[str]:
    """The signed distance to the profile; axis: whether sides on the axis of a revolution count."""
    sides = [side for loop in field.profile.sides for side in loop if axis or not _on_axis(side)]
    return [
        f"float {name}(vec2 p) {{",
        "    float square = 1e30;",
        "    bool inside = false;",
        *(f"    {line}" for side in sides for line in _side(side, numbers)),
        "    return inside ? -sqrt(square) : sqrt(square);",
        "}",
        "",
    ]


def _on_axis(side: Side) -> bool:
    return side.centre is None and side.start[0] == 0 and side.end[0] == 0


def _side(side: Side, numbers: Numbers) -> Iterator[str]:
    ends = f"vec2({numbers(side.start)}), vec2({numbers(side.end)})"
    if side.centre is None:
        yield f"profile_line(p, {ends}, square, inside);"
        return
    circle = f"vec2({numbers(side.centre)}), {numbers([side.radius])}"
    (x, y), (cx, cy) = side.middle, side.centre
    middle = ((x - cx) / side.radius, (y - cy) / side.radius, math.cos(side.sweep / 2))
    yield f"profile_arc(p, {ends}, {circle}, vec3({numbers(middle)}), square);"
    for low, high, right in arc_pieces(side):
        yield f"profile_piece(p, vec2({numbers((low, high))}), {circle}, {str(right).lower()}, inside);"
