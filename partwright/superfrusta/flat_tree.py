"""Rows with signs as a tree that reads well, and such a tree as rows again.

The fold of the rows is one long chain: ((a + b - c) + d) - e. Where unions are plain, a part that is
subtracted belongs to those alone that it meets, so the chain falls apart into a union of small differences.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Part
from partwright.assembly.tree import Node
from partwright.errors import SettingError
from partwright.shapes.grid import grid_indices

_PER_SIDE = 20  # lattice points along each side of a box in which two parts may meet
_MEETS = -1e-4  # unit lengths: shallower than this, two parts only touch


@dataclass
class _Stage:
    """Indices of parts that are added, then of those that are subtracted from all so far."""

    added: list[int] = field(default_factory=list)
    cuts: list[int] = field(default_factory=list)


class Meetings:
    """Which parts meet. Each pair is asked once, however many trees it is in."""

    def __init__(self) -> None:
        self._known: dict[tuple[Hashable, Hashable], bool] = {}

    def of(self, parts: Sequence[Part], added: Sequence[bool]) -> NDArray[np.bool_]:
        """(M, M): whether the interiors of a subtracted part and an added one meet, in any copies."""
        meets = np.zeros((len(parts), len(parts)), bool)
        cuts = [i for i, plus in enumerate(added) if not plus]
        for i in cuts:
            for j in set(range(len(parts))) - set(cuts):
                # Copy by copy: in a box around a row of them, a lattice may miss what is thin.
                pairs = product(parts[i].copies, parts[j].copies)
                meets[i, j] = meets[j, i] = any(self._meet(one, other) for one, other in pairs)
        return meets

    def _meet(self, cut: Part, other: Part) -> bool:
        key = _solid(cut), _solid(other)
        if key not in self._known:
            self._known[key] = _meet(cut, other)
        return self._known[key]


def nested(
    parts: Sequence[Part], added: Sequence[bool], plain: bool, meetings: Meetings | None = None
) -> Assembly:
    """The fold of the parts as a tree of unions and differences.

    plain: no part blends, so that each subtracted part may go to those that it cuts; one that cuts nothing is
    left out. Otherwise the tree is the chain itself. Parts are in the unit frame. meetings: what is known of
    such parts from other trees.
    """
    if all(added):
        return Assembly(tuple(parts))
    found = meetings or Meetings()
    meets = found.of(parts, added) if plain else np.ones((len(parts), len(parts)), bool)
    groups = _groups(added, meets)
    nodes = [_node(parts, _stages(group, added, meets)) for group in groups]
    if len(nodes) == 1 and isinstance(nodes[0], Assembly):
        return nodes[0]
    return Assembly(tuple(nodes))


def joined_by_cuts(parts: Sequence[Part], added: Sequence[bool], meetings: Meetings) -> list[list[int]]:
    """Indices of added parts that belong together because something is subtracted from both, and of that."""
    return _groups(added, meetings.of(parts, added))


def flattened(node: Node) -> list[tuple[Part, bool]]:
    """The leaves in the order of the fold, and whether each is added.

    Exact for trees of `nested`; in others, a part is also taken from what another branch brought before it.

    Raises:
        SettingError: the tree has an intersection, or a difference of what is itself a difference.
    """
    if isinstance(node, Part):
        return [(node, True)]
    if node.operation == "intersection":
        raise SettingError("the start must be made of unions and differences; it has an intersection")
    leaves = [flattened(child) for child in node.children]
    if node.operation == "union":
        # Branches with differences first: what they subtract is not meant for the others.
        leaves.sort(key=lambda branch: all(plus for _, plus in branch))
        return [leaf for branch in leaves for leaf in branch]
    if not all(plus for branch in leaves[1:] for _, plus in branch):
        raise SettingError("the start subtracts a difference; only unions of parts can be subtracted")
    return leaves[0] + [(part, False) for branch in leaves[1:] for part, _ in branch]


def _solid(part: Part) -> Hashable:
    """What tells a part without copies from others, whatever it is called."""
    return part.field, part.translation, part.rotation


def _meet(a: Part, b: Part) -> bool:
    boxes = np.array([a.bounds(), b.bounds()])
    low, high = boxes[:, 0].max(axis=0), boxes[:, 1].min(axis=0)
    if not (low < high).all():
        return False
    lattice = (grid_indices((_PER_SIDE,) * 3) + 0.5) / _PER_SIDE
    points = (low + lattice * (high - low)).astype(np.float32)
    within = points[a.distance(points) < _MEETS]
    return len(within) > 0 and bool((b.distance(within) < _MEETS).any())


def _groups(added: Sequence[bool], meets: NDArray[np.bool_]) -> list[list[int]]:
    """Parts that belong to one another because something is subtracted from both, in order."""
    group = list(range(len(added)))
    for cut in np.flatnonzero(~np.array(added)):
        for part in range(cut):
            if added[part] and meets[cut, part]:
                old, new = group[part], group[cut]
                group = [new if g == old else g for g in group]
    members = [[i for i, g in enumerate(group) if g == label] for label in dict.fromkeys(group)]
    members = [m for m in members if any(added[i] for i in m)]
    return sorted(members, key=lambda m: next(i for i in m if added[i]))


def _stages(group: list[int], added: Sequence[bool], meets: NDArray[np.bool_]) -> list[_Stage]:
    """The group's fold in as few stages as it takes: each part goes as far to the front as it may."""
    stages = [_Stage()]
    for index in group:
        if added[index]:
            # Not before a stage whose cuts came earlier and would cut it.
            blocked = [s for s, stage in enumerate(stages) if any(meets[c, index] for c in stage.cuts)]
            place = blocked[-1] + 1 if blocked else 0
            if place == len(stages):
                stages.append(_Stage())
            stages[place].added.append(index)
        else:
            cut = [s for s, stage in enumerate(stages) if any(meets[index, a] for a in stage.added)]
            stages[cut[-1] if cut else -1].cuts.append(index)
    return stages


def _node(parts: Sequence[Part], stages: list[_Stage]) -> Node:
    node: Node | None = None
    for stage in stages:
        children: list[Node] = ([node] if node is not None else []) + [parts[i] for i in stage.added]
        node = children[0] if len(children) == 1 else Assembly(tuple(children))
        if stage.cuts:
            node = Assembly((node, *(parts[i] for i in stage.cuts)), operation="difference")
    assert node is not None
    return node
