"""Pieces of a solid joined again where that costs little, and cut elsewhere instead where that saves more.

What joining costs is the volume that the hull of both adds to their own hulls.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from partwright.approximation.convex_piece import Limits, Piece
from partwright.meshing.hulls import hull_volume

_SAVED = 1.6e-3  # of what the hulls of whole bodies would add: what one piece more has to save
_MANY = 24  # beyond so many pieces each has to, whatever the deviation is
_ROOM = 0.05  # of both: how far apart the boxes of two may lie that are joined
_EXCHANGES = 24  # pieces that are tried to be cut once there are as many as may be


def joined(pieces: Sequence[Piece], volume: float, bridged: float, limits: Limits) -> list[Piece]:
    """Pieces joined in pairs, the cheapest pair first, as long as the limits are kept or there are too
    many.

    volume: of the solid. bridged: what the hulls of its whole bodies would add, which is what pieces save."""
    alive = dict(enumerate(pieces))
    total = sum(piece.extra for piece in pieces)
    heap: list[tuple[float, int, int]] = []

    def price(i: int, j: int) -> None:
        cost = _cost(alive[i], alive[j])
        if np.isfinite(cost):
            heapq.heappush(heap, (cost, i, j))

    for i in alive:
        for j in range(i):
            price(i, j)
    number = len(alive)
    while heap and len(alive) > 1:
        cost, i, j = heapq.heappop(heap)
        if i not in alive or j not in alive:
            continue
        dear = limits.worth is not None and len(alive) > _MANY and cost < _price(bridged, len(alive))
        forced = dear or len(alive) > limits.most
        both = _both(alive[i], alive[j])
        if not forced:
            if total + cost > limits.extra * volume:
                break
            if not both.within(limits.deviation):
                continue
        total += max(cost, 0.0)
        del alive[i], alive[j]
        alive[number] = both
        for other in [key for key in alive if key != number]:
            price(number, other)
        number += 1
    return list(alive.values())


def spent(
    pieces: Sequence[Piece], bridged: float, limits: Limits, cut: Callable[[Piece], list[Piece]]
) -> list[Piece]:
    """More pieces, as many as may be: those that add most are cut as long as that is worth it."""
    pieces = list(pieces)
    if limits.worth is None:
        return pieces
    kept: set[Piece] = set()
    while len(pieces) < limits.most:
        total = sum(piece.extra for piece in pieces)
        least = max(limits.worth * total / len(pieces), _price(bridged, len(pieces)))
        left = [piece for piece in pieces if piece not in kept and piece.extra > least]
        if not left:
            break
        worst = max(left, key=lambda piece: piece.extra)
        parts = cut(worst)
        more = len(parts) - 1
        gain = worst.extra - sum(part.extra for part in parts)
        if more < 1 or gain < more * least or len(pieces) + more > limits.most:
            kept.add(worst)
            continue
        pieces = [*(piece for piece in pieces if piece is not worst), *parts]
    return pieces


def exchanged(pieces: Sequence[Piece], limits: Limits, cut: Callable[[Piece], list[Piece]]) -> list[Piece]:
    """As many pieces, where there are as many as may be: the worst is cut in two, and two others are joined,
    as long as that adds less."""
    pieces = list(pieces)
    if len(pieces) < limits.most:
        return pieces
    costs: dict[frozenset[Piece], float] = {}
    kept: set[Piece] = set()
    for _ in range(_EXCHANGES):
        worst = max((piece for piece in pieces if piece not in kept), key=lambda one: one.extra, default=None)
        if worst is None:
            break
        parts = cut(worst)
        gain = worst.extra - sum(part.extra for part in parts)
        left = [*(piece for piece in pieces if piece is not worst), *parts]
        pairs = [pair for pair in combinations(left, 2) if not set(pair) <= set(parts)]
        for pair in pairs:
            if frozenset(pair) not in costs:
                costs[frozenset(pair)] = _cost(*pair)
        cheapest = min(pairs, key=lambda pair: costs[frozenset(pair)], default=None)
        if len(parts) != 2 or cheapest is None or costs[frozenset(cheapest)] >= gain:
            kept.add(worst)
            continue
        pieces = [*(piece for piece in left if piece not in cheapest), _both(*cheapest)]
    return pieces


def _price(bridged: float, pieces: int) -> float:
    """Volume that one piece more has to save. Beyond many each costs more than the one before it: engines try
    every piece of one body with those of another."""
    return _SAVED * bridged * max(1.0, pieces / _MANY)


def _both(a: Piece, b: Piece) -> Piece:
    from manifold3d import Manifold, OpType

    return Piece(Manifold.batch_boolean([a.solid, b.solid], OpType.Add))


def _cost(a: Piece, b: Piece) -> float:
    """Volume that the hull of both adds; infinite for those that lie apart."""
    if not boxes_touch(a.box, b.box, _ROOM):
        return np.inf
    both = hull_volume(np.concatenate([a.hull_corners, b.hull_corners]))
    return both - a.hull.volume() - b.hull.volume()


def boxes_touch(a: np.ndarray, b: np.ndarray, share: float = 0.0) -> bool:
    """Whether two boxes (2, 3), lower and upper corners, touch, with room to spare: a share of the longest
    side of both together."""
    reach = np.maximum(a[1], b[1]) - np.minimum(a[0], b[0])
    gap = np.maximum(a[0], b[0]) - np.minimum(a[1], b[1])
    return bool(gap.max() <= share * reach.max())
