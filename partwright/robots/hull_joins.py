"""Hulls of a link joined in pairs until there are as many as may be, where others overlap them least."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from partwright.meshing.hulls import hull_volume
from partwright.robots.enclosed_link import EnclosedLink, Hull

_BESIDE = 100  # times volume that overlaps another link counts, beside volume that is merely more


def join_hulls(link: EnclosedLink, others: Sequence[Hull], most: int) -> None:
    """Takes one hull for two of a link, the pair first that adds least, until there are no more than may be.

    others: hulls of other links. Native solids stay, even if there are too many.
    """
    heap: list[tuple[float, int, Hull, Hull, Hull | None]] = []
    number = 0

    def offer(one: Hull, other: Hull, both: Hull | None = None) -> None:
        nonlocal number
        if one.fixed or other.fixed:
            return
        number += 1
        if both is None:  # it costs no less: both have all that the two share with others
            cost = hull_volume(np.concatenate([one.corners, other.corners])) - one.volume - other.volume
        else:
            common = Hull(one.solid ^ other.solid)  # which the two have once
            shared = sum(
                both.shares(hull) + common.shares(hull) - one.shares(hull) - other.shares(hull)
                for hull in others
            )
            cost = both.volume - one.volume - other.volume + _BESIDE * shared
        heapq.heappush(heap, (cost, number, one, other, both))

    if len(link.hulls) > most:
        for one, other in combinations(link.hulls, 2):
            offer(one, other)
    while len(link.hulls) > most and heap:
        _, _, one, other, both = heapq.heappop(heap)
        left = link.hulls
        if one not in left or other not in left:
            continue
        if both is None:
            offer(one, other, link.both(one, other))
            continue
        link.join(one, other, both)
        for each in link.hulls:
            if each is not both:
                offer(each, both)
