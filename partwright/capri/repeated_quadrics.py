"""Holes of one size and one direction are one leaf with a copy at each place: drilled once, edited once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.assembly.similarity import NO_ROTATION, ORIGIN
from partwright.fields import NormalForm, Quadric, normal_form

TOLERANCE = 1e-3  # unit frame: by how much sizes differ that count as one; of axes, the angle


def with_repeats(node: Assembly) -> Assembly:
    """The tree (unit frame) with quadrics that are added or subtracted alike as copies of one another.

    Cylinders, spheres and cones of one size and direction get their mean size and direction; places stay.
    """
    children = tuple(with_repeats(child) if isinstance(child, Assembly) else child for child in node.children)
    if node.operation == "union":
        return replace(node, children=_merged(children))
    if node.operation == "difference":
        return replace(node, children=(children[0], *_merged(children[1:])))
    return replace(node, children=children)


@dataclass
class _Group:
    """Quadrics alike: the first one's place among its siblings, and of each the form, its size and place."""

    first: int
    name: str
    axis: NDArray[np.float64]
    sizes: list[float] = field(default_factory=list)
    axes: list[NDArray[np.float64]] = field(default_factory=list)
    places: list[NDArray[np.float64]] = field(default_factory=list)

    def takes(self, form: NormalForm) -> bool:
        if form.name != self.name or abs(_size(form) - self.sizes[0]) > TOLERANCE:
            return False
        return self.name == "sphere" or bool(
            np.linalg.norm(np.cross(form.axes[:, 2], self.axis)) <= TOLERANCE
        )

    def add(self, form: NormalForm) -> None:
        axis = form.axes[:, 2]
        self.sizes.append(_size(form))
        self.axes.append(axis if axis @ self.axis > 0 else -axis)
        self.places.append(form.centre)

    def leaf(self, like: Part) -> Part:
        """One part for all, at the place of the first."""
        axis, size = np.mean(self.axes, axis=0), float(np.mean(self.sizes))
        axis /= np.linalg.norm(axis)
        moves = np.array(self.places[1:]) - self.places[0]
        if self.name == "cylinder":  # it has no end: no copy need be moved along it
            moves -= (moves @ axis)[:, None] * axis
        copies = tuple(Similarity(translation=tuple(move.tolist())) for move in moves)
        return replace(like, field=_MAKERS[self.name](size, axis, self.places[0]), instances=copies)


def _merged(children: Sequence[Node]) -> tuple[Node, ...]:
    groups: list[_Group] = []
    of: dict[int, _Group] = {}
    for i, child in enumerate(children):
        form = _form(child)
        if form is None:
            continue
        group = next((g for g in groups if g.takes(form)), None)
        if group is None:
            group = _Group(i, form.name, form.axes[:, 2])
            groups.append(group)
        group.add(form)
        of[i] = group
    result: list[Node] = []
    for i, child in enumerate(children):
        group = of.get(i)
        if group is None or len(group.places) == 1:
            result.append(child)
        elif group.first == i:
            result.append(group.leaf(_only(child)))
    return tuple(result)


def are_repeats(one: Node, other: Node) -> bool:
    """Whether two nodes, added or subtracted side by side, become one leaf."""
    form, form_of_other = _form(one), _form(other)
    if form is None or form_of_other is None:
        return False
    group = _Group(0, form.name, form.axes[:, 2])
    group.add(form)
    return group.takes(form_of_other)


def _only(node: Node) -> Part:
    """The leaf that a node is, alone in its convex or not."""
    while isinstance(node, Assembly):
        (node,) = node.children
    return node


def _form(node: Node) -> NormalForm | None:
    """Of a round quadric that is a node's only leaf."""
    if isinstance(node, Assembly) and len(node.children) == 1:
        return _form(node.children[0])
    quadric = node.field.quadric() if node.is_part else None
    if not node.is_part or quadric is None:
        return None
    if node.instances or node.translation != ORIGIN or node.rotation != NO_ROTATION:
        return None  # repeated already, further down; a tree's own leaves lie where their quadric does
    form = normal_form(quadric)
    return form if form.name in _MAKERS and form.round and not form.complement else None


def _size(form: NormalForm) -> float:
    """Radius, or the slope of a cone."""
    return form.widening if form.name == "cone" else float(form.radii[0])


_MAKERS: dict[str, Callable[..., Quadric]] = {  # of a size, an axis and a place
    "sphere": lambda size, _, place: Quadric.sphere(size, place),
    "cylinder": Quadric.cylinder,
    "cone": Quadric.cone,
}
