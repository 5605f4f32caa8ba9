"""Planes between pieces of a solid, moved to where the hulls on both sides add less.

Pieces come from cuts in halves: a ring in wedges of half and a quarter of a right angle. What their hulls add
grows with the third power of the angle, so as many alike add less.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from partwright.approximation.convex_piece import Piece
from partwright.approximation.cutting_planes import Corners, Plane, moved
from partwright.approximation.hull_faces import faces_of
from partwright.approximation.piece_joining import boxes_touch

_ROUNDS = 4  # of all pairs of pieces
_WORTH = 1e-4  # of the solid's volume: what a moved plane has to save, and
_SHARE = 0.03  # of what the two hulls add
_TOUCHING = 1e-9  # of the size of both: how far apart pieces may be that touch


def with_moved_boundaries(pieces: Sequence[Piece], volume: float) -> list[Piece]:
    """As many pieces of the same solid, of this volume, whose hulls add less, as far as planes between two of
    them moved by themselves make it less."""
    pieces, settled = list(pieces), set()
    for _ in range(_ROUNDS):
        pairs = sorted(combinations(pieces, 2), key=lambda pair: -pair[0].extra - pair[1].extra)
        changed: set[Piece] = set()
        for one, other in pairs:
            before = one.extra + other.extra
            if before < _WORTH * volume:
                break
            if {one, other} & changed or (one, other) in settled or not boxes_touch(one.box, other.box):
                continue
            settled.add((one, other))
            parts = _divided_anew(one, other)
            if before - sum(part.extra for part in parts) > max(_WORTH * volume, _SHARE * before):
                changed |= {one, other}
                pieces = [*(piece for piece in pieces if piece not in (one, other)), *parts]
        if not changed:
            break
    return pieces


def _divided_anew(one: Piece, other: Piece) -> list[Piece]:
    """Two pieces divided by the plane between them, moved to where that is best; as they are where there is
    no such plane."""
    from manifold3d import Manifold, OpType

    plane = _between(one, other)
    if plane is None:
        return [one, other]
    both = Manifold.batch_boolean([one.solid, other.solid], OpType.Add)
    normal, offset = moved(Corners.of(both), plane)
    halves = both.split_by_plane(tuple(normal.tolist()), float(offset))
    if any(half.is_empty() for half in halves):
        return [one, other]
    return [Piece(half) for half in halves]


def _between(one: Piece, other: Piece) -> Plane | None:
    """The plane in which two pieces touch, that has each on one side; None where there is none."""
    for first, second in ((one, other), (other, one)):
        normals, offsets = faces_of(first.hull)
        gaps = (second.hull_corners @ normals.T).min(axis=0) - offsets
        best = int(gaps.argmax())
        if abs(gaps[best]) <= _TOUCHING * float(np.ptp([*one.box, *other.box], axis=0).max()):
            return normals[best], float(offsets[best])
    return None
