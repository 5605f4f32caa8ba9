"""Names that say what parts of a tree of solids are: a base plate, a boss, a hole, a pocket; and their order,
the base first, then from large to small."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from partwright.approximation.round_roles import is_walled, round_role, round_size
from partwright.approximation.tooth_roles import GAP, is_fin, tooth_role
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.group_copies import in_runs, numbered_names
from partwright.assembly.names import unique_names
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import (
    Box,
    Cone,
    Cylinder,
    Extrusion,
    Field,
    Frustum,
    Pipe,
    Profile,
    Revolution,
    Sphere,
    Swept,
    Tube,
)

FREEFORM = "freeform"
"""What names of parts begin with that are no feature, and keep them."""
_FLAT = 0.3  # a plate's thickness over its next longer side, at most
_LONG = 3.0  # a bar's length over its next shorter side, at least
_BORE = 0.5  # of the narrowest side of what it is in: a hole that is wider is its bore
_HEAD = 1.5  # times a hole's radius: where a screw's head is sunk it is wider, where an edge is broken less
_BEYOND = 1e-3  # of its height: how far outside a hole's ends have to lie
_ACROSS = 9  # points each way across an end


def with_role_names(assembly: Assembly) -> Assembly:
    """The same solid: parts are renamed, and children of unions put in order. Quadrics keep their names."""
    ordered = _ordered(assembly)
    assert isinstance(ordered, Assembly)
    roles: dict[str, str] = {}
    _name(ordered, None, roles)
    added = [part for part in ordered.parts if roles.get(part.name) not in (None, *_CUTS)]
    if added:
        base = max(added, key=_bulk)
        noun = roles[base.name] if round_size(base.field) is None else "cylinder"
        roles[base.name] = f"base_{noun}"
        for part in added:
            if roles[part.name] == "plate" and is_fin(part, [other for other in added if other is not part]):
                roles[part.name] = "fin"
    parts = ordered.parts
    names = unique_names([roles.get(p.name, p.name) for p in parts], [p.field.stem for p in parts])
    fresh = dict(zip((p.name for p in parts), names, strict=True))

    def renamed(node: Node) -> Node:
        if isinstance(node, Part):
            return dataclasses.replace(node, name=fresh[node.name])
        children: list[Node] = []
        for child, copies in in_runs(node):
            own = renamed(child)
            children.append(own)
            if isinstance(child, Assembly) and isinstance(own, Assembly):
                for k, copy in enumerate(copies, start=2):  # groups within are called as in the first
                    known = copy.names or numbered_names(child, k)
                    children.append(
                        dataclasses.replace(copy, names=tuple(fresh[name] for name in known)).of(own, k)
                    )
        first = children[0]
        after = f"{first.name}_cut" if node.operation == "difference" and first.is_part else node.name
        return dataclasses.replace(node, children=tuple(children), name=after)

    result = renamed(ordered)
    assert isinstance(result, Assembly)
    return result


def _ordered(node: Node) -> Node:
    """Children of unions without blends from large to small, those of which that is not known last."""
    if isinstance(node, Part):
        return node
    children = tuple(map(_ordered, node.children))
    if node.operation == "union" and not any(child.blend for child in children):
        children = tuple(sorted(children, key=lambda child: -_bulk(child)))
    return dataclasses.replace(node, children=children)


def _bulk(node: Node) -> float:
    """Of the box around what a node begins with; 0 where that has no end."""
    while isinstance(node, Assembly):
        node = node.children[0]
    lower, upper = node.field.bounds()
    return float(np.prod(upper - lower)) if np.isfinite([lower, upper]).all() else 0.0


_CUTS = (
    "hole", "bolt_hole", "blind_hole", "counterbored_hole", "countersunk_hole", "chamfered_hole",
    "bore", "countersink", "dimple", "groove", "channel", "slot", "opening", "pocket", "island", GAP,
)  # fmt: skip


def _name(node: Node, cut_from: Node | None, roles: dict[str, str], beside: Sequence[Node] = ()) -> None:
    if isinstance(node, Part):
        if _is_solid(node):
            roles[node.name] = tooth_role(node, cut_from, beside) or (
                _cut(node, cut_from, beside) if cut_from else _added(node.field)
            )
        return
    first, *others = node.children
    if node.operation == "difference" and cut_from is not None:
        _name(first, cut_from, roles)  # what is left standing in a cut is an island
        roles.update({part.name: "island" for child in others for part in child.parts if _is_solid(part)})
        return
    if node.operation != "difference":
        for child in node.children:
            _name(child, cut_from, roles)
        return
    _name(first, None, roles)
    for child in others:
        _name(child, first, roles, [other for other in others if other is not child])


def _is_solid(part: Part) -> bool:
    return part.field.quadric() is None and not part.name.startswith(FREEFORM)


def _added(field: Field) -> str:
    low, high = field.bounds()
    short, middle, long = np.sort(high - low).tolist()
    if isinstance(field, Sphere):
        return "ball"
    if isinstance(field, Cone | Frustum):
        return "cone"
    if (size := round_size(field)) is not None:
        return round_role(*size)
    if isinstance(field, Revolution):
        return "turned"
    if isinstance(field, Pipe):
        return "pipe" if field.thickness else "rod"
    if short < _FLAT * middle:
        return "plate"
    return "bar" if long > _LONG * middle else "block"


def _cut(part: Part, cut_from: Node, beside: Sequence[Node]) -> str:
    field = part.field
    if isinstance(field, Sphere):
        return "dimple"
    if isinstance(field, Extrusion) and _is_slot(field.profile):
        return "slot"
    turned = _turned_cut(field.profile) if isinstance(field, Revolution) else None
    if turned == "groove":
        return turned
    if isinstance(field, Pipe):
        return "channel"
    through = _goes_through(part, cut_from, beside)
    round_ = None if _has_core(field) else round_size(field)
    tapers = isinstance(field, Cone | Frustum)
    if (turned or tapers or round_) and is_walled(part, cut_from):
        return "countersink" if tapers else turned or _hole(part, cut_from, through)
    return "opening" if through and isinstance(field, Box | Cylinder | Swept) else "pocket"


def _has_core(field: Field) -> bool:
    """Whether a cut leaves something standing about its axis."""
    return isinstance(field, Tube) or (isinstance(field, Extrusion) and bool(field.profile.holes))


def _hole(part: Part, cut_from: Node, through: bool) -> str:
    """What a round hole of one width is called."""
    if not through:
        return "blind_hole"
    axis, width = rotation_matrix(part.rotation)[:, 2], float(np.ptp(part.field.bounds(), axis=0)[0])
    sides = np.ptp(cut_from.bounds(), axis=0)[np.abs(axis) < math.sqrt(0.5)]
    if len(sides) and width > _BORE * float(sides.min()):
        return "bore"
    return "bolt_hole" if len(part.copies) > 1 else "hole"


def _turned_cut(profile: Profile) -> str:
    """A stepped, tapering or chamfered hole where it reaches the axis, else a groove."""
    outline = [side for side in profile.sides[0] if side.centre is None]
    if not any(side.start[0] == 0 == side.end[0] for side in outline):
        return "groove"
    size = _BEYOND * profile.size
    sloped = [s for s in outline if min(abs(s.end[i] - s.start[i]) for i in (0, 1)) > size]
    cones = [sorted((side.start[0], side.end[0])) for side in sloped]
    if any(wide > _HEAD * narrow > 0 for narrow, wide in cones):
        return "countersunk_hole"
    off_axis = [s for s in outline if min(s.start[0], s.end[0]) > size]
    if any(abs(s.end[1] - s.start[1]) <= size for s in off_axis):
        return "counterbored_hole"
    if any(narrow > 0 for narrow, _ in cones):
        return "chamfered_hole"
    return "blind_hole" if any(abs(s.end[0] - s.start[0]) <= size for s in off_axis) else "dimple"


def _is_slot(profile: Profile) -> bool:
    """Two parallel lines, joined by half a circle at either end."""
    sides = profile.sides[0]
    arcs = [side for side in sides if side.centre is not None]
    lines = [side for side in sides if side.centre is None]
    if profile.holes or len(lines) != 2 or not arcs:
        return False
    turns = sorted(side.sweep for side in arcs)
    one, two = (np.subtract(line.end, line.start) for line in lines)
    parallel = abs(float(one[0] * two[1] - one[1] * two[0])) < _BEYOND * float(np.linalg.norm(one) ** 2)
    return parallel and turns[0] > 0 and abs(sum(turns) - 2 * math.pi) < _BEYOND * 10


def _goes_through(part: Part, cut_from: Node, beside: Sequence[Node]) -> bool:
    """Whether both of its ends lie outside of what it cuts, or all across in what else is cut from that, as
    that of a hole in a pocket's floor does."""
    lower, upper = part.field.bounds()
    inset = _BEYOND * float(upper[2] - lower[2])
    steps = (np.arange(_ACROSS) + 0.5) / _ACROSS
    x, y = (low + steps * (high - low) for low, high in zip(lower[:2], upper[:2], strict=True))
    section = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    frame = rotation_matrix(part.rotation)

    def is_open(z: float) -> bool:
        middle = part.translation + z * frame[:, 2]
        if cut_from.distance(middle[None])[0] > 0:
            return True
        local = np.column_stack([section, np.full(len(section), z)])
        across = local[part.field(local) < 0] @ frame.T + part.translation
        opened = cut_from.distance(across) > 0
        for other in beside:
            opened |= other.distance(across) < 0
        return len(across) > 0 and bool(opened.all())

    return all(is_open(float(z)) for z in (lower[2] + inset, upper[2] - inset))
