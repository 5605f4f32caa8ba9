"""Triangles of a closed mesh that lie in one plane, as patches and the loops of corners around them.

Half-edge h of a mesh is that of triangle h // 3 from its corner h % 3 to its next.
"""

from __future__ import annotations

import numpy as np

from partwright.shapes.topology import area_vectors

_ALIKE = 0.9  # least cosine of normals in a patch; needles, whose own means nothing, are in it at any


def twins_of(triangles: np.ndarray) -> np.ndarray:
    """Of each half-edge (3 F,) that which goes back along it, of a closed mesh's triangles (F, 3)."""
    starts, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    forth, back = np.lexsort((ends, starts)), np.lexsort((starts, ends))
    twins = np.empty(len(starts), dtype=np.int64)
    twins[forth] = back
    return twins


def patches(
    places: np.ndarray, triangles: np.ndarray, twins: np.ndarray, flat: float
) -> tuple[np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
    """Of each triangle its patch (F,), and of each patch a place in its plane and its normal.

    Patches grow from the largest triangles on, over edges, as long as corners lie within `flat` of the plane
    of the first: planes do not drift, and needles join what they lie along.
    """
    corners = places[triangles]
    crossed = area_vectors(corners)
    areas = np.linalg.norm(crossed, axis=1)
    normals = crossed / np.maximum(areas, np.finfo(float).tiny)[:, None]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    needles = areas < flat * sides
    neighbours = (twins // 3).reshape(-1, 3).tolist()
    of_face = np.full(len(triangles), -1)
    planes: list[tuple[np.ndarray, np.ndarray]] = []
    for seed in np.argsort(-areas, kind="stable").tolist():
        if of_face[seed] >= 0:
            continue
        middle, normal = corners[seed].mean(axis=0), normals[seed]
        fits = (np.abs((corners - middle) @ normal) <= flat).all(axis=1)
        fits &= (normals @ normal > _ALIKE) | needles
        of_face[seed], waiting = len(planes), [seed]
        while waiting:
            for other in neighbours[waiting.pop()]:
                if of_face[other] < 0 and fits[other]:
                    of_face[other] = len(planes)
                    waiting.append(other)
        planes.append((middle, normal))
    return of_face, planes


def boundary_loops(triangles: np.ndarray, twins: np.ndarray, of_face: np.ndarray) -> list[list[list[int]]]:
    """Of each patch the loops of corners around it, the patch to their left: its outline and its holes."""
    starts, back, patch = triangles.ravel().tolist(), twins.tolist(), of_face.repeat(3).tolist()
    loops: list[list[list[int]]] = [[] for _ in range(int(of_face.max()) + 1)]
    seen: set[int] = set()
    for first in range(len(starts)):
        if first in seen or patch[first] == patch[back[first]]:
            continue
        loop, at = [], first
        while at not in seen:
            seen.add(at)
            loop.append(starts[at])
            at = _next(at)
            while patch[at] == patch[back[at]]:
                at = _next(back[at])
        loops[patch[first]].append(loop)
    return loops


def _next(half: int) -> int:
    return half - 2 if half % 3 == 2 else half + 1
