"""Pipes as GLSL functions: their paths piece by piece, by the formulas of pipe.glsl."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from partwright.assembly import Part
from partwright.export.identifiers import comment
from partwright.fields import Pipe
from partwright.fields.bent_path import Bend, Run

Numbers = Callable[[Sequence[float]], str]
_NEAR = 4e-6  # of the path's length and place: float32 has no finer feet
_NO_BORE = -1e9


def pipe_function(name: str, part: Part, numbers: Numbers) -> list[str]:
    """The lines of `float name_sdf(vec3 p)`; numbers: literals of a row."""
    field = part.field
    assert isinstance(field, Pipe)

    def vector(values: np.ndarray | Sequence[float]) -> str:
        row = np.asarray(values).tolist()
        return f"vec{len(row)}({numbers(row)})"

    near = numbers([_NEAR * (field.length + float(np.abs(field.corners[:, :3]).max()))])
    w, x, y, z = part.rotation
    radii = vector((field.radius, field.bore or _NO_BORE))
    ends = (f"pipe_end(v, {vector(place)}, {vector(out)}, {radii})" for place, out in field.ends)
    return [
        f"float {name}_sdf(vec3 p) {{  // {comment(part.name)}",
        f"    vec3 v = into_frame(p, {vector(part.translation)}, {vector((x, y, z, w))});",
        "    float square = 1e30;",
        *(f"    {_piece(piece, near, vector, numbers)}" for piece in field.pieces),
        f"    return pipe(square, {radii}, {', '.join(ends)});",
        "}",
        "",
    ]


def _piece(piece: Run | Bend, near: str, vector: Callable[[np.ndarray], str], numbers: Numbers) -> str:
    if isinstance(piece, Run):
        way = (piece.end - piece.start) / piece.length
        return (
            f"pipe_run(v, {vector(piece.start)}, {vector(way)}, {numbers([piece.length])}, {near}, square);"
        )
    turn = np.array([piece.radius, math.cos(piece.angle), math.sin(piece.angle)])
    axes = ", ".join(map(vector, (piece.centre, piece.outwards, piece.along, turn)))
    return f"pipe_bend(v, {axes}, {near}, square);"
