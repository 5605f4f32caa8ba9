"""Directions along which a person would have drawn a part: across its flat faces, along its round ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from partwright.shapes.topology import area_vectors

_SAME = math.cos(math.radians(1.5))
_LEAST = 0.01  # of the area, that faces across a direction, or round ones along it, have
_MOST = 4
_CELL = 0.02
_SQUARE = 1e-3  # cosine of directions that are square
_BESIDE, _SAME_AS = math.cos(math.radians(8)), math.cos(math.radians(0.1))
_EQUAL = 0.01  # of the weight of one of two that weigh the same
_FACING, _WAYS = 6, 3  # ways in which the most wall faces, and in how many of them that of a prism does
_SLANTED = 0.3  # sine of the angle between two of them, at least
_UPRIGHT = 0.01  # cosine
_PRISM = 0.1  # of the area, that the walls of a prism have
_ELONGATED = 2.0  # times as long as it is wide
_SMOOTH = (math.radians(1.0), math.radians(40))  # turns from face to face on a round wall


def frames(vertices: np.ndarray, faces: np.ndarray) -> list[np.ndarray]:
    """Rotations (3, 3), the direction the third column, the most telling first.

    vertices (V, 3), faces (F, 3) of a closed mesh.
    """
    corners = vertices[faces]
    cross = area_vectors(corners)
    area = np.linalg.norm(cross, axis=1) / 2
    kept = area > 1e-12
    normal = np.zeros_like(cross)
    normal[kept] = cross[kept] / (2 * area[kept, None])
    around, weight = _round_axes(faces, normal, area)
    votes = np.concatenate([normal[kept], around])
    weights = np.concatenate([area[kept], weight])
    clusters = _clusters(votes, weights, _LEAST * float(area.sum()))
    clusters += _prism_axes([direction for _, direction in clusters], normal[kept], area[kept])
    found = [direction for _, direction in sorted(clusters, key=lambda one: -one[0])[:_MOST]]
    found = _with_square(found) or list(np.eye(3))
    return [frame_along(direction, found) for direction in found]


def long_axis(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray | None:
    """The frame (3, 3), as of `frames`, along which a surface is much longer than across; None of others."""
    corners = vertices[faces]
    area = np.linalg.norm(area_vectors(corners), axis=1)
    middle = corners.mean(axis=1)
    off = middle - np.average(middle, axis=0, weights=area)
    spread, axes = np.linalg.eigh(np.einsum("n,ni,nj->ij", area, off, off))
    if spread[2] < _ELONGATED**2 * spread[1]:
        return None
    return frame_along(snapped(axes[:, 2]), [axes[:, 1]])


def _round_axes(faces: np.ndarray, normal: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of faces that share an edge and turn a little there: the axis about which, and half their area."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T[::-1])
    pairs = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
    one, two = order[:-1][pairs] // 3, order[1:][pairs] // 3
    axis = np.cross(normal[one], normal[two])
    sine = np.linalg.norm(axis, axis=1)
    round_ = (sine > math.sin(_SMOOTH[0])) & (sine < math.sin(_SMOOTH[1]))
    round_ &= (normal[one] * normal[two]).sum(axis=1) > 0
    return axis[round_] / sine[round_, None], ((area[one] + area[two]) / 4)[round_]


def _prism_axes(
    known: list[np.ndarray], normal: np.ndarray, area: np.ndarray
) -> list[tuple[float, np.ndarray]]:
    """Directions along which flat walls lie that face three ways or more, and half the area of these: of a
    hexagonal bar, whose ends are too small to tell. The first of the known ones are not among them."""
    found: list[tuple[float, np.ndarray]] = []
    for one, two in combinations(known[:_FACING], 2):
        axis = np.cross(one, two)
        sine = float(np.linalg.norm(axis))
        if sine < _SLANTED:
            continue
        axis = snapped(axis / sine)
        if any(
            abs(float(axis @ other)) > _SAME
            for other in (*known[:_MOST], *(direction for _, direction in found))
        ):
            continue
        walls = float(area[np.abs(normal @ axis) < _UPRIGHT].sum())
        ways = sum(abs(float(axis @ other)) < _UPRIGHT for other in known)
        if ways >= _WAYS and walls > _PRISM * float(area.sum()):
            found.append((walls / 2, axis))
    return found


def _clusters(votes: np.ndarray, weights: np.ndarray, least: float) -> list[tuple[float, np.ndarray]]:
    """Weights and directions (3,), signs aside, that the most weight agrees on."""
    largest = np.take_along_axis(votes, np.abs(votes).argmax(axis=1)[:, None], axis=1)
    cells, cell = np.unique(
        np.round(votes * np.sign(largest) / _CELL).astype(int), axis=0, return_inverse=True
    )
    totals = np.bincount(cell.ravel(), weights, minlength=len(cells))
    seeds = [
        int(np.argmax(np.where(cell.ravel() == k, weights, 0))) for k in np.argsort(-totals)[: 4 * _MOST]
    ]
    left = np.ones(len(votes), bool)
    found: list[tuple[float, np.ndarray]] = []
    for seed in seeds:
        if not left[seed]:
            continue
        near = np.abs(votes @ votes[seed]) > _SAME
        near &= left
        left &= ~near
        total = float(weights[near].sum())
        if total < least:
            continue
        signed = votes[near] * np.sign(votes[near] @ votes[seed])[:, None]
        # The middle of the largest votes: small faces of a fillet lean to one side.
        heavy = weights[near] >= 0.2 * weights[near].max()
        mean = (signed[heavy] * weights[near][heavy, None]).sum(axis=0)
        found.append((total, snapped(mean / np.linalg.norm(mean))))
    return _between_equals(sorted(found, key=lambda f: -f[0]))


def _between_equals(found: list[tuple[float, np.ndarray]]) -> list[tuple[float, np.ndarray]]:
    """With what lies between two that are near and weigh the same in place of the first, and without the
    second: about the axis of a bend, facets lean as much to one side as to the other."""
    result: list[tuple[float, np.ndarray]] = []
    left = list(found)
    while left:
        weight, direction = left.pop(0)
        for k, (other_weight, other) in enumerate(left):
            if float(direction @ other) > _BESIDE and other_weight > (1 - _EQUAL) * weight:
                mean = direction + other
                direction = snapped(mean / np.linalg.norm(mean))
                del left[k]
                break
        result.append((weight, direction))
    return result


def _with_square(found: list[np.ndarray]) -> list[np.ndarray]:
    """The direction across the first two, where they are square, in place of those that nearly are it: facets
    of a round wall that the direction lies between."""
    if len(found) < 3 or abs(float(found[0] @ found[1])) > _SQUARE:
        return found
    across = np.cross(found[0], found[1])
    near = np.abs(np.array(found) @ across)
    if near.max() < _BESIDE or near.max() > _SAME_AS:
        return found
    first = int(np.argmax(near >= _BESIDE))
    others = [snapped(across) if k == first else d for k, d in enumerate(found)]
    return [d for k, d in enumerate(others) if k == first or near[k] < _BESIDE]


def snapped(direction: np.ndarray) -> np.ndarray:
    """Upwards, and along a coordinate axis where it is within rounding of one."""
    axis = int(np.abs(direction).argmax())
    direction = direction * np.sign(direction[axis])
    return np.eye(3)[axis] if direction[axis] > 1 - 1e-7 else direction


def frame_along(direction: np.ndarray, others: Sequence[np.ndarray] = ()) -> np.ndarray:
    """The direction as z; x along another one across it, or along the coordinate axis that is most across."""
    across = [d for d in (*np.eye(3), *others) if abs(float(d @ direction)) < 1e-4]
    x = across[0] if across else np.eye(3)[int(np.abs(direction).argmin())]
    x = x - direction * (x @ direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
