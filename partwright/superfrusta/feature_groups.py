"""Features that come together again and again as groups: a foot and its hole once, and moves of them.

Copies of features are parts by themselves first. Those that a cut joins are one body of the union, and where
one such body is another's rigid or mirror image, all of its parts at once, it becomes a copy: exactly what
the first is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.assembly.group_copies import GroupCopy
from partwright.superfrusta.feature_steps import Feature, as_move, image_of
from partwright.superfrusta.flat_tree import Meetings, joined_by_cuts, nested

_MOST = 150  # copies that are looked at
_SAME = 1e-3  # unit lengths: how far copies may be from where the group's move takes them
_POINTS = 150
_HALF_TURNS = (
    Similarity(),
    Similarity(rotation=(0.0, 1.0, 0.0, 0.0)),
    Similarity(rotation=(0.0, 0.0, 1.0, 0.0)),
    Similarity(rotation=(0.0, 0.0, 0.0, 1.0)),
)


@dataclass(frozen=True)
class _Leaf:
    feature: int
    part: Part


def grouped(features: Sequence[Feature], meetings: Meetings | None = None) -> Assembly:
    """The fold of the features as a tree of unions and differences, groups with their copies last.

    meetings: what is known of such parts from other trees.
    """
    meetings = meetings or Meetings()
    leaves = [_Leaf(i, copy) for i, f in enumerate(features) for part in f.parts for copy in part.copies]
    groups = _groups(features, leaves, meetings) if len(leaves) <= _MOST else []
    taken = {id(leaf) for group in groups for body in group.bodies for leaf in body}
    parts: list[Part] = []
    added: list[bool] = []
    for i, feature in enumerate(features):
        own = [leaf for leaf in leaves if leaf.feature == i]
        left = [leaf.part for leaf in own if id(leaf) not in taken]
        whole = list(feature.parts) if len(left) == len(own) else [p for _, p in _with_copies(left)]
        parts += whole
        added += [feature.added] * len(whole)
    nodes: list[Node] = []
    if any(added):
        rest = nested(parts, added, True, meetings)
        nodes += rest.children if rest.operation == "union" else (rest,)
    for group in groups:
        nodes += group.nodes(features, meetings)
    only = nodes[0]
    return only if len(nodes) == 1 and isinstance(only, Assembly) else Assembly(tuple(nodes))


@dataclass(frozen=True)
class _Group:
    """Bodies that are one another's images, the first itself, and for each other the copy that it is."""

    bodies: list[list[_Leaf]]
    copies: list[GroupCopy]

    def nodes(self, features: Sequence[Feature], meetings: Meetings) -> list[Node]:
        first = self.bodies[0]
        parts = _with_copies([leaf.part for leaf in first], [leaf.feature for leaf in first])
        added = [features[i].added for i, _ in parts]
        body = nested([part for _, part in parts], added, True, meetings)
        return [body, *(copy.of(body, k) for k, copy in enumerate(self.copies, start=2))]


def _groups(features: Sequence[Feature], leaves: list[_Leaf], meetings: Meetings) -> list[_Group]:
    added = [features[leaf.feature].added for leaf in leaves]
    alike: dict[tuple[int, ...], list[list[_Leaf]]] = {}
    for members in joined_by_cuts([leaf.part for leaf in leaves], added, meetings):
        body = [leaves[i] for i in members]
        key = tuple(sorted(leaf.feature for leaf in body))
        if len(set(key)) > 1 or features[key[0]].image is not None:
            alike.setdefault(key, []).append(body)
    found = []
    for bodies in alike.values():
        left = bodies
        while left:
            first, *others = left
            copies = [(other, _copy(first, other)) for other in others]
            good = [(other, copy) for other, copy in copies if copy is not None]
            if good:
                found.append(_Group([first, *(o for o, _ in good)], [c for _, c in good]))
            left = [other for other, copy in copies if copy is None]
    return found


def _copy(first: Sequence[_Leaf], other: Sequence[_Leaf]) -> GroupCopy | None:
    """How the other body is made of the first; None where no move and no mirror does."""
    for mirror in (None, "x"):
        images = [leaf.part if mirror is None else _image(leaf.part) for leaf in first]
        for move in _moves(first, images, other):
            left = list(other)
            for leaf, image in zip(first, images, strict=True):
                moved = image.transformed(move)
                same = next(
                    (o for o in left if o.feature == leaf.feature and same_solid(moved, o.part)), None
                )
                if same is None:
                    break
                left.remove(same)
            else:
                return GroupCopy(move, mirror)
    return None


def _image(part: Part) -> Part:
    """The part mirrored in the plane x = 0: turned over where that is the same, as its copies are."""
    image = image_of(part, Similarity())
    move = as_move(part, image)
    return image if move is None else part.transformed(move)


def _moves(first: Sequence[_Leaf], images: Sequence[Part], other: Sequence[_Leaf]) -> Iterator[Similarity]:
    """Rigid moves that take one part of a body to one of the other, also turned within itself."""
    for leaf, image in zip(first, images, strict=True):
        for target in other:
            if target.feature == leaf.feature and target.part.field == image.field:
                back = image.pose.inverse()
                yield from (target.part.pose @ turn @ back for turn in _HALF_TURNS)


def same_solid(one: Part, other: Part, within: float = _SAME) -> bool:
    """Whether two parts are the same solid, in whatever pose, within unit lengths."""
    box, own = one.bounds(), other.bounds()
    if not np.isfinite([box, own]).all() or np.abs(box - own).max() > 2 * within:
        return False
    room = 0.1 * np.ptp(box, axis=0)
    points = np.random.default_rng(0).uniform(box[0] - room, box[1] + room, (_POINTS, 3))
    return bool(np.abs(one.distance(points) - other.distance(points)).max() < within)


def _with_copies(parts: Sequence[Part], labels: Sequence[int] | None = None) -> list[tuple[int, Part]]:
    """Parts of one label and field as one with instances, each with its label."""
    result: dict[tuple[int, object], Part] = {}
    for label, part in zip(labels or [0] * len(parts), parts, strict=True):
        first = result.get((label, part.field))
        if first is None:
            result[label, part.field] = part
        else:
            move = part.pose @ first.pose.inverse()
            result[label, part.field] = replace(first, instances=(*first.instances, move))
    return [(label, part) for (label, _), part in result.items()]
