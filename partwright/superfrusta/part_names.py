"""Names that say what a part is and where: `rod_front_left`, `ring_upper`, `hole_right` for what is cut."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from partwright.assembly import Similarity
from partwright.assembly.names import unique_names
from partwright.fields.columns import Column
from partwright.metrics.deviation import place_name
from partwright.superfrusta.part_surfaces import surface_points
from partwright.superfrusta.samples import Rows

_ROUND = 0.6  # of the section's corners, from which on it is called round
_SQUARE = 1.5  # times that sides may differ and still be alike
_FLAT = 0.4  # times the next longer side
_LONG = 2.0  # times the next shorter side
_POINTED = 0.3  # of the wider end
_BENT = 0.3  # of half a turn
_BALL = 0.55  # of the half-sides is dilation


def part_names(
    rows: Rows,
    sides: np.ndarray,
    up: str | None,
    fixed: Sequence[str] = (),
    moves: Sequence[tuple[Similarity, ...]] = (),
) -> list[str]:
    """Names of rows (M, 17) in the unit frame, of which the first have the fixed ones; none twice.

    sides: (3,) of the shape's bounding box, unit lengths. up: its up axis, z if None. moves: those of each
    part's further copies, if any.
    """
    wanted = []
    for i in range(len(fixed), len(rows)):
        copies = moves[i] if moves else ()
        middle = _middle(rows[i])[None]
        places = [
            place_name(place, sides, up) for place in [middle[0], *(move(middle)[0] for move in copies)]
        ]
        wanted.append(f"{form(rows[i])}_{_shared(places).replace(' ', '_')}")
    return unique_names([*fixed, *wanted], ["part"] * len(rows))


def _shared(places: Sequence[str]) -> str:
    """What the places of a part's copies have in common, in words."""
    others = [set(place.split()) for place in places[1:]]
    shared = " ".join(word for word in places[0].split() if all(word in other for other in others))
    return shared or ("both sides" if len(places) == 2 else "all around")


def form(row: np.ndarray) -> str:
    """What a person would call the part (17,), by its proportions."""
    sx, sy, sz = (float(row[c]) for c in (Column.SX, Column.SY, Column.SZ))
    taper, dilation = float(row[Column.TAPER]), float(row[Column.DILATION])
    widest = max(1.0, taper)
    half = widest * min(sx, sy) / 2
    hollow = half * float(row[Column.ONION]) > dilation
    width, depth, height = (2 * dilation + side for side in (widest * sx, widest * sy, sz))
    low, middle, high = sorted((width, depth, height))
    section = max(width, depth) < _SQUARE * min(width, depth)
    smooth = float(row[Column.ROUNDNESS]) > _ROUND or 2 * dilation > _BALL * min(width, depth)
    if row[Column.SIGN] < 0:
        return "hole" if smooth and section and not hollow else "cut"
    if hollow:
        return "tube" if height > max(width, depth) else "ring"
    if row[Column.BULGE] > _BENT and height > min(width, depth):
        return "arc"
    if 2 * dilation > _BALL * high and high < _SQUARE * low:
        return "ball"
    if low < _FLAT * middle:
        return "disc" if low == height and smooth and section else "plate"
    if min(1.0, taper) < _POINTED * widest and height > _FLAT * half:
        return "cone" if smooth and section else "wedge"
    if high > _LONG * middle:
        return "rod" if high == height and smooth and section else "bar"
    return "drum" if smooth and section else "block"


def _middle(row: np.ndarray) -> np.ndarray:
    """The middle (3,) of the part's material: a bent part's lies off its frame's origin."""
    points = surface_points(row[None])[0]
    return np.asarray(0.5 * (points.min(axis=0) + points.max(axis=0)))
