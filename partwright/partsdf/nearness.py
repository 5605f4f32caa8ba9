"""How far parts' surfaces are from the other parts, and pieces of meshes from one another."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from partwright.partsdf.neural import NeuralShape

if TYPE_CHECKING:
    import trimesh

_FIRST = 64  # points of a cloud that say how near another one is at most


def from_others(shape: NeuralShape, parts: dict[str, trimesh.Trimesh]) -> dict[str, np.ndarray]:
    """(V,) distances of the vertices of the parts' meshes (unit frame) from all other parts, by name;
    infinite where there is no other part. Asked for in one pass."""
    numbers = [(number, name) for number, name in enumerate(shape.names()) if name in parts]
    if not numbers:
        return {}
    clouds = [np.asarray(parts[name].vertices, np.float32) for _, name in numbers]
    ends = np.cumsum([len(cloud) for cloud in clouds])
    each = np.array(shape.part_distances(np.concatenate(clouds)))
    for (number, _), first, last in zip(numbers, [0, *ends], ends, strict=False):
        each[number, first:last] = np.inf
    least = np.split(each.min(axis=0), ends[:-1])
    return {name: own for (_, name), own in zip(numbers, least, strict=True)}


def edges_of(mesh: trimesh.Trimesh) -> np.ndarray:
    """(E, 2) vertices of each edge, once."""
    ends = np.sort(np.asarray(mesh.faces)[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys = np.sort(ends @ np.array([len(mesh.vertices), 1]))  # several times as fast as what trimesh does
    keys = keys[np.diff(keys, prepend=-1) > 0]
    return np.stack(np.divmod(keys, len(mesh.vertices)), axis=1)


def longest_bridge(clouds: Sequence[np.ndarray]) -> tuple[float, int, int]:
    """The longest edge of the minimum spanning tree of clouds of points (N, 3), two or more, each as far from
    another as their nearest points; and between which two, the later one first.

    The tree grows from the first cloud by its nearest (Prim). Distances are first taken to be those of the
    boxes, which are no more, and looked for only where such a one would be next.
    """
    low, high = (np.stack([end(cloud, axis=0) for cloud in clouds]) for end in (np.min, np.max))
    away = np.maximum(0.0, np.maximum(low[:, None] - high, low - high[:, None]))
    least = np.linalg.norm(away, axis=2)
    trees: dict[int, cKDTree] = {}

    def apart(one: int, other: int) -> float:
        few, many = sorted((one, other), key=lambda i: (len(clouds[i]), i))
        if many not in trees:
            trees[many] = cKDTree(clouds[many])
        points = clouds[few]
        bound = float(trees[many].query(points[:: -(-len(points) // _FIRST)])[0].min())
        outside = np.maximum(0.0, np.maximum(low[many] - points, points - high[many]))
        near = points[np.linalg.norm(outside, axis=1) <= bound]
        # Infinite where nothing is nearer.
        return min(bound, float(trees[many].query(near, distance_upper_bound=bound)[0].min(initial=np.inf)))

    joined = {0}
    queue = [(float(least[0, i]), False, 0, i) for i in range(1, len(clouds))]
    heapq.heapify(queue)
    longest = (-1.0, 0, 0)
    while len(joined) < len(clouds):
        length, known, inner, outer = heapq.heappop(queue)
        if outer in joined:
            continue
        if not known:
            heapq.heappush(queue, (apart(inner, outer), True, inner, outer))
            continue
        joined.add(outer)
        longest = max(longest, (length, max(inner, outer), min(inner, outer)))
        for i in set(range(len(clouds))) - joined:
            heapq.heappush(queue, (float(least[outer, i]), False, outer, i))
    return longest
