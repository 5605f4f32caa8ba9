"""Enclosing hulls of neighbouring links held apart, as far as what they contain lets them.

Where hulls of two links overlap, a plane between what each of them alone contains cuts both. Where there is
no such plane, as what one contains goes around the other, it is split in two or four; at the limit of their
number two others of its link become one for it. Nothing that was contained is let go: what is cut off
contains nothing, and the sides of a split reach a little beyond what they have of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from partwright.approximation.piece_joining import boxes_touch
from partwright.meshing.hulls import hull_volume
from partwright.robots.enclosed_link import EnclosedLink, Hull, State
from partwright.robots.hull_splits import best_sides, overlap
from partwright.robots.overlaps import LEAST_SHARED, Pair

_SHARE = 0.4  # of the gap between what two hulls contain: how far each reaches into it
_LESS = 0.95  # of the overlap that no plane prevents: a split has to leave less
_WORTH = 3e-5  # of the smaller link's volume: by how much each hull more has to make the overlap less
_PAYS = 0.015  # of what both share beyond what they may: likewise
_AHEAD = 4  # times that: overlaps for which four sides are tried where two save nothing
_BESIDE = 100  # times volume that overlaps another link counts, beside volume that is merely more
_JOINED = 8  # pairs of hulls, those that add least, that are tried to be joined


def keep_apart(links: Mapping[str, EnclosedLink], allowed: Mapping[Pair, float], most: int) -> None:
    """Changes the hulls of links that overlap more than they may, as far as that makes the overlap less.

    allowed: volume that the two of a pair may have in common; none where it is not given. most: hulls a link.
    """
    for pair in combinations(links, 2):
        first, second = (links[name] for name in pair)
        if not boxes_touch(first.box, second.box):
            continue
        beside = [link for name, link in links.items() if name not in pair]
        _Pair(first, second, allowed.get(pair, 0.0), most, beside).keep_apart()


@dataclass(frozen=True)
class _Split:
    """A hull, and the hulls of what is on either side of a plane, or of two, of all that only it contains.
    gain: volume by which what cannot be parted becomes less."""

    link: EnclosedLink
    hull: Hull
    sides: Sequence[Hull]
    gain: float


@dataclass(frozen=True)
class _Join:
    """Two hulls of a link, and one around both. cost: the volume that it adds, in that which links share."""

    hulls: tuple[Hull, Hull]
    both: Hull
    cost: float


class _Pair:
    """Two links, and what they may share."""

    def __init__(
        self, a: EnclosedLink, b: EnclosedLink, allowed: float, most: int, beside: Sequence[EnclosedLink]
    ) -> None:
        self._a, self._b, self._most, self._beside = a, b, most, beside
        self._smaller = min(sum(hull.volume for hull in link.hulls) for link in (a, b))
        self._enough = allowed + LEAST_SHARED * self._smaller
        self._price = np.inf  # volume that each hull more has to take off what both share
        self._shares: dict[tuple[Hull, Hull], float] = {}
        self._splits: dict[tuple[Hull, frozenset[Hull]], _Split | None] = {}

    def keep_apart(self) -> None:
        if self._shared() <= self._enough:
            return
        for one in self._a.hulls:
            for other in self._b.hulls:
                one, _ = self._parted(one, other)
        left: set[tuple[Hull, Hull]] = set()
        shared = self._shared()
        while shared > self._enough:
            price = max(_WORTH * self._smaller, _PAYS * (shared - self._enough))
            if price < self._price / 2:
                self._price = price
                self._splits.clear()
                left.clear()
            overlaps = {pair: most for pair, most in self._overlaps().items() if most > self._price}
            worst = max(
                (pair for pair in overlaps if pair not in left), key=overlaps.__getitem__, default=None
            )
            if worst is None:
                return
            splits = [self._best_split(self._a, worst[0]), self._best_split(self._b, worst[1])]
            now = shared
            for split in sorted(filter(None, splits), key=lambda split: -split.gain):
                if (now := self._done(split, shared)) < shared:
                    break
            if now == shared:
                left.add(worst)
            shared = now

    def _overlaps(self) -> dict[tuple[Hull, Hull], float]:
        """Volume that hulls share, of those that do."""
        self._shares = {
            pair: self._shares[pair] if pair in self._shares else pair[0].shares(pair[1])
            for pair in product(self._a.hulls, self._b.hulls)
        }
        return {pair: shared for pair, shared in self._shares.items() if shared > 0}

    def _shared(self) -> float:
        """Volume that the links share."""
        from manifold3d import Manifold, OpType

        overlaps = self._overlaps()
        if sum(overlaps.values()) <= self._enough:
            return sum(overlaps.values())
        one, other = (
            Manifold.batch_boolean([hull.solid for hull in dict.fromkeys(hulls)], OpType.Add)
            for hulls in zip(*overlaps, strict=True)
        )
        return float((one ^ other).volume())

    def _parted(self, one: Hull, other: Hull) -> tuple[Hull, Hull]:
        """Hulls of the first link and of the second, each cut by a plane between what they contain, or as
        near to that as may be. Native solids stay."""
        if one.fixed or other.fixed or one.shares(other) <= 0:
            return one, other
        found = _plane_between(self._a.core(one), self._b.core(other))
        if found is None:
            return one, other
        normal, stop, start = found
        reach = _SHARE * (start - stop)
        return (
            self._a.trim(one, normal, stop + max(reach, self._a.room)),
            self._b.trim(other, -normal, -start + max(reach, self._b.room)),
        )

    def _best_split(self, link: EnclosedLink, hull: Hull) -> _Split | None:
        """The split of a hull whose sides overlap least what the other link's hulls contain; None where
        none makes that much less."""
        met = [(pair[1] if link is self._a else pair[0]) for pair in self._overlaps() if hull in pair]
        key = hull, frozenset(met)
        if key not in self._splits:
            self._splits[key] = None if hull.fixed else self._split(link, hull, met)
        return self._splits[key]

    def _split(self, link: EnclosedLink, hull: Hull, met: Sequence[Hull]) -> _Split | None:
        other = self._b if link is self._a else self._a
        whole = link.core(hull)
        kept_out = [core for one in met if whole.shares(core := other.core(one)) > 0]
        before = overlap([whole], kept_out)
        if before <= self._price:
            return None
        enough, further = min(_LESS * before, before - self._price), before > _AHEAD * self._price
        sides = best_sides(link.needed(hull), whole, kept_out, enough, further=further)
        if not sides or any(side.solid.is_empty() for side in sides):
            return None
        gain = before - overlap(sides, kept_out)
        worth = max((1 - _LESS) * before, (len(sides) - 1) * self._price)
        return _Split(link, hull, sides, gain) if gain > worth else None

    def _done(self, split: _Split, shared: float) -> float:
        """What both links share once a split is done; as much as before, where that would be no less by more
        than it costs and so is not done."""
        link = split.link
        kept = [each.state() for each in (self._a, self._b)]
        cost = (len(split.sides) - 1) * self._price
        for _ in range(len(link.hulls) + len(split.sides) - 1 - self._most):
            join = self._cheapest_join(link, split.hull, split.gain - cost)
            if join is None:
                self._restore(kept)
                return shared
            link.join(*join.hulls, join.both)
            cost += join.cost
        sides = link.split(split.hull, split.sides)
        for side in sides:
            for other in (self._b if link is self._a else self._a).hulls:
                if link is self._a:
                    side, _ = self._parted(side, other)
                else:
                    _, side = self._parted(other, side)
        now = self._shared()
        if shared - now > cost:
            return now
        self._restore(kept)
        return shared

    def _restore(self, states: Sequence[State]) -> None:
        for link, state in zip((self._a, self._b), states, strict=True):
            link.restore(state)

    def _cheapest_join(self, link: EnclosedLink, spared: Hull, gain: float) -> _Join | None:
        """Two hulls of a link, other than one, and one around both, that cost less than a split gains."""
        others = [
            hull for each in (self._a, self._b, *self._beside) if each is not link for hull in each.hulls
        ]
        found = []
        for one, other in combinations(link.hulls, 2):
            if spared in (one, other) or one.fixed or other.fixed or not boxes_touch(one.box, other.box):
                continue
            more = hull_volume(np.concatenate([one.corners, other.corners])) - one.volume - other.volume
            if more < _BESIDE * gain:
                found.append((more, one, other))
        for more, one, other in sorted(found, key=lambda entry: entry[0])[:_JOINED]:
            both = link.both(one, other)
            shared = sum(both.shares(hull) - one.shares(hull) - other.shares(hull) for hull in others)
            if more / _BESIDE + shared < gain:
                return _Join((one, other), both, more / _BESIDE + shared)
        return None


def _plane_between(ours: Hull, theirs: Hull) -> tuple[np.ndarray, float, float] | None:
    """Unit normal, and the offsets where the first ends along it and where the second begins: of the planes
    of both hulls' faces the one that leaves most between; None where either has no volume."""
    if ours.solid.is_empty() or theirs.solid.is_empty():
        return None
    normals = np.concatenate([ours.planes[0], -theirs.planes[0]])
    stop = (ours.corners @ normals.T).max(axis=0)
    start = (theirs.corners @ normals.T).min(axis=0)
    best = int((start - stop).argmax())
    return normals[best], float(stop[best]), float(start[best])
