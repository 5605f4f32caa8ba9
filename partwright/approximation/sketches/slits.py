"""Outlines that run along themselves: slits and necks without width, where two pieces of a section touch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from manifold3d import CrossSection, JoinType

from partwright.fields.profile import Loop, Profile
from partwright.rows import lengths

TOUCHING = 2e-5
"""Unit lengths: what is nearer touches."""
_MITRE = 4.0


def touches_itself(loops: Sequence[Loop], within: float) -> bool:
    """Whether a corner lies nearer to a side than that which neither begins nor ends there."""
    corners = np.concatenate([np.array(loop)[:, :2] for loop in loops])
    starts = np.cumsum([0, *map(len, loops)])
    for loop, first in zip(loops, starts[:-1].tolist(), strict=True):
        count = len(loop)
        for i, (x, y, bulge) in enumerate(loop):
            u, v = loop[(i + 1) % count][:2]
            away = np.ones(len(corners), bool)
            away[[first + i, first + (i + 1) % count]] = False
            if away.any() and _nearest(np.array([x, y]), np.array([u, v]), bulge, corners[away]) < within:
                return True
    return False


def _nearest(start: np.ndarray, end: np.ndarray, bulge: float, points: np.ndarray) -> float:
    """Of points (N, 2) to a side."""
    if bulge:
        half = (end - start) / 2
        centre = (start + end) / 2 + (1 - bulge**2) / (2 * bulge) * np.array([-half[1], half[0]])
        radius = float(np.linalg.norm(start - centre))
        middle = (start + end) / 2 + bulge * np.array([half[1], -half[0]]) - centre
        off = points - centre
        reach = lengths(off)
        within = off @ middle >= reach * radius * np.cos(2 * np.arctan(abs(bulge)))
        return float(np.abs(reach - radius)[within].min(initial=np.inf))
    way = end - start
    share = np.clip((points - start) @ way / (way @ way), 0, 1)
    return float(lengths(points - start - share[:, None] * way).min())


def without_slits(section: CrossSection, width: float) -> Iterator[CrossSection]:
    """The largest piece of a section with slits closed that are narrower than twice a width; then with necks
    that are as narrow cut, too."""
    filled = section.offset(width, JoinType.Miter, _MITRE).offset(-width, JoinType.Miter, _MITRE)
    cut = filled.offset(-width, JoinType.Miter, _MITRE).offset(width, JoinType.Miter, _MITRE)
    for mended in (filled, cut):
        yield max(mended.decompose(), key=lambda piece: piece.area(), default=mended)


def section_of(profile: Profile, chord: float) -> CrossSection:
    """A profile by chords that lie so near to its arcs."""
    return CrossSection([np.asarray(line) for line in profile.polylines(chord)])
