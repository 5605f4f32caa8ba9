"""A closed solid as few convex ones that cover it: cut by planes, then joined again where that costs little.

What is spent is volume: a piece is as bad as what its hull adds to it. Planes come from the solid itself:
from the faces beside its concave edges, and across its principal axes. A cut through a ring gains nothing
before the second one does, so where no cut gains anything the one whose halves can be cut best is taken.
Other decompositions go by the depth of pockets (Wei et al., CoACD, 2022; Mamou, V-HACD, 2016); here depth is
a limit, not the aim.
"""

from __future__ import annotations

import heapq
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_piece import Limits, Piece
from partwright.approximation.cutting_planes import (
    Corners,
    Plane,
    across_axes,
    beside_concave_edges,
    candidates,
    moved,
)
from partwright.approximation.hull_faces import beyond_faces, faces_of
from partwright.approximation.light_hull import plain_hull
from partwright.approximation.piece_boundaries import with_moved_boundaries
from partwright.approximation.piece_joining import exchanged, joined, spent
from partwright.meshing.manifolds import surface_of
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    from manifold3d import Manifold

_EXACT = 5  # candidates whose pieces are really made
_MOVED = 2  # of these, the best, that are moved and turned to where less is left
_LOOKED_AT, _MADE = 6, 3  # planes of faces that are tried and really cut along, where one cut gains nothing
_TRIES, _CHANGED = 7, 0.005  # of simplifying, and the share of the volume that it may change
_FINER = 2  # times, from one try to the next
_CHEAP = 5000  # triangles: a copy with no more of them is finer than it need be
_FEW_PLANES = 8  # beside concave edges: a solid of no more flat walls is taken apart by them
_ASIDE = 1e-10  # of the size: what is left begins beside a face, of which a cut in its plane may leave a film
_GAIN = 0.03  # of what a hull adds: a cut that takes less off it looks one cut ahead
_SLIVER = 1e-5  # of the whole volume: pieces below it are left out
_COARSE = 0.05  # of the tolerance: how far the copy that is searched may lie from the solid


def convex_cover(solid: Manifold, limits: Limits) -> list[Piece]:
    """Pieces whose hulls together cover the solid: as few as keep the limits, as far as they are found.

    solid: closed, of any number of bodies. Slivers are left out, but none that reaches farther than the
    allowed deviation from all the rest: a speck may be all that there is at its place.
    """
    pieces = _cut_up(solid, limits)
    pieces += _far_off(solid, pieces, limits.deviation)
    least = _SLIVER * solid.volume()
    bridged = sum(body.extra for body in _components(solid, least))
    pieces = joined(pieces, solid.volume(), bridged, limits)

    @cache
    def cut(piece: Piece) -> list[Piece]:
        return _best_cut(piece, least)

    pieces = exchanged(spent(pieces, bridged, limits, cut), limits, cut)
    return with_moved_boundaries(pieces, solid.volume())


def simplified(solid: Manifold, deviation: float) -> Manifold:
    """With fewer triangles, for a search that allows this deviation (a length), as far as that leaves its
    volume alone: walls may be thinner than what is allowed. As fine as few triangles allow: what is cut off
    here, no hull has again. A body that would vanish stays as it is."""
    from manifold3d import Manifold, OpType

    own, by, found = solid.volume(), _COARSE * deviation, solid
    bodies = solid.decompose()
    for _ in range(_TRIES):
        simple = solid.simplify(by)
        if lost := [body for body in bodies if len(bodies) > 1 and body.simplify(by).is_empty()]:
            simple = Manifold.batch_boolean([simple, *lost], OpType.Add)
        if found is not solid and simple.num_tri() > _CHEAP:
            break
        if abs(simple.volume() - own) <= _CHANGED * own:
            found = simple
        by /= _FINER
    return found


def _far_off(solid: Manifold, pieces: list[Piece], deviation: float) -> list[Piece]:
    """What no hull has and is farther than a length from all of them."""
    from manifold3d import Manifold, OpType

    if not _sticks_out(solid, pieces, deviation / 2):
        return []
    hulls = Manifold.batch_boolean([piece.hull for piece in pieces], OpType.Add)
    left = [part for part in (solid - hulls).decompose() if part.volume() > 0]
    if hulls.is_empty():
        return [Piece(part) for part in left]
    vertices, faces = surface_of(hulls)
    middle, scale = vertices.mean(axis=0), 1.0 / float(np.ptp(vertices, axis=0).max())
    there = MeshDistance((vertices - middle) * scale, faces, faces, True)

    def reach(part: Manifold) -> float:
        points = surface_of(part)[0]
        return float(there.unsigned((points - middle) * scale).max()) / scale

    return [Piece(part) for part in left if reach(part) > deviation]


def _sticks_out(solid: Manifold, pieces: list[Piece], by: float) -> bool:
    """Whether a corner is farther out than a length of one face of each hull."""
    corners = surface_of(solid)[0]
    for piece in sorted(pieces, key=lambda piece: -piece.hull.volume()):
        normals, offsets = faces_of(plain_hull(piece.hull))
        lower, upper = piece.box
        near = ((corners >= lower - by) & (corners <= upper + by)).all(axis=1)
        near[near] = beyond_faces(corners[near], normals, offsets) <= by
        corners = corners[~near]
    return len(corners) > 0


def halved(piece: Piece) -> list[list[Piece]]:
    """What a piece is cut into across the middle of each of its principal axes."""
    least = _SLIVER * piece.solid.volume()
    cut = [_cut(piece, normal, offset, least) for normal, offset in across_axes(piece.corners)[:3]]
    return [parts for parts in cut if len(parts) > 1]


def _cut_up(solid: Manifold, limits: Limits) -> list[Piece]:
    """Pieces that are cut, the worst one first, until all hulls keep the limits."""
    least = _SLIVER * solid.volume()
    allowed = limits.extra * solid.volume()
    done: list[Piece] = []
    open_: list[tuple[float, int, Piece]] = []
    count = 0

    def take(piece: Piece) -> None:
        nonlocal count
        count += 1
        if piece.extra <= least:
            done.append(piece)
        else:
            heapq.heappush(open_, (-piece.extra, count, piece))

    for part in _components(solid, least):
        take(part)
    most = 2 * limits.most  # joining comes after
    while open_ and len(done) + len(open_) < most:
        total = sum(-entry[0] for entry in open_)
        piece = heapq.heappop(open_)[2]
        if total <= allowed and piece.within(limits.deviation):
            done.append(piece)
            continue
        parts = _best_cut(piece, least)
        if len(parts) < 2:
            done.append(piece)
            continue
        for part in parts:
            take(part)
    return done + [entry[2] for entry in open_]


def _components(solid: Manifold, least: float) -> list[Piece]:
    return [Piece(part) for part in solid.decompose() if part.volume() > least]


def _best_cut(piece: Piece, least: float) -> list[Piece]:
    """The pieces that the best plane makes of one."""
    corners = piece.corners
    planes = candidates(corners)
    whole = piece.hull.volume()
    if not planes:
        return [piece]
    left = corners.hulls(planes)
    order = np.argsort(np.round(left / whole, 6), kind="stable")[:_EXACT]  # the earlier ones are plainer
    chosen = [planes[index] for index in order]
    chosen += [better for plane in chosen[:_MOVED] if (better := moved(corners, plane)) is not plane]
    best, parts = _GAIN * piece.extra, [piece]
    for normal, offset in chosen:
        made = _cut(piece, normal, offset, least)
        gain = (whole - sum(one.hull.volume() for one in made)) / max(len(made) - 1, 1)
        if len(made) > 1 and gain > best + 1e-6 * whole:
            best, parts = gain, made
    if len(parts) > 1:
        return parts
    return _largest_taken_off(piece, least) or _ahead(piece, least) or [piece]


def _largest_taken_off(piece: Piece, least: float) -> list[Piece]:
    """The cut along a face beside concave edges that takes off most of what is convex as it is, where few
    faces are beside any: of an open box wall by wall, though no hull is less before the third is off."""
    planes = beside_concave_edges(piece.corners)
    aside = _ASIDE * piece.corners.size
    best, chosen = 0.0, []
    for normal, offset in planes if len(planes) <= _FEW_PLANES else ():
        convex, rest = [], []
        for side in (1, -1):
            inward, place = tuple((-side * normal).tolist()), -side * offset
            half, less = (piece.solid.trim_by_plane(inward, place + by) for by in (0.0, aside))
            convex += [one for one in _components(half, least) if one.extra <= least]
            rest += [one for one in _components(less, least) if one.extra > least]
        taken = sum(one.solid.volume() for one in convex)
        if len(convex) + len(rest) > 1 and taken > best:
            best, chosen = taken, [*rest, *convex]
    return chosen


def _ahead(piece: Piece, least: float) -> list[Piece]:
    """The cut whose pieces are best cut again, of a few; of those that are alike the plainest."""
    best, chosen = np.inf, []
    for normal, offset in _few(piece.corners):
        made = _cut(piece, normal, offset, least)
        if len(made) < 2:
            continue
        left = sum(_after_a_cut(one, least) for one in made)
        if left < best - 1e-6 * piece.hull.volume():
            best, chosen = left, made
    return chosen


def _after_a_cut(piece: Piece, least: float) -> float:
    """Volume of the hulls after the best further cut, of a few; the plainest are really made, and may fall
    apart."""
    few = _few(piece.corners)
    known = [piece.hull.volume(), *piece.corners.hulls(few).tolist()]
    for normal, offset in few[:_MADE]:
        known.append(sum(one.hull.volume() for one in _cut(piece, normal, offset, least)))
    return min(known)


def _few(corners: Corners) -> list[Plane]:
    return [*beside_concave_edges(corners)[:_LOOKED_AT], *across_axes(corners)]


def _cut(piece: Piece, normal: np.ndarray, offset: float, least: float) -> list[Piece]:
    sides = piece.solid.split_by_plane(tuple(normal.tolist()), float(offset))
    return [one for side in sides if not side.is_empty() for one in _components(side, least)]
