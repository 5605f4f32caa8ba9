"""A large convex solid within one that is not convex.

From a point deep inside, planes are laid through what is nearest of all that is outside, until nothing
outside is left between them; nearest as seen by an ellipsoid, at first of the piece's own proportions, then
of those of what was found (after IRIS, Deits and Tedrake 2015; theirs is the largest ellipsoid within).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import surface_of
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    from manifold3d import Manifold

_TICKS = 12  # a side of the lattice on which the deepest point is looked for
_SPACING = 1 / 40  # of the size: between points on the surface of what is outside
_FACES = 64  # planes at most
_ROUNDS = 4


def inscribed(hull: Manifold, solid: Manifold, about: Manifold | None = None) -> Manifold:
    """The hull, cut back until next to nothing of it is outside of the solid.

    about: it is begun at the deepest point of this; of what hull and solid have in common if not given.
    Points on the surface of what is outside are kept out, so what lies between them may stay in by a hair.
    """
    outside, common = hull - solid, hull ^ solid
    if outside.is_empty() or outside.volume() <= 0 or common.is_empty() or common.volume() <= 0:
        return hull
    size = float(np.ptp(surface_of(hull)[0], axis=0).max())
    away = surface_of(outside.refine_to_length(_SPACING * size))[0]
    best = _between(hull, away, deepest(about or common), hull, size)
    for _ in range(_ROUNDS):
        if best.is_empty():
            break
        found = _between(hull, away, surface_of(best)[0].mean(axis=0), best, size)
        if found.volume() <= best.volume():
            break
        best = found
    return best


def filled(hulls: Sequence[Manifold], solid: Manifold, most: int, least: float) -> list[Manifold]:
    """Convex solids within a solid, and more of them in what they leave of it, the largest piece first.

    most: of all. least: volume that each one more has to gain.
    """
    from manifold3d import Manifold, OpType

    found = list(hulls)
    waiting = (solid - Manifold.batch_boolean(found, OpType.Add)).decompose()
    while waiting and len(found) < most:
        piece = waiting.pop(max(range(len(waiting)), key=lambda i: waiting[i].volume()))
        if piece.volume() < least:
            break
        made = inscribed(hull_of(surface_of(piece)[0]), solid, piece)
        if (made ^ piece).volume() >= least:
            found.append(made)
            waiting += (piece - made).decompose()
        else:
            waiting += [part for half in _halves(piece) for part in half.decompose()]
    return found


def _halves(solid: Manifold) -> tuple[Manifold, Manifold]:
    """On either side of the middle of its longest side."""
    lower, upper = np.reshape(solid.bounding_box(), (2, 3))
    axis = int((upper - lower).argmax())
    normal = tuple(np.eye(3)[axis].tolist())
    return solid.split_by_plane(normal, float(lower[axis] + upper[axis]) / 2)


def _between(hull: Manifold, away: np.ndarray, seed: np.ndarray, like: Manifold, size: float) -> Manifold:
    """What is left of the hull around the seed when points (N, 3) are kept out, the nearest first; `like` has
    the proportions of the ellipsoid that says so."""
    ellipsoid = np.linalg.inv(np.cov(surface_of(like)[0].T) + 1e-9 * size**2 * np.eye(3))
    away = away - seed
    away = away[np.argsort(np.einsum("ni,ij,nj->n", away, ellipsoid, away))]
    for _ in range(_FACES):
        if not len(away):
            break
        normal = ellipsoid @ away[0]
        normal /= np.linalg.norm(normal)
        offset = float(normal @ away[0])
        hull = hull.trim_by_plane(tuple((-normal).tolist()), -(offset + float(normal @ seed)))
        away = away[away @ normal < offset - 1e-9 * size]
    return hull


def deepest(solid: Manifold) -> np.ndarray:
    """The point of a lattice that lies deepest."""
    vertices, faces = surface_of(solid)
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    ticks = (np.arange(_TICKS) + 0.5) / _TICKS
    points = lower + np.stack(np.meshgrid(ticks, ticks, ticks), axis=-1).reshape(-1, 3) * (upper - lower)
    size = float((upper - lower).max())
    distance = MeshDistance((vertices - lower) / size, faces, faces, True).signed((points - lower) / size)
    return np.asarray(points[distance.argmin()])
