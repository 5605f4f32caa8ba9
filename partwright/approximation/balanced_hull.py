"""Convex solids as near to one that is not quite convex as they can be: hulls, with planes moved inwards.

A hull bridges what is concave, as the chord of a ring's segment its hole. Cut off to the right depth such a
face adds half as much and lacks about as much: the sum of both is what counts. What another hull has anyway
is neither added nor lost. Nor does a cut take off what sticks out, a lug say, though that may be little
volume: what it takes of the solid reaches no farther than half of what the hull bridges, or the tolerance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.convex_piece import Piece
from partwright.approximation.cutting_planes import Plane
from partwright.approximation.half_space import Surface
from partwright.approximation.hull_faces import faces_of
from partwright.approximation.light_hull import plain_hull
from partwright.approximation.piece_joining import boxes_touch
from partwright.meshing.manifolds import surface_of
from partwright.shapes.topology import area_vectors

if TYPE_CHECKING:
    from manifold3d import Manifold
    from scipy.spatial import KDTree

_FACES = 12  # of a hull, those that bridge most, that are tried
_DENTS = 6  # concave places, the largest, across whose openings a plane is tried
_CUTS = 16  # of a hull, at most
_DEPTHS = 2.0 ** np.arange(-7, 1)  # of the deepest, that are tried
_REFINED = 9  # depths tried between the neighbours of the best one
_KEPT = 0.5  # of what only one hull has of the solid, at least
_REACH = 0.5  # of the depth to which a hull bridges: how far beyond a cut the solid may reach
_WORTH = 5e-4  # of that: what gains less stays
_TILTS = (0.2, 0.1, 0.05, 0.025)  # radians, by which the best plane is turned
_TURNS = np.arange(6) * (np.pi / 3)
_SAME = 1e-4  # of normals, and of offsets over the size, of the same plane
_PROBES = 1000  # corners that tell how deep a hull bridges


def balanced_hulls(pieces: Sequence[Piece], solid: Manifold, deepest: float) -> list[Manifold]:
    """The hulls of a solid's pieces, cut by planes where that adds less than it loses; to a depth of
    `deepest`, a length, or as deep as the hull bridges; that, or half of it, is also how far what they lose
    may reach."""
    hulls = [piece.hull for piece in pieces]
    near = [
        [k for k, other in enumerate(pieces) if k != i and boxes_touch(other.box, one.box)]
        for i, one in enumerate(pieces)
    ]
    for i in sorted(range(len(pieces)), key=lambda i: -pieces[i].extra):
        piece = pieces[i]
        if piece.extra > _WORTH * piece.solid.volume():
            plain = plain_hull(hulls[i])
            alone = _without(plain, [hulls[k] for k in near[i]])
            balanced = _balanced(plain, alone, alone - solid, deepest)
            hulls[i] = hulls[i] if balanced is plain else balanced
    return hulls


def _without(solid: Manifold, others: Sequence[Manifold]) -> Manifold:
    from manifold3d import Manifold, OpType

    return Manifold.batch_boolean([solid, *others], OpType.Subtract)


def _balanced(hull: Manifold, alone: Manifold, extra: Manifold, deepest: float) -> Manifold:
    """alone: what no other hull has; extra: what of that is not the solid's."""
    own = alone.volume() - extra.volume()
    least, spare = _WORTH * own, (1 - _KEPT) * own
    if extra.volume() <= least:
        return hull
    directions = _directions(hull, extra)
    corners = surface_of(hull)[0]
    depth = _depth(hull, extra)
    own_corners, reach = surface_of(alone - extra)[0], max(deepest, _REACH * depth)
    deepest = max(deepest, depth)
    gains = np.full(len(directions), np.inf)
    for _ in range(_CUTS):
        bodies = _Bodies(Surface.of(alone), Surface.of(extra), spare, corners, deepest, own_corners, reach)
        fresh = np.zeros(len(directions), bool)
        while not fresh[best := int(gains.argmax())] and gains[best] > least:
            gains[best] = bodies.best(directions[best], least)[0]
            fresh[best] = True
        if gains[best] <= least:
            break
        normal, offset = bodies.tilted(directions[best])
        inward = tuple((-normal).tolist())
        hull, alone, extra = (one.trim_by_plane(inward, -offset) for one in (hull, alone, extra))
        spare = alone.volume() - extra.volume() - _KEPT * own
    return hull


@dataclass(frozen=True)
class _Bodies:
    """What a cut takes volume from, and how much of the solid's own it may take. corners (V, 3): of the hull
    before any cut; deepest: how far below them a plane may lie. own (W, 3): of what only this hull has of the
    solid; reach: how far below these."""

    alone: Surface
    extra: Surface
    spare: float
    corners: np.ndarray
    deepest: float
    own: np.ndarray
    reach: float

    def tilted(self, normal: np.ndarray) -> Plane:
        """The plane near to one of this normal (3,) that gains most, by steps that halve."""
        gain, offset = self.best(normal, 0.0)
        for step in _TILTS:
            across = np.linalg.svd(normal[None])[2][1:]
            turned = [normal + step * (np.cos(t) * across[0] + np.sin(t) * across[1]) for t in _TURNS]
            tried = [one / np.linalg.norm(one) for one in turned]
            found = [self.best(one, gain) for one in tried]
            at = int(np.argmax([one[0] for one in found]))
            if found[at][0] > gain:
                normal, (gain, offset) = tried[at], found[at]
        return normal, offset

    def best(self, normal: np.ndarray, least: float) -> tuple[float, float]:
        """What a cut gains at most, volume that is no longer added less what is lost, and the offset at which
        it does; looked for where it may be more than `least`."""
        top = float((self.corners @ normal).max())
        deepest = min(self.deepest, top - float((self.own @ normal).max(initial=-np.inf)) + self.reach)
        most = float(self.extra.beyond(normal, np.array([top - deepest]))[0])
        if most <= least:
            return min(most, least), top
        depths = deepest * _DEPTHS
        gains = self.gains(normal, top - depths)
        at = int(gains.argmax())
        around = np.concatenate([[0.0], depths, depths[-1:]])[at : at + 3]
        finer = np.linspace(around[0], around[-1], _REFINED)
        depths, gains = np.append(depths, finer), np.append(gains, self.gains(normal, top - finer))
        at = int(gains.argmax())
        return float(gains[at]), top - float(depths[at])

    def gains(self, normal: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        added = self.extra.beyond(normal, offsets)
        lost = self.alone.beyond(normal, offsets) - added
        return np.where(lost <= self.spare, added - lost, -np.inf)


def _directions(hull: Manifold, extra: Manifold) -> np.ndarray:
    """(D, 3) unit normals: of the hull's faces that bridge most, and the mean ones across the openings of the
    largest dents."""
    planes = _Planes.of(hull)
    found = [planes.bridging(extra)]
    dents = sorted(extra.decompose(), key=lambda dent: -dent.volume())[:_DENTS]
    found += [planes.bridging(dent).sum(axis=0, keepdims=True) for dent in dents]
    rows = np.concatenate([found[0][np.argsort(-np.linalg.norm(found[0], axis=1))[:_FACES]], *found[1:]])
    length = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[length[:, 0] > 0] / length[length[:, 0] > 0]
    return rows[np.sort(np.unique(np.round(rows, 4), axis=0, return_index=True)[1])]


@dataclass(frozen=True)
class _Planes:
    """Of a hull's faces: normals (F, 3), offsets (F,), and a tree of both, offsets over the size."""

    normals: np.ndarray
    middle: np.ndarray
    size: float
    tree: KDTree

    @classmethod
    def of(cls, hull: Manifold) -> _Planes:
        from scipy.spatial import KDTree

        normals, offsets = faces_of(hull)
        corners = surface_of(hull)[0]
        middle, size = corners.mean(axis=0), float(np.ptp(corners, axis=0).max())
        rows = np.column_stack([normals, (offsets - normals @ middle) / size])
        return cls(normals, middle, size, KDTree(rows))

    def bridging(self, extra: Manifold) -> np.ndarray:
        """(F, 3) for each face its normal times the area of it that has something extra below it."""
        vertices, faces = surface_of(extra)
        corners = (vertices[faces] - self.middle) / self.size
        cross = area_vectors(corners)
        length = np.linalg.norm(cross, axis=1)
        normal = np.divide(cross, length[:, None], out=np.zeros_like(cross), where=length[:, None] > 0)
        rows = np.column_stack([normal, np.einsum("ij,ij->i", normal, corners[:, 0])])
        away, face = self.tree.query(rows, distance_upper_bound=_SAME)
        on = np.isfinite(away)
        area = np.bincount(face[on], length[on], minlength=len(self.normals))
        return self.normals * area[:, None]


def _depth(hull: Manifold, extra: Manifold) -> float:
    """How far below the hull's surface what it adds reaches."""
    normals, offsets = faces_of(hull)
    corners = surface_of(extra)[0]
    corners = corners[:: max(1, len(corners) // _PROBES)]
    return float((offsets - corners @ normals.T).min(axis=1).max(initial=0.0))
