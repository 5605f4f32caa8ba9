"""Sharp edges and corners for marching cubes (Kobbelt, Botsch, Schwanecke, Seidel 2001, section 4).

A polygon whose corners' normals disagree holds a feature. It gets one more vertex where the tangent planes
of its corners meet, and becomes a fan around it; the edges between two fans are flipped so that they run
along the feature instead of across it.
"""

from __future__ import annotations

import numpy as np

from partwright.meshing.blocks import Distance, Grid, evaluate
from partwright.meshing.polygons import Polygons
from partwright.rows import lengths

_SHARP = 0.85  # cosine between two normals under which a polygon holds a feature (about 32 degrees)
_HALF_SHARP = ((1 + _SHARP) / 2) ** 0.5 + 1e-6  # of half that angle, and rounding
_FLAT = 0.06  # directions with a smaller share of the largest eigenvalue are left to the mean
_PROJECTIONS = 4  # between the cell and the line or point where the planes meet
_BETTER = 0.5  # of the distance that the polygon's middle has, what a feature may have
_NEAR = 0.1  # of a cell, from the zero level, what it may be anyway: it is moved there
_REACH = 2.0  # cells beyond its own in which the rim of a wedge that is thinner than a cell may lie
_ON = 0.15  # of a cell, how far from the zero level such a rim may be
_TURNED = 0.1  # of a fan's area, what may have its back to the normals
NORMAL_STEP = 0.02  # finite differences, in cells
_TETRAHEDRON = np.array([(1, -1, -1), (-1, -1, 1), (-1, 1, -1), (1, 1, 1)], dtype=np.float64)


def sharpen(polygons: Polygons, distance: Distance, grid: Grid) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (V, 3) and triangles (F, 3) of the surface with its features, and normals (U, 3) of the field
    at the polygons' corners, which come first."""
    normals = field_normals(distance, polygons.vertices, NORMAL_STEP * float(grid.cell.min()))
    candidates = _with_features(polygons, normals)
    chosen, extra = _feature_points(polygons, normals, candidates, distance, grid)
    plain = np.ones(len(polygons), dtype=bool)
    plain[chosen] = False
    fans = _fans(polygons, chosen)
    vertices = np.concatenate([polygons.vertices, extra])
    return vertices, np.concatenate([polygons.triangles(plain), fans]), normals


def field_normals(distance: Distance, points: np.ndarray, step: float) -> np.ndarray:
    """Unit gradients (N, 3) by differences over a tetrahedron's corners; zero where the field is flat."""
    taps = np.empty((len(points), 4, 3), np.float32)
    for i in range(3):  # by columns: rows of three are slow to loop over
        taps[:, :, i] = points[:, None, i] + step * _TETRAHEDRON[:, i]
    values = evaluate(distance, taps.reshape(-1, 3)).reshape(-1, 4).astype(np.float64)
    gradient = values @ _TETRAHEDRON
    length = lengths(gradient)[:, None]
    return np.divide(gradient, length, out=np.zeros_like(gradient), where=length > 0)


def _with_features(polygons: Polygons, normals: np.ndarray) -> np.ndarray:
    """Polygons two of whose corners' normals differ by more than the sharp angle."""
    # Where none differs from the first by half that angle, no two do: so for most, one comparison a corner.
    first = normals[polygons.index[:, 0]]
    least = np.ones(len(polygons))
    for place in range(1, polygons.index.shape[1]):
        there = np.flatnonzero(polygons.length > place)
        cosine = np.einsum("pd,pd->p", first[there], normals[polygons.index[there, place]])
        least[there] = np.minimum(least[there], cosine)
    doubtful = np.flatnonzero(least < _HALF_SHARP)
    around, used = normals[polygons.index[doubtful]], polygons.used[doubtful]
    cosine = np.einsum("pid,pjd->pij", around, around)
    cosine[~(used[:, :, None] & used[:, None, :])] = 1.0
    return doubtful[cosine.min(axis=(1, 2)) < _SHARP]


def _feature_points(
    polygons: Polygons, normals: np.ndarray, candidates: np.ndarray, distance: Distance, grid: Grid
) -> tuple[np.ndarray, np.ndarray]:
    """The polygons that keep a feature, and its place: the least-squares meeting point of the tangent planes.

    A rim thinner than a cell passes between the lattice's corners: its place may lie beyond the polygon's
    cell, as long as it is on the zero level and the fan around it does not fold. Else it is kept to the cell,
    so that fans of neighbours do not overlap, and dropped where it lies hardly nearer to the zero level than
    the polygon's middle does, and not close to it (the normals belonged to a ripple, not to a feature).
    """
    index, used = polygons.index[candidates], polygons.used[candidates][:, :, None]
    points, around = polygons.vertices[index], normals[index] * used
    middle = (points * used).sum(axis=1) / polygons.length[candidates][:, None]
    values, axes = np.linalg.eigh(np.einsum("pid,pie->pde", around, around))
    inverse = np.where(values > _FLAT * values[:, -1:], 1 / np.maximum(values, 1e-12), 0.0)
    solve = np.einsum("pde,pe,pfe->pdf", axes, inverse, axes, optimize=True)
    corner = grid.origin + polygons.cell[candidates] * grid.cell

    def meeting(reach: float) -> np.ndarray:
        place = middle
        for _ in range(_PROJECTIONS):
            offsets = ((points - place[:, None]) * around).sum(axis=-1)
            place = place + np.einsum("pdf,pif,pi->pd", solve, around, offsets, optimize=True)
            place = np.clip(place, corner - reach * grid.cell, corner + (1 + reach) * grid.cell)
        return place

    far = meeting(_REACH)
    outside = np.flatnonzero(((far < corner) | (far > corner + grid.cell)).any(axis=1))
    on = np.abs(evaluate(distance, far[outside])) < _ON * float(grid.cell.min())
    outside = outside[
        on & ~_folds(points[outside], around[outside], polygons.length[candidates][outside], far[outside])
    ]
    place = meeting(0.0)
    place[outside] = far[outside]
    least = np.maximum(_BETTER * np.abs(evaluate(distance, middle)), _NEAR * float(grid.cell.min()))
    better = np.abs(evaluate(distance, place)) < least
    return candidates[better], place[better]


def _folds(points: np.ndarray, normals: np.ndarray, length: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Whether much of the fan around a centre (P, 3) turns its back on the normals at its triangles' corners.

    points, normals: (P, K, 3) of the polygons' corners, of which the first length (P,) count.
    """
    place = np.arange(points.shape[1])
    following = np.where(place + 1 < length[:, None], place + 1, 0)[:, :, None]
    end = np.take_along_axis(points, following, axis=1)
    up = np.cross(end - points, centre[:, None] - points)
    at_start = np.einsum("pid,pid->pi", up, normals)
    at_end = np.einsum("pid,pid->pi", up, np.take_along_axis(normals, following, axis=1))
    area = np.linalg.norm(up, axis=-1) * (place < length[:, None])
    turned = np.maximum(at_start, at_end) < 0
    return (area * turned).sum(axis=1) > _TURNED * area.sum(axis=1)


def _fans(polygons: Polygons, chosen: np.ndarray) -> np.ndarray:
    """Triangles around the new vertices, numbered on from the old ones; edges between two fans flipped."""
    length = polygons.length[chosen]
    used = polygons.used[chosen]
    start = polygons.index[chosen][used]
    place = np.arange(used.shape[1])[None, :] + 1
    place = np.where(place < length[:, None], place, 0)
    end = np.take_along_axis(polygons.index[chosen], place, axis=1)[used]
    centre = np.repeat(np.arange(len(chosen)), length) + len(polygons.vertices)

    # The same edge in two fans runs there and back.
    total = len(polygons.vertices) + len(chosen)
    key = np.minimum(start, end) * total + np.maximum(start, end)
    order = np.lexsort((start > end, key))
    twin = np.flatnonzero(key[order][1:] == key[order][:-1])
    there, back = order[twin], order[twin + 1]
    # Two fans that meet in two edges (an ambiguous face) would share the flipped edge: leave them.
    low, high = np.minimum(centre[there], centre[back]), np.maximum(centre[there], centre[back])
    _, which, times = np.unique(low * total + high, return_inverse=True, return_counts=True)
    once = times[which] == 1
    there, back = there[once], back[once]

    kept = np.ones(len(start), dtype=bool)
    kept[there] = kept[back] = False
    plain = np.stack([start[kept], end[kept], centre[kept]], axis=1)
    flipped = np.concatenate(
        [
            np.stack([start[there], centre[back], centre[there]], axis=1),
            np.stack([end[there], centre[there], centre[back]], axis=1),
        ]
    )
    return np.concatenate([plain, flipped])
