"""A closed solid as few convex ones that cover it: cut by planes, then joined again where that costs little.

What is spent is volume: a piece is as bad as what its hull adds to it. Planes come from the solid itself:
from the faces beside its concave edges, and across its principal axes. A cut through a ring gains nothing
before the second one does, so where no cut gains anything the one whose halves can be cut best is taken.
Other decompositions go by the depth of pockets (Wei et al., CoACD, 2022; Mamou, V-HACD, 2016); here depth is
a limit, not the aim.
"""

from __future__ import annotations

import heapq
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_piece import Limits, Piece
from partwright.approximation.cutting_planes import (
    Corners,
    Plane,
    across_axes,
    beside_concave_edges,
    candidates,
)
from partwright.approximation.piece_joining import exchanged, joined
from partwright.meshing.manifolds import surface_of
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    from manifold3d import Manifold

_EXACT = 5  # candidates whose pieces are really made
_LOOKED_AT, _MADE = 6, 3  # planes of faces that are tried and really cut along, where one cut gains nothing
_TRIES, _CHANGED = 4, 0.005  # of simplifying, and the share of the volume that it may change
_GAIN = 0.03  # of what a hull adds: a cut that takes less off it looks one cut ahead
_SLIVER = 1e-5  # of the whole volume: pieces below it are left out
_COARSE = 0.05  # of the tolerance: how far the search's own copy of the solid may lie from it


def convex_cover(solid: Manifold, limits: Limits) -> list[Piece]:
    """Pieces whose hulls together cover the solid: as few as keep the limits, as far as they are found.

    solid: closed, of any number of bodies. Slivers are left out, but none that reaches farther than the
    allowed deviation from all the rest: a speck may be all that there is at its place.
    """
    coarse = _simplified(solid, _COARSE * limits.deviation)
    pieces = _cut_up(coarse, limits)
    pieces += _far_off(solid, pieces, limits.deviation)
    pieces = joined(pieces, coarse.volume(), limits)
    least = _SLIVER * coarse.volume()
    return exchanged(pieces, limits, lambda piece: _best_cut(piece, least))


def _far_off(solid: Manifold, pieces: list[Piece], deviation: float) -> list[Piece]:
    """What no hull has and is farther than a length from all of them."""
    from manifold3d import Manifold, OpType

    hulls = Manifold.batch_boolean([piece.hull for piece in pieces], OpType.Add)
    left = [part for part in (solid - hulls).decompose() if part.volume() > 0]
    if hulls.is_empty():
        return [Piece(part) for part in left]
    mesh = hulls.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)[:, :3]
    faces = np.asarray(mesh.tri_verts, dtype=np.int64)
    middle, scale = vertices.mean(axis=0), 1.0 / float(np.ptp(vertices, axis=0).max())
    there = MeshDistance((vertices - middle) * scale, faces, faces, True)

    def reach(part: Manifold) -> float:
        points = np.asarray(part.to_mesh64().vert_properties)[:, :3]
        return float(there.unsigned((points - middle) * scale).max()) / scale

    return [Piece(part) for part in left if reach(part) > deviation]


def halved(piece: Piece) -> list[list[Piece]]:
    """What a piece is cut into across the middle of each of its principal axes."""
    least = _SLIVER * piece.solid.volume()
    cut = [_cut(piece, normal, offset, least) for normal, offset in across_axes(piece.corners)[:3]]
    return [parts for parts in cut if len(parts) > 1]


def faces_of(hull: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Outward unit normals (F, 3) and offsets (F,) of a convex solid's faces, each plane once.

    Each plane is moved out to the farthest corner, so that slivers, whose normals are rounding, cut nothing
    off.
    """
    corners, faces = surface_of(hull)
    a, b, c = corners[faces.T]
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals[length[:, 0] > 0] / length[length[:, 0] > 0]
    _, first = np.unique(np.round(normals, 9), axis=0, return_index=True)
    normals = normals[np.sort(first)]
    return normals, (corners @ normals.T).max(axis=0)


def _simplified(solid: Manifold, by: float) -> Manifold:
    """With fewer triangles, as far as that leaves its volume alone: walls may be thinner than what is
    allowed."""
    own = solid.volume()
    for _ in range(_TRIES):
        simple = solid.simplify(by)
        if abs(simple.volume() - own) <= _CHANGED * own:
            return simple
        by /= 4
    return solid


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
        if total <= allowed and piece.deviation(limits.deviation) <= limits.deviation:
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
    left = np.array([corners.hulls(normal, offset) for normal, offset in planes])
    if not len(left):
        return [piece]
    order = np.argsort(np.round(left / whole, 6), kind="stable")[:_EXACT]  # the earlier ones are plainer
    best, parts = _GAIN * piece.extra, [piece]
    for index in order:
        normal, offset = planes[index]
        made = _cut(piece, normal, offset, least)
        gain = (whole - sum(one.hull.volume() for one in made)) / max(len(made) - 1, 1)
        if len(made) > 1 and gain > best + 1e-6 * whole:
            best, parts = gain, made
    if len(parts) > 1:
        return parts
    return _ahead(piece, least) or [piece]


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
    known = [piece.hull.volume(), *(piece.corners.hulls(normal, offset) for normal, offset in few)]
    for normal, offset in few[:_MADE]:
        known.append(sum(one.hull.volume() for one in _cut(piece, normal, offset, least)))
    return min(known)


def _few(corners: Corners) -> list[Plane]:
    return [*beside_concave_edges(corners)[:_LOOKED_AT], *across_axes(corners)]


def _cut(piece: Piece, normal: np.ndarray, offset: float, least: float) -> list[Piece]:
    sides = piece.solid.split_by_plane(tuple(normal.tolist()), float(offset))
    return [one for side in sides if not side.is_empty() for one in _components(side, least)]
