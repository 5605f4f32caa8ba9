"""Normals of points that come without: lines from their neighbours, then one consistent side.

The side comes from the empty space around the points: what the outside reaches is outside, the next room
behind a sheet of points is inside, the next one outside again. Points that this leaves open (in walls and
gaps as narrow as their spacing) follow their neighbours along a minimum spanning tree (Hoppe et al. 1992), by
reflection, which holds across sharp edges and thin walls too (König & Gumhold 2009, "Consistent propagation
of normal orientations in point clouds").
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.rows import units
from partwright.shapes.topology import components

_RADII = (1.4, 2.1, 3.0, 4.4)  # of the spacing: half thickness of the sheets that close the empty space
_BETTER = 0.02  # how much more a thicker sheet must settle: it also swallows more
_FEWEST = 10  # points between two rooms that make them neighbours
_FINEST = 1.8 / 128
_STEEP = 0.5  # weight against edges that leave the surface


def normal_lines(points: NDArray[np.float64], neighbours: NDArray[np.int64]) -> NDArray[np.float64]:
    """Unit normals (N, 3), either side, of the plane through each point's neighbours (N, K)."""
    offset = points[neighbours]
    offset -= offset.mean(axis=1, keepdims=True)
    return np.linalg.eigh(np.einsum("nki,nkj->nij", offset, offset))[1][:, :, 0]


def orient_normals(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    spacing: float,
) -> NDArray[np.float64]:
    """The normals (N, 3) of points (N, 3), turned to face outwards. `spacing` is the points' typical one."""
    side = _sides_by_space(points, normals, spacing)
    return normals * _sides_by_neighbours(points, normals, neighbours, side)[:, None]


def _sides_by_space(
    points: NDArray[np.float64], normals: NDArray[np.float64], spacing: float
) -> NDArray[np.int64]:
    """+1 where a normal points out, -1 where it points in, 0 where the empty space does not tell: (N,)."""
    from scipy.ndimage import distance_transform_edt

    step = max(_FINEST, spacing)
    margin = int(np.ceil(_RADII[-1] * spacing / step)) + 3
    origin = points.min(axis=0) - margin * step
    free = np.ones(np.ceil(np.ptp(points, axis=0) / step).astype(int) + 2 * margin + 1, dtype=bool)
    free[tuple(np.rint((points - origin) / step).astype(int).T)] = False
    distance = step * distance_transform_edt(free)
    best, best_score = np.zeros(len(points), dtype=np.int64), -1.0
    for radius in _RADII:
        reach = (radius * spacing + 1.2 * step) * normals
        side, score = _sides_by_rooms(
            distance > radius * spacing, (points + reach - origin) / step, (points - reach - origin) / step
        )
        if score > best_score + _BETTER:
            best, best_score = side, score
    return best


def _sides_by_rooms(
    free: NDArray[np.bool_], front: NDArray[np.float64], back: NDArray[np.float64]
) -> tuple[NDArray[np.int64], float]:
    """Sides (N,) by the rooms of free space in front of and behind each point, and how much they settle."""
    from scipy.ndimage import label

    room, count = label(free)
    ahead, behind = (room[tuple(np.rint(place).astype(int).T)] for place in (front, back))
    solid = _solid_rooms(ahead, behind, int(room[0, 0, 0]), count)
    outside_ahead, outside_behind = ~solid[ahead] & (ahead > 0), ~solid[behind] & (behind > 0)
    sure = np.where(outside_ahead & solid[behind], 1, np.where(outside_behind & solid[ahead], -1, 0))
    # Where a wall is too thin to hold a room, the side on which the outermost space lies is enough.
    outermost = room[0, 0, 0]
    open_ahead, open_behind = (ahead == outermost) & (behind == 0), (behind == outermost) & (ahead == 0)
    side = np.where(sure != 0, sure, open_ahead.astype(np.int64) - open_behind)
    return side, float((sure != 0).mean() + 0.3 * (side != 0).mean())


def _solid_rooms(
    ahead: NDArray[np.int32], behind: NDArray[np.int32], outermost: int, count: int
) -> NDArray[np.bool_]:
    """Which rooms (count + 1,) are an odd number of sheets away from the outermost; number 0 is no room."""
    apart = (ahead > 0) & (behind > 0) & (ahead != behind)
    low, high = np.minimum(ahead, behind)[apart], np.maximum(ahead, behind)[apart]
    key, points = np.unique(low.astype(np.int64) * (count + 1) + high, return_counts=True)
    a, b = np.divmod(key[points >= _FEWEST], count + 1)
    depth = np.full(count + 1, -1, dtype=np.int64)
    depth[outermost] = 0
    for level in range(count + 1):
        reached = np.r_[b[depth[a] == level], a[depth[b] == level]]
        reached = reached[depth[reached] < 0]
        if len(reached) == 0:
            break
        depth[reached] = level + 1
    return (depth % 2 == 1) & (depth > 0)


def _sides_by_neighbours(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    neighbours: NDArray[np.int64],
    known: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Sides (N,), +1 or -1: the known ones, and the others along a minimum spanning tree from them."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

    count = len(points)
    a = np.repeat(np.arange(count), neighbours.shape[1])
    b = neighbours.ravel()
    start = np.flatnonzero(known)
    if len(start) == 0:  # at least the highest point faces up
        start = np.array([points[:, 2].argmax()])
        known = np.where(normals[:, 2] >= 0, 1, -1)
    bridge = _bridges(points, components(count, a, b), start)
    a, b = np.r_[a, bridge[0]], np.r_[b, bridge[1]]
    a, b = np.minimum(a, b)[a != b], np.maximum(a, b)[a != b]
    pair = np.unique(a * count + b)
    a, b = np.divmod(pair, count)
    along = units(points[b] - points[a])
    climb = (normals[a] * along).sum(axis=1)
    agreement = ((normals[a] - 2 * climb[:, None] * along) * normals[b]).sum(axis=1)
    steep = np.maximum(np.abs(climb), np.abs((normals[b] * along).sum(axis=1)))
    weight = 1 - np.abs(agreement) + _STEEP * steep + 1e-3

    root = count
    tree = minimum_spanning_tree(
        coo_matrix(
            (
                np.r_[weight, np.full(len(start), 1e-6)],
                (np.r_[a, start], np.r_[b, np.full(len(start), root)]),
            ),
            shape=(count + 1, count + 1),
        ).tocsr()
    )
    parent = breadth_first_order(tree, root, directed=False)[1].astype(np.int64)
    parent[root] = root
    side = _sides_to_parents(pair, agreement, start, known[start], parent, count)
    while (parent != root).any():  # every step doubles the length of tree that a side spans
        side, parent = side * side[parent], parent[parent]
    return side[:count]


def _bridges(
    points: NDArray[np.float64], group: NDArray[np.int64], start: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The shortest edge from each group without a start to the groups that have one: their ends."""
    from scipy.spatial import cKDTree

    started = np.isin(group, group[start])
    reached, lost = np.flatnonzero(started), np.flatnonzero(~started)
    if len(lost) == 0:
        return lost, lost
    length, nearest = cKDTree(points[reached]).query(points[lost])
    order = np.lexsort((length, group[lost]))
    first = order[np.r_[True, np.diff(group[lost][order]) != 0]]
    return lost[first], reached[nearest[first]]


def _sides_to_parents(
    pair: NDArray[np.int64],
    agreement: NDArray[np.float64],
    start: NDArray[np.int64],
    start_side: NDArray[np.int64],
    parent: NDArray[np.int64],
    root: int,
) -> NDArray[np.int64]:
    """Side (N + 1,) of each point relative to its parent in the tree; below the root, the side itself."""
    side = np.ones(root + 1, dtype=np.int64)
    side[start] = start_side
    child = np.flatnonzero(parent != root)
    key = np.minimum(child, parent[child]) * root + np.maximum(child, parent[child])
    side[child] = np.where(agreement[np.searchsorted(pair, key)] >= 0, 1, -1)
    return side
