"""An assembly as CAD formats can hold it: exact solids, sharp edges, every copy a part of its own or a loop.

Parts that are no exact solid become the nearest one, blends are dropped, parts without volume are left out;
each such change is listed for FILE.report.json.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from partwright.approximation.change import Change, of_part
from partwright.approximation.closed_quadrics import closes_alike, with_closed_quadrics
from partwright.approximation.nearest import SOLIDS, Approximation, nearest_solid
from partwright.assembly import Assembly, Node, Part
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import (
    Cone,
    Cylinder,
    Field,
    Frustum,
    HollowBox,
    HollowFrustum,
    Pipe,
    SuperFrustum,
    Swept,
    Tube,
)

_LOOPED: tuple[type[Field], ...] = (*SOLIDS, HollowBox, HollowFrustum, SuperFrustum)
HOLE = "_hole"
"""After the name of a hollow part: its hole, where that is a part of its own."""
Keep = Callable[[Part], Approximation | None]


def _looped(part: Part) -> bool:
    """Whether its repeats stay repeats in a source."""
    return type(part.field) in _LOOPED or isinstance(part.field, Swept | Pipe) or closes_alike(part)


def _keep_none(_: Part) -> None:
    return None


def solid_tree(
    assembly: Assembly, keep: Keep = _keep_none, length: float = 1.0, source: bool = False
) -> tuple[Assembly, list[Change]]:
    """The assembly of exact solids alone, with no blend, and what was changed for it.

    keep: the part as the format holds it though it is none of the named solids, if it does.
    length: of the assembly's unit of length in the unit that changes are to be told in.
    source: for a program's source, which can say it: repeated and hollow solids stay one part.

    Raises:
        NoSurfaceError: no part has a volume, so nothing would be left.
        ParameterError: a part's field has no solid near it.
    """
    changes: list[Change] = []
    if source:
        whole: Node = with_closed_quadrics(_expanded_but(assembly, _looped))
    else:
        whole = _with_holes(with_closed_quadrics(assembly.expanded()))
    tree = _solid(whole, True, keep, length, changes)
    if tree is None:
        raise NoSurfaceError("nothing to export: no part of the assembly has a volume")
    return tree, changes  # type: ignore[return-value]  # an assembly stays one


def _solid(node: Node, first: bool, keep: Keep, length: float, changes: list[Change]) -> Node | None:
    blend = 0.0 if first else node.blend * length
    if isinstance(node, Part):
        return _leaf(node, blend, keep, length, changes)
    if blend:
        changes.append(Change(tuple(p.name for p in node.parts), "sharp edges", blend_dropped=blend))
    solids = [_solid(child, i == 0, keep, length, changes) for i, child in enumerate(node.children)]
    if solids[0] is None and node.operation == "difference":
        return None
    if None in solids and node.operation == "intersection":
        return None
    children = tuple(solid for solid in solids if solid is not None)
    return dataclasses.replace(node, children=children, blend=0.0) if children else None


def _leaf(part: Part, blend: float, keep: Keep, length: float, changes: list[Change]) -> Part | None:
    try:
        near = keep(part) or _nearest(part)
    except NoSurfaceError:
        changes.append(Change((part.name,), "nothing", note="it has no volume"))
        return None
    changes += filter(None, [of_part(part, near, blend, length)])
    return dataclasses.replace(near.part_with_solid, field=_plain(near.solid), blend=0.0)


def _nearest(part: Part) -> Approximation:
    if not np.isfinite(part.field.bounds()).all():
        raise ParameterError(
            f"part {part.name!r} is a quadric without end that no solid of this format is like; "
            "export STEP, OpenSCAD or a mesh instead"
        )
    return nearest_solid(part)


def _with_holes(node: Node) -> Node:
    """Hollow boxes and frusta as what they are outside, minus their hole."""
    if isinstance(node, Assembly):
        return dataclasses.replace(node, children=tuple(_with_holes(child) for child in node.children))
    if not isinstance(node.field, HollowBox | HollowFrustum):
        return node
    outer, hole = node.field.pieces()
    whole = dataclasses.replace(node, field=outer, blend=0.0)
    cut = dataclasses.replace(node, field=hole, blend=0.0, name=f"{node.name}{HOLE}")
    return Assembly((whole, cut), operation="difference", blend=node.blend)


def _plain(solid: Field) -> Field:
    """A frustum that tapers not at all, or to a point, under its own name: CAD kernels tell them apart."""
    if isinstance(solid, Frustum) and solid.top_radius == solid.bottom_radius:
        return Cylinder(solid.bottom_radius, solid.height)
    if isinstance(solid, Frustum) and solid.top_radius == 0:
        return Cone(solid.bottom_radius, solid.height)
    if isinstance(solid, HollowFrustum) and solid.top_radius == solid.bottom_radius:
        return Tube(solid.bottom_radius, solid.thickness, solid.height)
    return solid


def _expanded_but(assembly: Assembly, stays: Callable[[Part], bool]) -> Assembly:
    """The assembly with repeated parts as parts of their own, but for those that may stay repeated."""

    def expand(node: Node) -> Node:
        if isinstance(node, Assembly):
            return dataclasses.replace(node, children=tuple(expand(child) for child in node.children))
        if not node.instances or stays(node):
            return node
        return Assembly(node.copies, blend=node.blend)

    result = expand(assembly)
    assert isinstance(result, Assembly)
    return result
