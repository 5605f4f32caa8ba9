"""SVG: the profiles of extrusions, revolutions, boxes, cylinders and tubes, a path a part, at true
size."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

from partwright.assembly import Assembly
from partwright.atomic_io import write_bytes
from partwright.export.formats import Format, Holds
from partwright.export.profile_drawing import Drawn, drawn_profiles
from partwright.fields.profile import Side
from partwright.shapes import METRES, canonical_unit

_MARGIN = 0.02  # of the longer side
_LINE = 1.5  # pixels


def write(assembly: Assembly, path: str | Path) -> None:
    """Write the drawing; y points up, as in the profiles.

    Raises:
        UnsupportedFormatError: no part has a profile.
        OutputError: the file cannot be written.
    """
    drawn = drawn_profiles(assembly, "SVG")
    boxes = [one.profile.bounds() for one in drawn]
    low = [min(box[0][axis] for box in boxes) for axis in (0, 1)]
    high = [max(box[1][axis] for box in boxes) for axis in (0, 1)]
    margin = _MARGIN * max(high[0] - low[0], high[1] - low[1])
    left, top = low[0] - margin, -high[1] - margin
    width, height = (high[axis] - low[axis] + 2 * margin for axis in (0, 1))
    millimetres = METRES[canonical_unit(assembly.unit)] * 1e3 if assembly.unit else 1.0
    size = f'width="{_n(width * millimetres)}mm" height="{_n(height * millimetres)}mm"'
    view = " ".join(map(_n, (left, top, width, height)))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="{view}">',
        f"<title>{escape(assembly.name or 'Profiles')}</title>",
        '<g fill="none" stroke="black" vector-effect="non-scaling-stroke" transform="scale(1 -1)">',
        *(_path(one) for one in drawn),
        "</g>",
        "</svg>",
    ]
    write_bytes(path, ("\n".join(lines) + "\n").encode())


def _path(one: Drawn) -> str:
    data = " ".join(text for sides in one.profile.sides for text in _loop(sides))
    style = f'stroke-width="{_LINE}" vector-effect="non-scaling-stroke"'
    return (
        f"<path id={quoteattr(one.name)} {style} d={quoteattr(data)}><title>{escape(one.name)}</title></path>"
    )


def _loop(sides: tuple[Side, ...]) -> Iterator[str]:
    yield f"M {_n(sides[0].start[0])} {_n(sides[0].start[1])}"
    for side in sides:
        end = f"{_n(side.end[0])} {_n(side.end[1])}"
        if side.centre is None:
            yield f"L {end}"
        else:
            large, ahead = int(abs(side.bulge) > 1), int(side.bulge > 0)
            yield f"A {_n(side.radius)} {_n(side.radius)} 0 {large} {ahead} {end}"
    yield "Z"


def _n(value: float) -> str:
    return f"{value + 0.0:.12g}"


FORMAT = Format("SVG", write, frozenset({Holds.NAMES, Holds.COPIES, Holds.EXACT}), profiles=True)
