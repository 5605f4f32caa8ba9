"""What depends on the faces of a part, and goes with them when they move: parts that stand on them or reach
out of them, cuts that go through them, cuts that begin at one of them."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from partwright.assembly.numbers import numbers_of, with_number
from partwright.assembly.similarity import rotation_matrix
from partwright.assembly.tree import Assembly, Node, Part

_FLUSH = 2e-3  # of the assembly's longest side: faces that are nearer touch
_ALONG = 1e-3  # radians: axes that differ by less are parallel
_STRETCHED = ("cylinder", "tube", "extrusion", "capsule")
_FLAT = ("box", "hollow_box", "extrusion")  # kinds that may have flat faces along all of their axes
_FLAT_ENDS = (*_FLAT, "cylinder", "tube", "cone", "frustum", "hollow_frustum", "revolution")  # and along z


def followed(assembly: Assembly, before: Part, after: Part, told: list[str]) -> Assembly:
    """The assembly, which holds `after` in place of `before`, with what depended on it moved with its faces;
    told: gets a sentence for each."""
    near = _FLUSH * float(np.ptp(assembly.bounds(), axis=0).max())
    return _Following(before, list(_moves(before, after)), near, told).through(assembly)


@dataclass(frozen=True)
class _Move:
    """The two faces of a part along one of its axes: where they were, and where they are.

    flat: whether they are faces that something can stand on, and not where a round wall happens to end.
    across: the two other axes, and from where to where the part reached along them.
    """

    axis: np.ndarray
    before: tuple[float, float]
    after: tuple[float, float]
    flat: bool
    across: tuple[tuple[np.ndarray, tuple[float, float]], ...]


def _extent(part: Part, axis: np.ndarray) -> tuple[float, float]:
    """From where to where the part, not its copies, reaches along a direction (3,)."""
    local = np.stack([-axis, axis]) @ rotation_matrix(part.rotation)
    low, high = part.field.support(local)
    at = float(np.array(part.translation) @ axis)
    return at - float(low), at + float(high)


def _moves(before: Part, after: Part) -> Iterator[_Move]:
    axes = list(rotation_matrix(before.rotation).T)
    for k, axis in enumerate(axes):
        old, new = _extent(before, axis), _extent(after, axis)
        if old != new:
            others = tuple((other, _extent(before, other)) for i, other in enumerate(axes) if i != k)
            flat = before.field.kind in (_FLAT_ENDS if k == 2 else _FLAT)
            yield _Move(axis, old, new, flat, others)


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
        first = node.parts[0]
        shift = sum((self._whole_shift(first, move, own_cut) * move.axis for move in self.moves), np.zeros(3))
        if not shift.any():
            return node
        self.told.append(
            f"{first.name} and what is cut from it moved with {self.part.name}, on whose face it stands"
        )
        return node.translated(shift.tolist())

    def _whole_shift(self, first: Part, move: _Move, own_cut: bool) -> float:
        """How far a part and what is cut from it move with a face."""
        shift = self._shift(first, move, own_cut)
        rooted = self._rooted(first, move) if not shift and not own_cut else None
        return shift if rooted is None else move.after[rooted[0]] - move.before[rooted[0]]

    def _shift(self, other: Part, move: _Move, own_cut: bool) -> float:
        """How far a part that stands on a face moves with it: on the floor of a pocket where that is cut."""
        low, high = _extent(other, move.axis)
        if not move.flat or not np.isfinite([low, high]).all() or not self._beside(other, move, own_cut):
            return 0.0
        for end, face in ((low, 0 if own_cut else 1), (high, 1 if own_cut else 0)):
            if abs(end - move.before[face]) <= self.near:
                return move.after[face] - move.before[face]
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
        for move in self.moves:
            if cut:
                other = self._cut_moved(other, move)
                continue
            shift = self._shift(other, move, own_cut)
            if shift:
                face = f"the face of {self.part.name} that it stands on"
                self.told.append(f"{other.name} moved by {shift:.6g} with {face}")
                other = other.translated((shift * move.axis).tolist())
            elif not own_cut:
                other = self._rooted_moved(other, move)
        return other

    def _rooted_moved(self, other: Part, move: _Move) -> Part:
        """A part that is rooted in the part itself: it stands out as far as before, and ends where the part
        does if it did so, or else would come out of the other face."""
        rooted = self._rooted(other, move)
        if rooted is None:
            return other
        face, root = rooted
        shift = move.after[face] - move.before[face]
        is_whole = abs(root - move.before[1 - face]) <= self.near
        ends_at = move.after[1 - face] if is_whole else float(np.clip(root + shift, *move.after))
        more = (root + shift - ends_at) * (1 if face else -1)
        longer = _stretched(other, move.axis, more) if more else None
        if longer is not None:
            other, shift = longer, (shift + ends_at - root) / 2
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

    def _cut_moved(self, other: Part, move: _Move) -> Part:
        """A cut of the part: it still goes through, or has its depth as before."""
        low, high = _extent(other, move.axis)
        if not np.isfinite([low, high]).all() or not self._beside(other, move):
            return other
        rise, fall = move.after[1] - move.before[1], move.after[0] - move.before[0]
        below, above = low <= move.before[0] + self.near, high >= move.before[1] - self.near
        if below and above:
            longer = _stretched(other, move.axis, rise - fall)
            if longer is None:
                return other
            self.told.append(f"{other.name} goes through {self.part.name} as before")
            return longer.translated(((rise + fall) / 2 * move.axis).tolist())
        if (above and low < move.before[1]) or (below and high > move.before[0]):
            shift = rise if above else fall
            face = f"the face of {self.part.name}: its depth is kept"
            self.told.append(f"{other.name} moved by {shift:.6g} with {face}")
            return other.translated((shift * move.axis).tolist())
        return other


def _is_cut(node: Node, name: str) -> bool:
    """Whether the leaf of that name is taken away from something."""
    if isinstance(node, Part):
        return False
    for i, child in enumerate(node.children):
        if any(leaf.name == name for leaf in child.parts):
            return (node.operation == "difference" and i > 0) != _is_cut(child, name)
    return False


def _stretched(part: Part, axis: np.ndarray, by: float) -> Part | None:
    """Longer along the direction; None where no number of it is its length that way."""
    local = np.abs(axis @ rotation_matrix(part.rotation))
    k = int(local.argmax())
    if local[k] < 1 - _ALONG:
        return None
    if part.field.kind == "box":
        number = f"size.{'xyz'[k]}"
    elif k == 2 and part.field.kind in _STRETCHED:
        number = "height"
    else:
        return None
    return with_number(part, number, numbers_of(part)[number] + by)
