"""Enclosing hulls of neighbouring links held apart, as far as what they contain lets them.

Where hulls of two links overlap, a plane between what each of them alone contains cuts both. Where there is
no such plane, as what one contains goes around the other, it is split in two or four. A link that has more
hulls than may be then has the two joined that overlap least for it, until it has as many. Nothing that was
contained is let go: what is cut off contains nothing, and the sides of a split reach a little beyond what
they have of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, product

import numpy as np

from partwright.approximation.piece_joining import boxes_touch
from partwright.robots.enclosed_link import EnclosedLink, Hull
from partwright.robots.hull_joins import join_hulls
from partwright.robots.hull_splits import best_sides, overlap
from partwright.robots.overlaps import LEAST_SHARED, Pair

_SHARE = 0.4  # of the gap between what two hulls contain: how far each reaches into it
_LESS = 0.95  # of the overlap that no plane prevents: a split has to leave less
_WORTH = 3e-5  # of the smaller link's volume: by how much each hull more has to make the overlap less
_PAYS = 0.015  # of what both share beyond what they may: likewise
_CHEAPER = 0.5  # of these, when splits were given up for them: where they fall so far all are tried again
_FURTHER = 4  # times these: overlaps for which four sides are tried where two save nothing
_AHEAD = 2  # times as many hulls as may be are made by splits, and joined in the end


def keep_apart(links: Mapping[str, EnclosedLink], allowed: Mapping[Pair, float], most: int) -> None:
    """Changes the hulls of links that overlap more than they may, as far as that makes the overlap less.

    allowed: volume that the two of a pair may have in common; none where it is not given. most: hulls a link.
    """
    pairs = [
        _Pair(a, b, allowed.get((name, other), 0.0))
        for (name, a), (other, b) in combinations(links.items(), 2)
        if boxes_touch(a.box, b.box)
    ]

    def excess(link: EnclosedLink) -> float:
        return sum(pair.excess() for pair in pairs if link in (pair.a, pair.b))

    for pair in pairs:
        pair.trim_hulls()
    before = {link: (excess(link), link.state()) for link in links.values()}
    for pair in pairs:
        pair.split_hulls(_AHEAD * most)
    for link in links.values():
        if len(link.hulls) > most:
            others = [hull for other in links.values() if other is not link for hull in other.hulls]
            join_hulls(link, others, most)
            for pair in pairs:
                if link in (pair.a, pair.b):
                    pair.trim_hulls()
            shared, state = before[link]
            if len(link.hulls) > most or excess(link) >= shared:
                link.restore(state)


@dataclass(frozen=True)
class _Split:
    """A hull, and the hulls of what is on either side of a plane, or of two, of all that only it contains.
    gain: volume by which what cannot be parted becomes less."""

    link: EnclosedLink
    hull: Hull
    sides: Sequence[Hull]
    gain: float

    @property
    def more(self) -> int:
        return len(self.sides) - 1


class _Pair:
    """Two links, and what they may share."""

    def __init__(self, a: EnclosedLink, b: EnclosedLink, allowed: float) -> None:
        self.a, self.b = a, b
        self._smaller = min(sum(hull.volume for hull in link.hulls) for link in (a, b))
        self._enough = allowed + LEAST_SHARED * self._smaller
        self._price = np.inf  # volume that each hull more has to take off what both share
        self._shares: dict[tuple[Hull, Hull], float] = {}
        self._last: tuple[tuple[Hull, ...], float] = (), 0.0  # hulls, and the volume that they share
        self._sides: dict[tuple[Hull, bool], tuple[float, Sequence[Hull]]] = {}

    def excess(self) -> float:
        """Volume that the links share beyond what they may."""
        return max(self._shared() - self._enough, 0.0)

    def trim_hulls(self) -> None:
        """Cuts what overlaps by planes between what is contained."""
        if self.excess() > 0:
            for one in self.a.hulls:
                for other in self.b.hulls:
                    one, _ = self._parted(one, other)

    def split_hulls(self, most: int) -> None:
        """Splits what overlaps most, as long as that makes it less by enough. most: hulls of a link."""
        left: set[tuple[Hull, Hull]] = set()
        given_up = np.inf
        shared = self._shared()
        while shared > self._enough:
            self._price = max(_WORTH * self._smaller, _PAYS * (shared - self._enough))
            overlaps = {pair: volume for pair, volume in self._overlaps().items() if volume > self._price}
            worst = max(
                (pair for pair in overlaps if pair not in left), key=overlaps.__getitem__, default=None
            )
            if worst is None:
                if self._price > _CHEAPER * given_up or not left:
                    return
                given_up = self._price
                left.clear()
                continue
            found = [self._best_split(link, hull) for link, hull in zip((self.a, self.b), worst, strict=True)]
            splits = [one for one in found if one and len(one.link.hulls) + one.more <= most]
            now = shared
            for split in sorted(splits, key=lambda one: -one.gain):
                if (now := self._done(split, shared)) < shared:
                    break
            if now == shared:
                left.add(worst)
            shared = now

    def _overlaps(self) -> dict[tuple[Hull, Hull], float]:
        """Volume that hulls share, of those that do."""
        self._shares = {
            pair: self._shares[pair] if pair in self._shares else pair[0].shares(pair[1])
            for pair in product(self.a.hulls, self.b.hulls)
        }
        return {pair: shared for pair, shared in self._shares.items() if shared > 0}

    def _shared(self) -> float:
        """Volume that the links share, measured again where their hulls are others."""
        hulls = *self.a.hulls, *self.b.hulls
        if self._last[0] != hulls:
            self._last = hulls, self._measured()
        return self._last[1]

    def _measured(self) -> float:
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
        found = _plane_between(self.a.core(one), self.b.core(other))
        if found is None:
            return one, other
        normal, stop, start = found
        reach = _SHARE * (start - stop)
        return (
            self.a.trim(one, normal, stop + max(reach, self.a.room)),
            self.b.trim(other, -normal, -start + max(reach, self.b.room)),
        )

    def _best_split(self, link: EnclosedLink, hull: Hull) -> _Split | None:
        """The split of a hull whose sides overlap least what the other link's hulls contain; None where
        none makes that much less."""
        from manifold3d import Manifold, OpType

        if hull.fixed:
            return None
        other = self.b if link is self.a else self.a
        met = [pair[1] if link is self.a else pair[0] for pair in self._overlaps() if hull in pair]
        kept_out = Manifold.batch_boolean([other.core(one).solid for one in met], OpType.Add)
        whole = link.core(hull)  # another one where what only this hull contains has changed
        before = overlap([whole], kept_out)
        if before <= self._price:
            return None
        further = before > _FURTHER * self._price
        tried, sides = self._sides.get((whole, further), (0.0, []))
        if not sides and before > tried:
            sides = best_sides(link.needed(hull), whole, kept_out, _LESS * before, further=further)
            self._sides[whole, further] = before, sides
        if not sides or any(side.solid.is_empty() for side in sides):
            return None
        split = _Split(link, hull, sides, before - overlap(sides, kept_out))
        return split if split.gain > max((1 - _LESS) * before, split.more * self._price) else None

    def _done(self, split: _Split, shared: float) -> float:
        """What both links share once a split is done; as much as before, where that would be no less by more
        than it costs and so is not done."""
        kept = [link.state() for link in (self.a, self.b)]
        for side in split.link.split(split.hull, split.sides):
            for other in (self.b if split.link is self.a else self.a).hulls:
                if split.link is self.a:
                    side, _ = self._parted(side, other)
                else:
                    _, side = self._parted(other, side)
        now = self._shared()
        if shared - now > split.more * self._price:
            return now
        for link, state in zip((self.a, self.b), kept, strict=True):
            link.restore(state)
        return shared


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
