"""Trees of quadrics with their convexes as solids that have names, or as extrusions and revolutions: what a
person would have drawn, cleaned, edited and exported as such. What is none of them stays quadrics."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress

import numpy as np

from partwright.approximation.convex_solids import Convex, candidates
from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.assembly.motion import Motion
from partwright.assembly.placed import placed_quadric
from partwright.assembly.repeated_groups import children_once
from partwright.errors import NoSurfaceError
from partwright.fields import Box, Quadric
from partwright.meshing.csg import solid_of
from partwright.meshing.manifolds import surface_of

SAME_VOLUME = 3e-3
"""Of a convex's volume, which may lie in one of the two only."""
_CHORD = 1e-4  # of the convex's longest side, in the meshes that are compared
_ENDS = 0.02  # of the longest side of what it is taken from: how far what has no end goes beyond
_TOUCHED = 1e-5  # of the size: corners that lie on a surface

Room = np.ndarray  # (K, 3) corners of what a node can matter to


def with_named_convexes(assembly: Assembly, stopped: Callable[[], None] = lambda: None) -> Assembly:
    """The same solid. stopped: is asked now and then, and may raise.

    A convex that is cut goes on beyond what it is cut from, by a fiftieth of that.
    """

    def renewed(node: Node, room: Room | None) -> Node:
        stopped()
        if isinstance(node, Part) or _is_convex(node):
            return _named(node, room) or node
        assert isinstance(node, Assembly)
        if node.operation == "intersection":
            return dataclasses.replace(node, children=tuple(renewed(c, None) for c in node.children))
        if node.operation == "union":
            return dataclasses.replace(node, children=tuple(alike(node, 0, room)))
        within = _corners(node.children[0])
        within = room if within is None else within
        first = renewed(node.children[0], room)
        return dataclasses.replace(node, children=(first, *alike(node, 1, within)))

    def alike(node: Assembly, start: int, room: Room | None) -> Iterator[Node]:
        """The children from one on; groups that are copies of one another stay that, whatever they become."""
        for child, motions in children_once(node)[start:]:
            places = room
            if motions and room is not None:  # the first has to do for what each copy is taken from
                places = np.concatenate([room, *(motion.inverse()(room) for motion in motions)])
            yield from _repeated(renewed(child, places), motions)

    result = renewed(assembly, None)
    if isinstance(result, Assembly):
        return result
    unit, up = assembly.unit, assembly.up
    return Assembly((result,), unit=unit, up=up, metadata=assembly.metadata)


def _repeated(node: Node, motions: Sequence[Motion]) -> Iterator[Node]:
    """A node and its copies; of a part, those that a rigid move makes are the part's own."""
    others: list[Node] = []
    moves: list[Similarity] = []
    for motion in motions:
        if isinstance(node, Assembly):
            others.append(motion.of(node))
            continue
        made = motion.of(node)
        if made.field == node.field and not node.instances:
            move = made.pose @ node.pose.inverse()
            moves.append(Similarity(1.0, move.rotation, move.translation))
        else:
            others.append(made)
    yield dataclasses.replace(node, instances=tuple(moves)) if moves and isinstance(node, Part) else node
    yield from others


def _is_convex(node: Assembly) -> bool:
    """Leaves that are quadrics, intersected, or one alone."""
    alone = node.operation == "intersection" or len(node.children) == 1
    return alone and all(
        isinstance(c, Part) and c.field.quadric() is not None and not c.blend for c in node.children
    )


def _named(node: Node, room: Room | None) -> Part | None:
    """The convex as one part of the same place, name and copies; None where it stays as it is."""
    leaves = node.parts
    if any(leaf.field.quadric() is None for leaf in leaves) or leaves[0].blend:
        return None
    copies = leaves[0].instances
    if copies and len(leaves) > 1:
        return None
    if copies and room is not None:  # the first has to do for what each copy is taken from
        room = np.concatenate([room, *(move.inverse()(room) for move in copies)])
    alone = _without_copies(node)
    points = room if room is not None else _corners(alone)
    if points is None:
        return None
    quadrics = [own for leaf in leaves if (own := placed_quadric(leaf)) is not None]
    ends = _ENDS * float(np.ptp(points, axis=0).max())
    box = _box(points, ends / 2)
    found = None
    with suppress(NoSurfaceError):
        found = _same_solid(alone, quadrics, points, ends, box)
    if found is None:
        return None
    name = node.name or leaves[0].name
    return dataclasses.replace(found, name=name, blend=node.blend, metadata=node.metadata, instances=copies)


def _same_solid(alone: Node, quadrics: list[Quadric], points: Room, ends: float, box: Part) -> Part | None:
    """Of the solids that the convex may be, the first that is the same within the box."""
    whole = Assembly((box, alone), "intersection")
    rough = solid_of(whole)
    corners = surface_of(rough)[0]
    size = float(np.ptp(corners, axis=0).max())
    kept = [q for q in quadrics if (np.abs(q(corners)) <= _TOUCHED * size).sum() > 2]
    if not kept:
        return None
    wanted = list(candidates(Convex.of(kept, points, corners.mean(axis=0), size), ends))
    if not wanted:
        return None
    exact = solid_of(whole, _CHORD * size)
    for part in wanted:
        other = solid_of(Assembly((box, part), "intersection"), _CHORD * size)
        if (exact - other).volume() + (other - exact).volume() <= SAME_VOLUME * exact.volume():
            return part
    return None


def _without_copies(node: Node) -> Node:
    return dataclasses.replace(node, instances=()) if isinstance(node, Part) else node


def _corners(node: Node) -> Room | None:
    """(8, 3) of the box around a node; None where it does not end."""
    box = node.bounds()
    if not np.isfinite(box).all() or not (box[1] > box[0]).any():
        return None
    return np.array([[box[i][0], box[j][1], box[k][2]] for i, j, k in np.ndindex(2, 2, 2)])


def _box(points: Room, beyond: float) -> Part:
    low, high = points.min(axis=0) - beyond, points.max(axis=0) + beyond
    return Part(Box(tuple((high - low).tolist())), tuple(((low + high) / 2).tolist()))
