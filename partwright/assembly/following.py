"""What depends on the faces of a part, and goes with them when they move: parts that stand on them or reach
out of them, cuts that go through them, cuts that begin at one of them."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from typing import TypeVar

import numpy as np

from partwright.assembly.profile_numbers import SAME_PLACE
from partwright.assembly.similarity import Similarity, rotation_matrix
from partwright.assembly.stretching import stretched
from partwright.assembly.tree import Assembly, Node, Part
from partwright.fields import Profile, Revolution

_FLUSH = 2e-3  # of the assembly's longest side: faces that are nearer touch
_BEYOND = 20  # times that, by which cuts end beyond a shoulder that they are open at
_FLAT = ("box", "hollow_box", "extrusion")  # kinds that may have flat faces along all of their axes
_FLAT_ENDS = (*_FLAT, "cylinder", "tube", "cone", "frustum", "hollow_frustum", "revolution")  # and along z

AnyNode = TypeVar("AnyNode", Part, Assembly)


def followed(assembly: Assembly, before: Part, after: Part, told: list[str]) -> Assembly:
    """The assembly, which holds `after` in place of `before`, with what depended on it moved with its faces;
    told: gets a sentence for each. What carries the part, wider than it is, stays where it is,
    and the part goes on standing on it."""
    near = _FLUSH * float(np.ptp(assembly.bounds(), axis=0).max())
    standing = _on_its_carrier(assembly, before, after, near, told)
    if standing is not after:
        assembly, after = assembly.replace_part(before.name, standing), standing
    return _Following(before, list(_moves(before, after)), near, told).through(assembly)


@dataclass(frozen=True)
class _Move:
    """The two faces of a part along one of its axes: where they were, and where they are.

    flat: whether they are faces that something can stand on, and not where a round wall happens to end.
    across: the two other axes, and from where to where the part reached along them. shoulder: which of
    them, if one is, lies between the ends of the part, so that what reaches far beyond it is not of it; the
    other is an end, which has a move of its own.
    """

    axis: np.ndarray
    before: tuple[float, float]
    after: tuple[float, float]
    flat: bool
    across: tuple[tuple[np.ndarray, tuple[float, float]], ...]
    shoulder: int | None = None

    def shift(self, face: int) -> float:
        """How far what depends on one face alone goes with it."""
        own = self.shoulder is None or face == self.shoulder
        return self.after[face] - self.before[face] if own else 0.0


def _extent(part: Part, axis: np.ndarray) -> tuple[float, float]:
    """From where to where the part, not its copies, reaches along a direction (3,)."""
    local = np.stack([-axis, axis]) @ rotation_matrix(part.rotation)
    low, high = part.field.support(local)
    at = float(np.array(part.translation) @ axis)
    return at - float(low), at + float(high)


def _moves(before: Part, after: Part) -> Iterator[_Move]:
    if isinstance(before.field, Revolution) and isinstance(after.field, Revolution):
        yield from _shoulder_moves(before, after, before.field.profile, after.field.profile)
    axes = list(rotation_matrix(before.rotation).T)
    for k, axis in enumerate(axes):
        old, new = _extent(before, axis), _extent(after, axis)
        if old != new:
            others = tuple((other, _extent(before, other)) for i, other in enumerate(axes) if i != k)
            flat = before.field.kind in (_FLAT_ENDS if k == 2 else _FLAT)
            yield _Move(axis, old, new, flat, others)


def _shoulder_moves(before: Part, after: Part, old: Profile, new: Profile) -> Iterator[_Move]:
    """Of flat faces between the ends of a part that is turned, one of those that lie in one plane."""
    *others, axis = rotation_matrix(before.rotation).T
    ends, now = _extent(before, axis), _extent(after, axis)
    across = tuple((other, _extent(before, other)) for other in others)
    shift = float(np.subtract(after.translation, before.translation) @ axis)
    at = float(np.array(before.translation) @ axis)
    low, high = (float(y) for y in (old.corners[:, 1].min(), old.corners[:, 1].max()))
    if old.corners.shape != new.corners.shape:
        return
    near = SAME_PLACE * old.size
    found: set[tuple[bool, tuple[float, float], tuple[float, float]]] = set()
    for side, other in zip(chain(*old.sides), chain(*new.sides), strict=True):
        level, moved = at + side.start[1], at + other.start[1] + shift
        is_level = side.centre is None and abs(side.start[1] - side.end[1]) < near
        if not is_level or not low + near < side.start[1] < high - near:
            continue
        up = side.start[0] > side.end[0]  # the solid lies on the left
        was, is_ = ((ends[0], level), (now[0], moved)) if up else ((level, ends[1]), (moved, now[1]))
        if was != is_ and (up, was, is_) not in found:
            found.add((up, was, is_))
            yield _Move(axis, was, is_, True, across, int(up))


def _on_its_carrier(assembly: Assembly, before: Part, after: Part, near: float, told: list[str]) -> Part:
    """The part moved back to what carries it, along each axis along which it grew away from that or into it;
    between two that do so it stays as it is."""
    if _is_cut(assembly, before.name):
        return after
    others = [one for one in assembly.parts if one.name != before.name and not _is_cut(assembly, one.name)]
    for move in _moves(before, after):
        if not move.flat or move.shoulder is not None:
            continue
        carriers = [[one for one in others if _carries(one, move, face, near)] for face in (0, 1)]
        if bool(carriers[0]) == bool(carriers[1]):
            continue
        face = 0 if carriers[0] else 1
        back = move.before[face] - move.after[face]
        if back:
            x, y, z = (np.array(after.translation) + back * move.axis).tolist()
            after = dataclasses.replace(after, translation=(x, y, z))
            told.append(f"{before.name} still stands on {carriers[face][0].name}")
    return after


def _carries(other: Part, move: _Move, face: int, near: float) -> bool:
    """Whether another part, or a copy of it, ends at a face of the part and is wider than that both ways."""

    def is_wider(copy: Part, axis: np.ndarray, begin: float, end: float) -> bool:
        low, high = _extent(copy, axis)
        return low <= begin + near and high >= end - near and high - low > end - begin + near

    return any(
        abs(_extent(copy, move.axis)[1 - face] - move.before[face]) <= near
        and all(is_wider(copy, axis, *reach) for axis, reach in move.across)
        for copy in other.copies
    )


@dataclass(frozen=True)
class _Following:
    """near: how far apart faces may be that touch."""

    part: Part
    moves: list[_Move]
    near: float
    told: list[str]

    def through(self, whole: Assembly) -> Assembly:
        cut = _is_cut(whole, self.part.name)
        result = self._visited(whole, False, cut)
        assert isinstance(result, Assembly)
        return result

    def _visited(self, node: Node, cut: bool, own_cut: bool) -> Node:
        """cut: whether the node is taken away from what holds the part. own_cut: whether the part itself is
        taken away, so that nothing that is there stands on it."""
        if isinstance(node, Part):
            return node if node.name == self.part.name else self._moved(node, cut, own_cut)
        holds = any(leaf.name == self.part.name for leaf in node.children[0].parts)
        if any(leaf.name == self.part.name for leaf in node.parts) or cut:
            inner = node.operation == "difference" and holds
            # What is taken away beside the part is no solid, either: a hole in the floor of a pocket.
            beside = node.operation == "difference" and not holds and not cut
            children = [
                self._visited(child, cut or (inner and i > 0), own_cut and not (beside and i > 0))
                for i, child in enumerate(node.children)
            ]
            return dataclasses.replace(node, children=tuple(children))
        return self._with_first(node, lambda whole, move: self._whole_moved(whole, move, own_cut))

    def _with_first(self, node: AnyNode, moved: Callable[[AnyNode, _Move], AnyNode | None]) -> AnyNode:
        """What becomes of a node: along each axis it depends on one move, the first, shoulders before ends,
        of which `moved` tells so."""
        done: list[np.ndarray] = []
        for move in self.moves:
            if any((axis == move.axis).all() for axis in done):
                continue
            after = moved(node, move)
            if after is not None:
                done.append(move.axis)
                node = after
        return node

    def _whole_moved(self, whole: Assembly, move: _Move, own_cut: bool) -> Assembly | None:
        """A part and what is cut from it: each copy with its own face where all of it has the same copies."""
        first = whole.parts[0]
        shifts = [self._shift(copy, move, own_cut) for copy in first.copies]
        if not any(shifts) and not own_cut:
            rooted = self._rooted(first, move)
            shifts = [move.shift(rooted[0])] if rooted is not None else []
        ways = {shift for shift in shifts if shift}
        if not ways:
            return None
        self.told.append(
            f"{first.name} and what is cut from it moved with {self.part.name}, on whose face it stands"
        )
        if len(ways) > 1 and all(part.instances == first.instances for part in whole.parts):
            return _each(whole, lambda part: _copies_moved(part, shifts, move.axis))
        return whole.translated((next(filter(None, shifts)) * move.axis).tolist())

    def _shift(self, other: Part, move: _Move, own_cut: bool) -> float:
        """How far a part that stands on a face moves with it: on the floor of a pocket where that is cut."""
        low, high = _extent(other, move.axis)
        if not move.flat or not np.isfinite([low, high]).all() or not self._beside(other, move, own_cut):
            return 0.0
        for end, face in ((low, 0 if own_cut else 1), (high, 1 if own_cut else 0)):
            if abs(end - move.before[face]) <= self.near:
                return move.shift(face)
        return 0.0

    def _beside(self, other: Part, move: _Move, within: bool = False) -> bool:
        """Whether another part, or a copy of it, lies over the face and not far off in its plane; within:
        and nowhere else."""

        def over(copy: Part, axis: np.ndarray, begin: float, end: float) -> bool:
            low, high = _extent(copy, axis)
            if within:
                return begin - self.near < low and high < end + self.near
            return low < end - self.near and high > begin + self.near

        return any(all(over(copy, axis, *reach) for axis, reach in move.across) for copy in other.copies)

    def _moved(self, other: Part, cut: bool, own_cut: bool) -> Part:
        if cut:
            return self._with_first(other, self._cut_moved)
        return self._with_first(other, lambda part, move: self._added_moved(part, move, own_cut))

    def _added_moved(self, other: Part, move: _Move, own_cut: bool) -> Part | None:
        shifts = [self._shift(copy, move, own_cut) for copy in other.copies]
        if any(shifts):
            return self._shifted(other, shifts, move, f"the face of {self.part.name} that it stands on")
        return None if own_cut or move.shoulder is not None else self._rooted_moved(other, move)

    def _shifted(self, other: Part, shifts: list[float], move: _Move, face: str) -> Part | None:
        """Every copy with its own face where they stand on two that move otherwise, else all alike."""
        ways = sorted({shift for shift in shifts if shift})
        if not ways:
            return None
        self.told.append(f"{other.name} moved by {' and '.join(f'{way:.6g}' for way in ways)} with {face}")
        if len(ways) == 1:
            return other.translated((ways[0] * move.axis).tolist())
        return _copies_moved(other, shifts, move.axis)

    def _rooted_moved(self, other: Part, move: _Move) -> Part | None:
        """A part that is rooted in the part itself: it stands out as far as before, and ends where the part
        does if it did so, or else would come out of the other face."""
        rooted = self._rooted(other, move)
        if rooted is None:
            return None
        face, root = rooted
        shift = move.after[face] - move.before[face]
        is_whole = abs(root - move.before[1 - face]) <= self.near
        ends_at = move.after[1 - face] if is_whole else float(np.clip(root + shift, *move.after))
        more = (root + shift - ends_at) * (1 if face else -1)
        longer = stretched(other, move.axis, more) if more else None
        if longer is not None:
            other, shift = longer, (shift + ends_at - root) / 2
        elif not shift:
            return None
        self.told.append(f"{other.name} stands out of {self.part.name} as far as before")
        return other.translated((shift * move.axis).tolist())

    def _rooted(self, other: Part, move: _Move) -> tuple[int, float] | None:
        """Out of which face another part reaches with all its copies, and how high its other end lies, within
        the part or at its other face; None of what does not."""
        low, high = _extent(other, move.axis)
        begin, end = move.before
        up = high > end + self.near and begin - self.near <= low < end - self.near
        down = low < begin - self.near and begin + self.near < high <= end + self.near
        if not move.flat or not (up or down) or not np.isfinite([low, high]).all():
            return None
        for copy in other.copies:
            same = np.abs(np.subtract(_extent(copy, move.axis), (low, high))).max() <= self.near
            if not same or not self._beside(copy, move, within=True):
                return None
        return (1, low) if up else (0, high)

    def _cut_moved(self, other: Part, move: _Move) -> Part | None:
        """A cut of the part: it still goes through, or has its depth as before."""
        low, high = _extent(other, move.axis)
        if not np.isfinite([low, high]).all() or not self._beside(other, move):
            return None
        rise, fall = move.after[1] - move.before[1], move.after[0] - move.before[0]
        below, above = self._is_open(low, high, move)
        if below and above:
            longer = stretched(other, move.axis, rise - fall) if rise != fall else other
            if longer is None:
                change = f"{'longer' if rise > fall else 'shorter'} by {abs(rise - fall):.6g}"
                self.told.append(
                    f"{other.name} stays as it is: it cannot be made {change} with {self.part.name}"
                )
                return other
            self.told.append(f"{other.name} goes through {self.part.name} as before")
            return longer.translated(((rise + fall) / 2 * move.axis).tolist())
        shifts = [self._depth_shift(copy, move) for copy in other.copies]
        return self._shifted(other, shifts, move, f"the face of {self.part.name}: its depth is kept")

    def _is_open(self, low: float, high: float, move: _Move) -> tuple[bool, bool]:
        """Whether a cut ends beyond the one face, and beyond the other; of a shoulder not far beyond."""
        least, most = (_BEYOND * self.near if move.shoulder == k else math.inf for k in (0, 1))
        begin, end = move.before
        return begin - least <= low <= begin + self.near, end - self.near <= high <= end + most

    def _depth_shift(self, cut: Part, move: _Move) -> float:
        """How far the face moves in which a blind cut begins; 0 where it begins in neither."""
        low, high = _extent(cut, move.axis)
        below, above = self._is_open(low, high, move)
        begin, end = move.before
        if above and begin + self.near < low < end:
            return move.shift(1)
        if below and begin < high < end - self.near:
            return move.shift(0)
        return 0.0


def _copies_moved(part: Part, shifts: list[float], axis: np.ndarray) -> Part:
    """Each copy moved by a length of its own."""
    first, *rest = (_shift_along(shift, axis) for shift in shifts)
    moved = dataclasses.replace(part, instances=()).transformed(first)
    pairs = zip(rest, part.instances, strict=True)
    return dataclasses.replace(
        moved, instances=tuple(own @ instance @ first.inverse() for own, instance in pairs)
    )


def _each(whole: Assembly, change: Callable[[Part], Part]) -> Assembly:
    """With every leaf changed."""
    children = tuple(
        change(child) if isinstance(child, Part) else _each(child, change) for child in whole.children
    )
    return dataclasses.replace(whole, children=children)


def _shift_along(length: float, axis: np.ndarray) -> Similarity:
    x, y, z = (length * axis).tolist()
    return Similarity(translation=(x, y, z))


def _is_cut(node: Node, name: str) -> bool:
    """Whether the leaf of that name is taken away from something."""
    if isinstance(node, Part):
        return False
    for i, child in enumerate(node.children):
        if any(leaf.name == name for leaf in child.parts):
            return (node.operation == "difference" and i > 0) != _is_cut(child, name)
    return False
