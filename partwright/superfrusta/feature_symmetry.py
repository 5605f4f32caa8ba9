"""Turns and mirror planes of a shape, by which what is drawn once may be there again.

All of them keep the centre of volume where it is, which a closed mesh tells exactly, and their directions are
those that the surface's own faces have: so copies are exact, and symmetries fitted to samples are not.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from manifold3d import Manifold
from numpy.typing import NDArray

from partwright.assembly import Similarity
from partwright.assembly.motion import Motion

Floats = NDArray[np.float64]
Away = Callable[[NDArray[np.float32]], NDArray[np.float32]]

_ORDERS = range(36, 1, -1)
_MULTIPLES = range(2, 7)  # of the largest that is one, that are looked at, too
_ROUND = 12  # the largest order that is looked at where all are symmetries
_ERROR = 1e-2  # unit lengths: mean distance from the surface to its image; each copy is looked at anyway
_RIVAL, _NOISE = 2.0, 2e-4  # of the least error of an axis, and unit lengths, that another order may have
_POINTS = 300
_PARALLEL = 0.9999
_APART, _NEAR = 1e-5, 0.05  # unit lengths between the middles of volume and box, to try both
_MOST = 48  # turns, or as many as one axis has


def centre_of_volume(body: Manifold) -> Floats:
    """(3,) of a closed body, exactly."""
    mesh = body.to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts, np.int64)]
    sixths = np.einsum("ni,ni->n", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return np.asarray((corners.sum(axis=1) / 4 * sixths[:, None]).sum(axis=0) / sixths.sum())


def reflection(normal: Floats, point: Floats) -> Similarity:
    """What comes after mirroring in the plane x = 0, so that both are the mirror image in the plane through
    `point` (3,) with a unit normal (3,)."""
    linear = (np.eye(3) - 2 * np.outer(normal, normal)) @ np.diag([-1.0, 1.0, 1.0])
    return Similarity.from_linear(linear, 2 * normal * (normal @ point))


def reflected(move: Similarity, points: Floats) -> Floats:
    """Points (N, 3) mirrored in the plane x = 0, then moved."""
    return Motion(move, True)(points)


def _turn(axis: Floats, order: int, times: int, centre: Floats) -> Similarity:
    return Similarity.turn(axis.tolist(), 2 * math.pi * times / order, centre.tolist())


def symmetries(
    body: Manifold,
    directions: Sequence[Floats],
    surface: NDArray[np.float32],
    away: Away,
) -> tuple[list[Similarity], list[Similarity]]:
    """Turns, and reflections as of `reflection`, that take a body to itself, about and along directions (3,).

    surface: (N, 3) points on it. away: how far (n,) points are from it. A body that is not quite symmetric,
    as of holes that are askew, may be so about the middle of its box and not of its volume: both are tried.
    """
    mirrors: list[Similarity] = []
    if body.is_empty() or body.volume() <= 0:
        return [], mirrors
    turns: list[list[Similarity]] = []
    points = surface[:: max(1, len(surface) // _POINTS)].astype(np.float64)
    centre, middle = centre_of_volume(body), np.reshape(body.bounding_box(), (2, 3)).mean(axis=0)
    for axis in _distinct(directions):
        along = axis * float(axis @ (middle - centre))
        turns.append(_turns(axis, centre, points, away))
        planes = [reflection(axis, centre)]
        if _APART < float(np.linalg.norm(middle - centre - along)) < _NEAR:
            turns.append(_turns(axis, middle, points, away))
        if _APART < float(np.linalg.norm(along)) < _NEAR:
            planes.append(reflection(axis, middle))
        mirrors += [one for one in planes if _error(reflected(one, points), away) < _ERROR]
    most = max(_MOST, *map(len, turns))
    return [turn for own in turns for turn in own][:most], mirrors


def _turns(axis: Floats, centre: Floats, points: Floats, away: Away) -> list[Similarity]:
    errors = _errors(_ORDERS, axis, centre, points, away)
    limit = min(_ERROR, _RIVAL * min(errors.values()) + _NOISE)
    orders = [n for n, own in errors.items() if own < limit]
    if len(orders) == len(_ORDERS):
        orders = [n for n in orders if n <= _ROUND]
    elif orders:
        most = max(orders)
        more = _errors([k * most for k in _MULTIPLES], axis, centre, points, away)
        orders += [n for n, own in more.items() if own < errors[most] + _NOISE]
    largest = [n for n in orders if not any(other % n == 0 for other in orders if other > n)]
    turns = [_turn(axis, n, k, centre) for n in largest for k in range(1, n)]
    return turns[: max([_MOST, *largest[:1]])]


def _errors(
    orders: Sequence[int], axis: Floats, centre: Floats, points: Floats, away: Away
) -> dict[int, float]:
    """By how much a turn of each order misses on average, unit lengths."""
    images = np.concatenate([_turn(axis, n, 1, centre)(points) for n in orders])
    means = _off(images, away).reshape(len(orders), -1).mean(axis=1)
    return dict(zip(orders, means.tolist(), strict=True))


def _error(image: Floats, away: Away) -> float:
    return float(_off(image, away).mean())


def _off(points: Floats, away: Away) -> NDArray[np.float32]:
    return away(points.astype(np.float32))


def _distinct(directions: Sequence[Floats]) -> list[Floats]:
    kept: list[Floats] = []
    for direction in [*np.eye(3), *directions]:
        if all(abs(float(direction @ other)) < _PARALLEL for other in kept):
            kept.append(direction)
    return kept
