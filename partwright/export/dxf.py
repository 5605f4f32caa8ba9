"""DXF (R12): the profiles of extrusions, revolutions, boxes, cylinders and tubes, a layer a part, for laser
cutters and sketches in CAD programs. Lines and arcs are exact; circles are circles."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from partwright.assembly import Assembly
from partwright.atomic_io import write_bytes
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import identifiers
from partwright.export.profile_drawing import drawn_profiles
from partwright.fields.profile import Loop, circle_of
from partwright.shapes import canonical_unit

# What $INSUNITS calls the units; 0 is none.
_UNITS = {"um": 13, "mm": 4, "cm": 5, "m": 6, "km": 7, "in": 1, "ft": 2}

Pairs = Iterator[tuple[int, Any]]


def write(assembly: Assembly, path: str | Path) -> None:
    """Write the drawing.

    Raises:
        UnsupportedFormatError: no part has a profile.
        OutputError: the file cannot be written.
    """
    lines = (f"{code:>3}\n{_text(value)}\n" for code, value in _drawing(assembly))
    write_bytes(path, "".join(lines).encode("ascii"))


def _drawing(assembly: Assembly) -> Pairs:
    drawn = drawn_profiles(assembly, "DXF")
    layers = [name.upper() for name in identifiers([one.name for one in drawn])]
    unit = _UNITS[canonical_unit(assembly.unit)] if assembly.unit else 0
    yield from [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009")]
    yield from [(9, "$INSUNITS"), (70, unit), (0, "ENDSEC")]
    yield from [(0, "SECTION"), (2, "TABLES"), (0, "TABLE"), (2, "LAYER"), (70, len(layers))]
    for layer in layers:
        yield from [(0, "LAYER"), (2, layer), (70, 0), (62, 7), (6, "CONTINUOUS")]
    yield from [(0, "ENDTAB"), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")]
    for layer, one in zip(layers, drawn, strict=True):
        for loop in one.profile.loops:
            yield from _loop(loop, layer)
    yield from [(0, "ENDSEC"), (0, "EOF")]


def _loop(loop: Loop, layer: str) -> Pairs:
    found = circle_of(loop)
    if found is not None:
        radius, (x, y) = found
        yield from [(0, "CIRCLE"), (8, layer), (10, x), (20, y), (40, radius)]
        return
    yield from [(0, "POLYLINE"), (8, layer), (66, 1), (10, 0.0), (20, 0.0), (70, 1)]
    for x, y, bulge in loop:
        yield from [(0, "VERTEX"), (8, layer), (10, x), (20, y), *([(42, bulge)] if bulge else [])]
    yield from [(0, "SEQEND"), (8, layer)]


def _text(value: Any) -> str:
    return repr(value + 0.0) if isinstance(value, float) else str(value)


FORMAT = Format(
    "DXF", write, frozenset({Holds.NAMES, Holds.COPIES, Holds.EXACT}), units=tuple(_UNITS), profiles=True
)
"""Copies are one drawing: what is cut so many times is drawn once."""
