"""A convex region of the plane, where half-planes and discs overlap, as a closed loop of lines and arcs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from partwright.fields.profile import Corner, Loop

_SAME = 1e-7  # of the region's size


class Disc(NamedTuple):
    x: float
    y: float
    radius: float


class _Piece(NamedTuple):
    """A stretch of the boundary, counter-clockwise."""

    start: np.ndarray
    middle: np.ndarray
    sweep: float


@dataclass(frozen=True)
class ConvexRegion:
    """normals (K, 2) of unit length and offsets (K,): normal . p <= offset; and discs."""

    normals: np.ndarray
    offsets: np.ndarray
    discs: tuple[Disc, ...]
    size: float

    def loop(self) -> Loop | None:
        """Its boundary, counter-clockwise; None where nothing, or nothing that ends, is inside."""
        pieces = [piece for k in range(len(self.normals)) for piece in self._of_line(k)]
        for k in range(len(self.discs)):
            pieces += self._of_disc(k)
        if len(pieces) < 2:
            return None
        centre = np.mean([piece.middle for piece in pieces], axis=0)
        pieces.sort(key=lambda piece: math.atan2(*(piece.middle - centre)[::-1]))
        corners: list[Corner] = []
        for piece, after in zip(pieces, [*pieces[1:], pieces[0]], strict=True):
            if math.dist(piece.start, after.start) <= 10 * _SAME * self.size:
                continue
            corners.append((*piece.start.tolist(), math.tan(piece.sweep / 4)))
        return tuple(corners) if len(corners) > 1 else None

    def _holds(self, points: np.ndarray, line: int = -1, disc: int = -1) -> np.ndarray:
        """(N,) whether points (N, 2) lie within all but one line or disc."""
        slack = _SAME * self.size
        off = points @ self.normals.T - self.offsets
        if line >= 0:
            off[:, line] = -np.inf
        inside = (off <= slack).all(axis=1)
        for k, (x, y, r) in enumerate(self.discs):
            if k != disc:
                inside &= np.hypot(points[:, 0] - x, points[:, 1] - y) <= r + slack
        return inside

    def _of_line(self, k: int) -> list[_Piece]:
        normal = self.normals[k]
        along, foot = np.array([-normal[1], normal[0]]), self.offsets[k] * normal
        cuts: list[float] = []
        for i, (other, offset) in enumerate(zip(self.normals, self.offsets, strict=True)):
            lean = float(other @ along)
            if i != k and abs(lean) > 1e-9:
                cuts.append(float(offset - other @ foot) / lean)
            elif i < k and other @ normal > 0 and abs(offset - self.offsets[k]) <= _SAME * self.size:
                return []  # the same line again
        for x, y, r in self.discs:
            off = np.array([x, y]) - foot
            reach = r * r - (off @ normal) ** 2
            if reach > 0:
                cuts += [float(off @ along) + s * math.sqrt(reach) for s in (-1, 1)]
        cuts.sort()
        kept = [
            (a, b)
            for a, b in pairwise(cuts)
            if b - a > _SAME * self.size and self._holds((foot + (a + b) / 2 * along)[None], line=k)[0]
        ]
        if not kept:
            return []
        first, last = kept[0][0], kept[-1][1]
        return [_Piece(foot + first * along, foot + (first + last) / 2 * along, 0.0)]

    def _of_disc(self, k: int) -> list[_Piece]:
        x, y, r = self.discs[k]
        centre = np.array([x, y])
        if any(
            i < k and math.dist(other, self.discs[k]) <= _SAME * self.size
            for i, other in enumerate(self.discs)
        ):
            return []
        cuts: list[float] = []
        for normal, offset in zip(self.normals, self.offsets, strict=True):
            height = float(offset - normal @ centre) / r
            if abs(height) < 1:
                middle, half = math.atan2(normal[1], normal[0]), math.acos(height)
                cuts += [middle - half, middle + half]
        for i, (ox, oy, other) in enumerate(self.discs):
            apart = math.hypot(ox - x, oy - y)
            if i != k and abs(r - other) < apart < r + other:
                middle = math.atan2(oy - y, ox - x)
                half = math.acos((apart**2 + r * r - other * other) / (2 * apart * r))
                cuts += [middle - half, middle + half]
        turns = sorted({round(cut % (2 * math.pi), 12) for cut in cuts})
        turns = (
            turns if len(turns) > 1 else [turns[0] if turns else 0.0, (turns[0] if turns else 0.0) + math.pi]
        )
        pieces = []
        for a, b in zip(turns, [*turns[1:], turns[0] + 2 * math.pi], strict=True):
            places = [centre + r * np.array([math.cos(t), math.sin(t)]) for t in (a, (a + b) / 2)]
            if (b - a) * r > _SAME * self.size and self._holds(places[1][None], disc=k)[0]:
                pieces.append(_Piece(places[0], places[1], b - a))
        return pieces
