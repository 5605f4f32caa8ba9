"""Which regions of many shapes are the same part: matched across the whole family at once.

A family's parts are slots, each a box in the frame in which a shape's own bounding box runs from 0 to 1. Each
shape's regions are assigned to the slots, one to one and at least cost in sum, or left over at a price; then
each slot becomes the median of what was assigned to it, from all shapes; and so on until nothing changes.
Slots that few shapes fill go, and what is left over in many shapes alike becomes one. Each shape in turn is
the first guess, and the slots that all shapes together fit best stay: no single shape is the template.
What is left over at last joins the slot that it brings closest to what the others have there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.errors import FamilyError
from partwright.shapes.topology import doubled_areas

PRICE = 0.2  # of a region and a slot that stay alone, as a mean difference of box sides
COMMON = 0.3  # share of the shapes that fill a slot, at least
_CRUMB = 0.01  # share of a shape's surface: smaller regions only join others
_GUESSES, _ROUNDS = 16, 20  # every k-th shape is a first guess, so that 16 to 31 of many are
_EVERYWHERE = 0.9  # share of the shapes: what more of them have is a piece of nothing
_COVERED, _MORE = 0.8, 0.25  # share of a slot's box that another covers, and by how much less beside it
_THIN = 0.01  # of the shape's box: what walls are thickened by before shares are taken

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Regions:
    """Of one shape: boxes (N, 6), lower and upper corner, its own box being from 0 to 1; and areas (N,),
    which sum to 1."""

    boxes: Array
    areas: Array


@dataclass(frozen=True)
class Matching:
    """slots: boxes (K, 6), the largest first. of: for each shape, the slot (N,) of each region. filled: the
    share of the shapes (K,) that fill each slot. cost: mean over shapes and slots, `PRICE` where nothing
    matches."""

    slots: Array
    of: tuple[NDArray[np.int64], ...]
    filled: Array
    cost: float


def regions_of(vertices: Array, faces: NDArray[np.int64], labels: NDArray[np.int64], count: int) -> Regions:
    """The regions 0 to `count` of a surface whose faces have labels (F,); one without faces has no area."""
    corners = vertices[faces]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    corners = (corners - low) / np.maximum(high - low, 1e-12)
    areas = np.bincount(labels, weights=doubled_areas(vertices, faces), minlength=count)
    boxes = np.tile([np.inf] * 3 + [-np.inf] * 3, (count, 1))
    for axis in range(3):
        np.minimum.at(boxes[:, axis], labels, corners[:, :, axis].min(axis=1))
        np.maximum.at(boxes[:, 3 + axis], labels, corners[:, :, axis].max(axis=1))
    boxes[~np.isfinite(boxes).all(axis=1)] = 0.5
    return Regions(boxes, areas / areas.sum())


def match(shapes: Sequence[Regions], common: float = COMMON, template: int | None = None) -> Matching:
    """One slot for each region of each shape.

    common: share of the shapes that fill a slot, at least. template: number of a shape whose regions are the
    slots, as they are, to compare with.

    Raises FamilyError for fewer than two shapes, or where no two have anything in common.
    """
    if len(shapes) < 2:
        raise FamilyError(f"{len(shapes)} shapes: at least two are needed to tell which parts are alike")
    if template is not None:
        one = shapes[template]
        return _finished(shapes, one.boxes[one.areas > _CRUMB])
    every = max(1, len(shapes) // _GUESSES)
    found = [_settled(shapes, one.boxes[one.areas > _CRUMB], common) for one in shapes[::every]]
    found = [slots for slots in found if len(slots)]
    if not found:
        raise FamilyError("no part is alike in enough of the shapes; are they one family, and stand alike?")
    return _finished(shapes, min(found, key=lambda slots: _cost(shapes, _pairs(shapes, slots), slots)))


def _settled(shapes: Sequence[Regions], slots: Array, common: float) -> Array:
    """Slots that stay as they are when they become the medians of what is assigned to them."""
    for _ in range(_ROUNDS):
        pairs = _pairs(shapes, slots)
        new = []
        for k in range(len(slots)):
            mine = [one.boxes[rows[k]] for one, rows in zip(shapes, pairs, strict=True) if rows[k] >= 0]
            if len(mine) >= max(2.0, common * len(shapes)):
                new.append(np.median(mine, axis=0))
        another = _left_over(shapes, pairs, common)
        new += [] if another is None else [another]
        again = np.array(new).reshape(-1, 6)
        if again.shape == slots.shape and np.allclose(again, slots):
            break
        slots = again
    return slots


def _left_over(shapes: Sequence[Regions], pairs: Sequence[NDArray[np.int64]], common: float) -> Array | None:
    """The region that most other shapes have left over, too, as a box; None where too few have."""
    alone = []
    for one, rows in zip(shapes, pairs, strict=True):
        free = one.areas > _CRUMB
        free[rows[rows >= 0]] = False
        alone.append(one.boxes[free])
    best, most = None, max(2.0, common * len(shapes))
    for boxes in alone:
        for box in boxes:
            near = [other[_apart(other, box[None])[:, 0].argmin()] for other in alone if len(other)]
            near = [other for other in near if _apart(other[None], box[None])[0, 0] < PRICE]
            if len(near) >= most:
                best, most = np.median(near, axis=0), len(near) + 0.5
    return best


def _pairs(shapes: Sequence[Regions], slots: Array) -> list[NDArray[np.int64]]:
    """Of each shape, the region (K,) of each slot."""
    return [_assigned(one, slots) for one in shapes]


def _assigned(one: Regions, slots: Array) -> NDArray[np.int64]:
    """(K,) the region of each slot, -1 for none."""
    from scipy.optimize import linear_sum_assignment

    able = np.flatnonzero(one.areas > _CRUMB)
    found = np.full(len(slots), -1)
    if not len(able) or not len(slots):
        return found
    # Beside the costs, a place for each region and each slot to stay alone at half the price.
    n, k = len(able), len(slots)
    costs = np.full((n + k, k + n), np.inf)
    costs[:n, :k] = _apart(one.boxes[able], slots)
    costs[:n, k:][np.diag_indices(n)] = PRICE / 2
    costs[n:, :k][np.diag_indices(k)] = PRICE / 2
    costs[n:, k:] = 0
    rows, columns = linear_sum_assignment(costs)
    real = (rows < n) & (columns < k)
    found[columns[real]] = able[rows[real]]
    return found


def _apart(boxes: Array, slots: Array) -> Array:
    """(N, K) mean difference of their sides."""
    return np.asarray(np.abs(boxes[:, None] - slots[None]).mean(axis=2))


def _cost(shapes: Sequence[Regions], pairs: Sequence[NDArray[np.int64]], slots: Array) -> float:
    """Of a family by these slots: what is assigned is apart by so much, what stays alone has its price; by
    area, so that a slot for each splinter does not pay."""
    total = 0.0
    for one, rows in zip(shapes, pairs, strict=True):
        held = rows[rows >= 0]
        total += float((one.areas[held] * _apart(one.boxes[held], slots[rows >= 0]).diagonal()).sum())
        total += PRICE * (1 - float(one.areas[held].sum()))
    return total / len(shapes)


def _finished(shapes: Sequence[Regions], slots: Array) -> Matching:
    """With slots that are pieces of others joined to those, and with what was left over; sorted by area."""
    pairs = _pairs(shapes, slots)
    cost = _cost(shapes, pairs, slots)
    into = _pieces(shapes, pairs, slots)
    kept = np.unique(into)
    number = np.searchsorted(kept, into)
    held = [_held(one, rows, number) for one, rows in zip(shapes, pairs, strict=True)]
    slots = np.array([np.median([h[k] for h in held if h[k] is not None], axis=0) for k in range(len(kept))])
    of = []
    for one, rows, mine in zip(shapes, pairs, held, strict=True):
        first = np.full(len(one.boxes), -1)
        first[rows[rows >= 0]] = number[rows >= 0]
        of.append(_joined(one, first, mine, slots))
    area = np.zeros(len(slots))
    for one, slot in zip(shapes, of, strict=True):
        np.add.at(area, slot, one.areas)
    order = np.argsort(-area, kind="stable")
    rank = np.argsort(order, kind="stable")
    filled = np.array([[(mine == k).any() for k in range(len(slots))] for mine in of]).mean(axis=0)
    return Matching(slots[order], tuple(rank[mine] for mine in of), filled[order], cost)


def _pieces(shapes: Sequence[Regions], pairs: Sequence[NDArray[np.int64]], slots: Array) -> NDArray[np.int64]:
    """(K,) the slot that each becomes a piece of, or itself.

    Some backs are fitted by one region and some by two posts and a rail. So where a slot is empty, and
    another one there covers its place, which it does not where the slot is filled, the slot is a piece of
    the other.
    """
    into = np.arange(len(slots))
    there = np.array([rows >= 0 for rows in pairs])
    order = np.argsort(there.mean(axis=0), kind="stable").tolist()
    for place, k in enumerate(order):
        if there[:, k].mean() > _EVERYWHERE:
            continue
        most = _COVERED
        for m in order[place + 1 :]:  # of what is no rarer, so that nothing is a piece of itself
            alone = [i for i in np.flatnonzero(there[:, m]).tolist() if not there[i, k]]
            beside = [i for i in np.flatnonzero(there[:, m]).tolist() if there[i, k]]
            if len(alone) < 2 or not beside:
                continue
            covers, besides = (
                _share(slots[k], np.median([shapes[i].boxes[pairs[i][m]] for i in some], axis=0))
                for some in (alone, beside)
            )
            if covers > most and covers - besides > _MORE:
                into[k], most = m, covers
    for _ in range(len(slots)):
        into = into[into]
    return into


def _share(box: Array, other: Array) -> float:
    """Of a box that lies in another, walls a hundredth thick at least."""
    low, high = box[:3] - _THIN, box[3:] + _THIN
    inside = np.minimum(high, other[3:] + _THIN) - np.maximum(low, other[:3] - _THIN)
    return float(np.prod(np.clip(inside, 0, None) / (high - low)))


def _held(one: Regions, rows: NDArray[np.int64], number: NDArray[np.int64]) -> list[Array | None]:
    """The box of all that each slot has, None for nothing."""
    held: list[Array | None] = [None] * (int(number.max(initial=-1)) + 1)
    for k in np.flatnonzero(rows >= 0).tolist():
        box, mine = one.boxes[rows[k]], held[number[k]]
        held[number[k]] = box if mine is None else _around(mine, box)
    return held


def _joined(
    one: Regions, of: NDArray[np.int64], held: Sequence[Array | None], slots: Array
) -> NDArray[np.int64]:
    """(N,) the slot of each region: its own, or, from the largest on, the one whose box it changes to be most
    like the family's."""
    of, held = of.copy(), list(held)
    for i in sorted(np.flatnonzero(of < 0).tolist(), key=lambda i: -one.areas[i]):
        box, changes = one.boxes[i], []
        for k, mine in enumerate(held):
            both = box if mine is None else _around(mine, box)
            before = PRICE if mine is None else float(np.abs(mine - slots[k]).mean())
            changes.append(float(np.abs(both - slots[k]).mean()) - before)
        # Of those that it changes as little, the one that it lies in, or nearest to.
        near = [_gap(box, slots[k] if mine is None else mine) for k, mine in enumerate(held)]
        of[i] = int(np.argmin(np.array(changes) + np.array(near)))
        mine = held[of[i]]
        held[of[i]] = box if mine is None else _around(mine, box)
    return of


def _around(a: Array, b: Array) -> Array:
    return np.concatenate([np.minimum(a[:3], b[:3]), np.maximum(a[3:], b[3:])])


def _gap(a: Array, b: Array) -> float:
    """How far apart two boxes lie, and, where they meet, how far their middles do, a little."""
    apart = np.maximum(np.maximum(a[:3] - b[3:], b[:3] - a[3:]), 0)
    return float(np.linalg.norm(apart) + 0.05 * np.linalg.norm((a[:3] + a[3:] - b[:3] - b[3:]) / 2))
