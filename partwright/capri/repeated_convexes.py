"""Convexes that are one another's copies or mirror images: said once, and better for it (ours).

The search finds each tooth of a gear by itself, a little different from the others. Here a convex takes the
place of others by a motion, is put where the motions between its copies lead on, and is fitted to what all of
them have to cover, for the price of one. In the objective a copy costs as a primitive, and of what all else
costs two fifths count: by so much, less a whole primitive for each copy, the error may rise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.motion import Motion
from partwright.capri import quadric_rows as rows
from partwright.capri.csg_tree import Convex, Copy, CsgTree
from partwright.capri.fitted_copies import FittedCopies, error_reduction
from partwright.capri.motions import Face, axes_of, by_faces, by_middles, moved
from partwright.capri.samples import OccupancySamples

_CAUTION = 0.4  # share of the prices that counts: at all of them what differs would become copies
_COARSE = 6  # one sample of so many tells first which motion is best
_BY_FACES = 12  # motions between two convexes that are tried, those with most faces in common first
_SLACK = np.radians(np.linspace(-2.0, 2.0, 9))  # turns about an axis that are tried beside the middles' angle
_MAX_RATIO = 2.5  # of the weights that two convexes cover
_TAKEN_OVER = 0.6  # share of what a convex covers that a copy has to cover to replace it
_MAX_POWERS = 40  # times that a step is taken
_MAX_CHAINS = 400  # rows of steps that are tried
_SHORTEST = 8  # steps that lead on from each copy
_FURTHEST = 0.95  # unit lengths: the middle of a convex is no further out than that
_SAME_PLACE = 0.01  # unit lengths
_FORGIVEN = 0.6  # of what a convex costs: so much more error is allowed until all copies are fitted

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Group:
    """A convex by its rows of the table, the motions of its copies, and what it and each of them cover.

    offered: it stays only where it and its copies pay at the whole of the prices.
    """

    convex: Convex
    motions: tuple[Motion, ...] = ()
    masks: tuple[Mask, ...] = ()
    offered: bool = False


_Layers = list[list[_Group]]


def with_repeated_convexes(
    tree: CsgTree,
    samples: OccupancySamples,
    price: float,
    convex_price: float,
    pause: Callable[[], None] = lambda: None,
    further: bool = True,
    own: Sequence[int] | None = None,
) -> CsgTree:
    """The tree with alike convexes as copies of one, and `copies` that say so.

    price, convex_price: as in the settings. pause: called now and then, and may raise. further: copies also
    where the motions between others lead on, as where a tooth was missed. own: of each layer, how many
    convexes pay by themselves; those after them are offered, and stay where they pay with their copies, as
    the many holes of a vented wall do. All of them, if not given.
    """
    search = _Search(tree, samples, price, convex_price, pause, further, own)
    for at in range(len(tree.layers)):
        search.gather(at)
    search.extend()
    search.drop_unpaid()
    return search.tree()


class _Search:
    def __init__(
        self,
        tree: CsgTree,
        samples: OccupancySamples,
        price: float,
        convex_price: float,
        pause: Callable[[], None],
        further: bool,
        own: Sequence[int] | None = None,
    ) -> None:
        self.given, self.samples, self.pause, self.further = tree, samples, pause, further
        self.price, self.convex_price = (_CAUTION * p * samples.volume for p in (price, convex_price))
        self.fitting = FittedCopies(tree, samples, self.price, self.convex_price, pause)
        self.monomials = rows.monomials(samples.points)
        self.weight = samples.weight.astype(np.float64)
        self.layers: _Layers = [
            [
                _Group(c, masks=(self.covered(tree.rows[list(c)]),), offered=own is not None and i >= own[at])
                for i, c in enumerate(layer)
            ]
            for at, layer in enumerate(tree.layers)
        ]
        self.place_price = price * samples.volume
        used = sorted({k for layer in tree.layers for convex in layer for k in convex})
        self.axes = axes_of(tree.rows[used])

    def covered(self, table: NDArray[np.float64], step: int = 1) -> Mask:
        """What quadrics (K, 10) cover together, of one in `step` samples."""
        return np.asarray((self.monomials[::step] @ table.T <= 0).all(axis=1))

    def error(self, layers: _Layers) -> float:
        """Weight on the wrong side."""
        occupied = np.zeros(len(self.weight), dtype=bool)
        for k, layer in enumerate(layers):
            for group in layer:
                for mask in group.masks:
                    occupied[mask] = k % 2 == 0
        return float(self.weight[occupied != self.samples.inside].sum())

    def error_reduction(self, layers: _Layers, at: int) -> NDArray[np.float32]:
        """(N,) by how much the error falls where one more convex in layer `at` covers a sample."""
        return error_reduction(
            self.samples, [[m for group in layer for m in group.masks] for layer in layers], at
        )

    def length(self, group: _Group, factor: float = 1.0) -> float:
        """What a group costs, its copies, and at so many times the prices that count here all else."""
        convexes = 1 + int(self.given.complement[list(group.convex)].sum())
        places = self.place_price * len(group.motions)
        return places + factor * (self.price * len(group.convex) + self.convex_price * convexes)

    def cost(self, layers: _Layers) -> float:
        return self.error(layers) + sum(self.length(group) for layer in layers for group in layer)

    def gather(self, at: int) -> None:
        """Groups of one layer take in what is alike, the dearest first."""
        tried: set[_Group] = set()
        while True:
            left = [g for g in self.layers[at] if g not in tried and not g.motions]
            if not left:
                return
            root = max(left, key=lambda group: (self.length(group), float(self.weight[group.masks[0]].sum())))
            tried.add(root)
            before = self.cost(self.layers)
            for forgiven in (_FORGIVEN, 0.0):
                self.pause()
                layers, group = self.taken_in(self.layers, at, root, forgiven)
                if not group.motions:
                    break
                layers, group = self.extended(layers, at, group)
                layers, group = self.fitted(layers, at, group)
                if self.cost(layers) < before:
                    self.layers = self.without_idle(layers)
                    break

    def extend(self) -> None:
        """Further copies where a convex was that has become idle since, and none that is idle itself."""
        for at in range(len(self.layers)):
            for group in list(self.layers[at]):
                if group.motions:
                    self.pause()
                    self.layers, group = self.extended(self.layers, at, group)
                    self.layers = self.thinned(self.layers, at, group)

    def taken_in(self, layers: _Layers, at: int, group: _Group, forgiven: float) -> tuple[_Layers, _Group]:
        """Others of the layer replaced by copies of the group, where the error rises by less than they
        cost."""
        faces = self.faces(group)
        root = group
        for other in layers[at]:
            if other is root or other.motions or not self.may_replace(group, other):
                continue
            best = self.best_motion(layers, at, group, other, faces)
            if best is None:
                continue
            changed = _replaced(layers, at, {group, other}, best)
            allowed = forgiven * self.length(other)
            if self.cost(changed) < self.cost(layers) + allowed:
                layers, group = changed, best
        return layers, group

    def may_replace(self, group: _Group, other: _Group) -> bool:
        """Whether a copy can be cheaper than the other, and what they cover is of like weight."""
        one, two = (float(self.weight[g.masks[0]].sum()) for g in (group, other))
        return self.length(other) > self.place_price and max(one, two) < _MAX_RATIO * min(one, two)

    def best_motion(
        self, layers: _Layers, at: int, group: _Group, other: _Group, faces: list[Face]
    ) -> _Group | None:
        """The group with the copy that does best in the place of the other."""
        self.pause()
        candidates = by_faces(faces, self.faces(other), self.axes, _BY_FACES)
        middles = self.middle(group.masks[0]), self.middle(other.masks[0])
        candidates += by_middles(*middles, self.axes, _SLACK)
        if not candidates:
            return None
        reduction = self.error_reduction(_replaced(layers, at, {group, other}), at)[::_COARSE].astype(
            np.float64
        )
        reduction[np.any([mask[::_COARSE] for mask in group.masks], axis=0)] = 0.0
        table = self.given.rows[list(group.convex)]
        falls = [reduction[self.covered(moved(motion, table), _COARSE)].sum() for motion in candidates]
        return self.with_copy(group, candidates[int(np.argmax(falls))])

    def with_copy(self, group: _Group, motion: Motion) -> _Group:
        mask = self.covered(moved(motion, self.given.rows[list(group.convex)]))
        return replace(group, motions=(*group.motions, motion), masks=(*group.masks, mask))

    def extended(self, layers: _Layers, at: int, group: _Group) -> tuple[_Layers, _Group]:
        """Copies also where the motions lead on from a copy, in place of what they cover, while that pays."""
        if not self.further:
            return layers, group
        seen = [Motion(), *group.motions]
        middle = self.middle(group.masks[0])
        for motion in _led_on_to(seen, middle):
            self.pause()
            made = self.with_copy(group, motion)
            changed = _replaced(layers, at, {group, *self.covered_by(made, layers[at])}, made)
            if self.cost(changed) < self.cost(layers):
                layers, group = changed, made
        return layers, group

    def drop_unpaid(self) -> None:
        """Without convexes that were only offered and do not pay at the whole of the prices, the worst
        first."""
        while True:
            self.pause()
            error = self.error(self.layers)
            offered = [(at, g) for at, layer in enumerate(self.layers) for g in layer if g.offered]
            lost = [
                self.length(group, 1 / _CAUTION) - self.error(_replaced(self.layers, at, {group})) + error
                for at, group in offered
            ]
            if max(lost, default=0.0) <= 0:
                return
            at, group = offered[int(np.argmax(lost))]
            self.layers = _replaced(self.layers, at, {group})

    def thinned(self, layers: _Layers, at: int, group: _Group) -> _Layers:
        """Without copies that no longer pay, the latest first."""
        for i in reversed(range(len(group.motions))):
            motions, masks = list(group.motions), list(group.masks)
            del motions[i], masks[i + 1]
            fewer = replace(group, motions=tuple(motions), masks=tuple(masks))
            changed = _replaced(layers, at, {group}, fewer)
            if self.cost(changed) < self.cost(layers):
                layers, group = changed, fewer
        return layers

    def covered_by(self, group: _Group, layer: list[_Group]) -> set[_Group]:
        """Convexes without copies of which the last copy of a group covers the most part."""
        weight = self.weight * group.masks[-1]
        return {
            other
            for other in layer
            if not other.motions
            and other.convex != group.convex
            and weight[other.masks[0]].sum() > _TAKEN_OVER * self.weight[other.masks[0]].sum()
        }

    def fitted(self, layers: _Layers, at: int, group: _Group) -> tuple[_Layers, _Group]:
        """The convex improved for all places of the group at once; as it was where that is no cheaper."""
        rest = _replaced(layers, at, {group})
        convex = self.fitting.improved(
            group.convex,
            [Motion(), *group.motions],
            group.masks[0],
            self.middle(group.masks[0]),
            self.error_reduction(rest, at),
        )
        if not convex or set(convex) == set(group.convex):
            return layers, group
        masks = (self.covered(self.given.rows[list(convex)]),)
        made = replace(group, convex=convex, motions=(), masks=masks)
        for motion in group.motions:
            made = self.with_copy(made, motion)
        changed = _replaced(rest, at, set(), made)
        return (changed, made) if self.cost(changed) < self.cost(layers) else (layers, group)

    def without_idle(self, layers: _Layers) -> _Layers:
        """Without convexes that no longer pay: copies have come over what they covered."""
        cost = self.cost(layers)
        for at in range(len(layers)):
            for group in list(layers[at]):
                less = _replaced(layers, at, {group})
                if any(less) and self.cost(less) < cost:
                    layers, cost = less, self.cost(less)
        return layers

    def faces(self, group: _Group) -> list[Face]:
        return [Face.of(row) for row in self.given.rows[list(group.convex)]]

    def middle(self, mask: Mask) -> NDArray[np.float64]:
        """(3,) of the samples around the shape that a convex covers, by weight."""
        mask = mask[: self.samples.near + self.samples.uniform]
        points, weight = self.samples.points[: len(mask)][mask], self.weight[: len(mask)][mask] + 1e-9
        if not len(points):
            return np.zeros(3)
        return np.asarray((points * weight[:, None]).sum(axis=0) / weight.sum(), dtype=np.float64)

    def tree(self) -> CsgTree:
        """With the rows of copies in the table, and which they are."""
        table, complement = [self.given.rows], [self.given.complement]
        count = len(self.given.rows)
        layers: list[tuple[Convex, ...]] = []
        copies: list[tuple[Copy | None, ...]] = []
        for layer in self.layers:
            convexes: list[Convex] = []
            said: list[Copy | None] = []
            for group in layer:
                first = len(convexes)
                convexes.append(group.convex)
                said.append(None)
                for motion in group.motions:
                    table.append(moved(motion, self.given.rows[list(group.convex)]))
                    complement.append(self.given.complement[list(group.convex)])
                    convexes.append(tuple(range(count, count + len(group.convex))))
                    said.append(Copy(first, motion))
                    count += len(group.convex)
            layers.append(tuple(convexes))
            copies.append(tuple(said))
        return CsgTree(np.concatenate(table), np.concatenate(complement), tuple(layers), tuple(copies))


def _replaced(layers: _Layers, at: int, gone: set[_Group], *new: _Group) -> _Layers:
    """The layers with groups of one taken out and others put in."""
    kept = [g for g in layers[at] if g not in gone]
    return [*layers[:at], [*kept, *new], *layers[at + 1 :]]


def _led_on_to(known: list[Motion], middle: NDArray[np.float64]) -> Iterator[Motion]:
    """Places that steps between the known ones, the first of them where the convex is, lead on to: again and
    again from the first, and once from the others, there the shortest steps first."""
    seen = list(known)
    steps = [*known[1:], *(motion.inverse() for motion in known[1:])]
    chains = [(step, known[0], _MAX_POWERS) for step in steps]
    steps.sort(key=lambda step: float(np.linalg.norm(step(middle) - middle)))
    chains += [(step, start, 1) for step in steps[:_SHORTEST] for start in known[1:]]
    for step, motion, most in chains[:_MAX_CHAINS]:
        for _ in range(most):
            motion = step @ motion
            if np.abs(motion(middle)).max() > _FURTHEST or _same(motion, known[0], middle):
                break
            if not any(_same(motion, other, middle) for other in seen):
                seen.append(motion)
                yield motion


def _same(one: Motion, other: Motion, middle: NDArray[np.float64]) -> bool:
    """Whether two motions take what lies around a middle (3,) to the same place."""
    near = np.linalg.norm(one(middle) - other(middle)) < _SAME_PLACE
    return bool(near and np.abs(one.linear - other.linear).max() < _SAME_PLACE)
