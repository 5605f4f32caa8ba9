"""Points to a surface: a signed distance around them, and its zero level as a mesh.

Near the points the distance is that to the planes of the nearest ones (implicit moving least squares, Kolluri
2005), on thin walls to the nearer of both sides; away from them the winding number tells the sign, and closes
what the points leave open.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.errors import FlatShapeError, NeedsSurfaceError, NotFiniteError
from partwright.shapes.cleaning import counted
from partwright.shapes.contour import contour
from partwright.shapes.frame import LONGEST_SIDE, UnitFrame
from partwright.shapes.indicator import Indicator
from partwright.shapes.normals import normal_lines, orient_normals
from partwright.shapes.source import Piece, Source
from partwright.shapes.topology import EdgeTable, area_vectors, signed_volumes

_FEWEST = 100
_DENSE = 100_000  # points from which close ones are merged
_SHARED = 0.75  # of a cell of the contour: how close
_SAME = 1e-7  # unit frame
_FINEST = LONGEST_SIDE / 240  # cells of the contour
_NEIGHBOURS = 12  # points that span a normal's plane
_PLANES = 8  # points whose planes make up the distance
_WIDTH = 0.7  # of the spacing: how far a point's plane counts
_REACH = 1.5  # of the spacing: beyond, the planes say nothing
_OPPOSED = -0.3  # cosine under which a point does not belong to the nearest one's side
_BEHIND = -0.7  # cosine under which a point belongs to the other side of a wall
_LEAST_BEHIND = 0.05  # of the nearest point's weight: fewer points say nothing of the other side
_THIN = 1.5  # spacings that a thin wall has at most
_MANY_THIN = 0.1  # of the points on thin walls, from which on cells are half as wide
_CLOSE = 2.0  # of the spacing: a point this near to a surface bears it out
_MARGIN = 4  # cells around the points
_FLAT = 1e-6
_LEAST_CONFIDENCE = 0.5


@dataclass(frozen=True)
class _Elements:
    """Oriented surface elements in the unit frame: points (N, 3), outward unit normals (N, 3), areas (N,).

    walled: the normals were given, and walls are thin. Estimated ones often face the wrong way there.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    area: NDArray[np.float64]
    walled: bool

    @property
    def spacing(self) -> float:
        """Side of the square that a point stands for."""
        return _spacing(self.area)


def source_of_points(name: str, points: NDArray[Any], normals: NDArray[Any] | None = None) -> Source:
    """Surface through points (N, 3), with outward normals (N, 3) of any length or without.

    Raises NeedsSurfaceError when the points are too few or show no inside, NotFiniteError, FlatShapeError.
    """
    points = np.array(points, dtype=np.float64)  # the shape keeps them
    if not np.isfinite(points).all():
        bad = np.count_nonzero(~np.isfinite(points).all(axis=1))
        raise NotFiniteError(f"{name}: {bad} of {len(points)} points have a NaN or infinite coordinate")
    notes: list[str] = []
    normals = _usable(name, normals, notes)
    if len(points) < _FEWEST:
        raise NeedsSurfaceError(
            f"{name}: {counted(len(points), 'point')} without faces; expected at least {_FEWEST} points, "
            "better 10,000, or a mesh"
        )
    frame = UnitFrame.of(points)
    unit, normals = _distinct(frame.to_unit(points), normals, notes)
    elements = _elements(name, unit, normals, notes)
    vertices, faces = _surface(elements)
    confidence = _borne_out(elements, vertices, faces) if len(faces) else 0.0
    if confidence < _LEAST_CONFIDENCE:
        raise NeedsSurfaceError(
            f"{name}: the {len(points)} points do not show what is inside: they bear out {confidence:.0%} of "
            "the surface around it; "
            "give more points, outward normals, or a mesh"
        )
    notes.insert(0, f"the surface was reconstructed from {len(unit)} points (confidence {confidence:.2f})")
    piece = Piece(name, frame.from_unit(vertices), faces)
    return Source(name, (piece,), repairs=tuple(notes), confidence=confidence, points=points)


def _usable(name: str, normals: NDArray[Any] | None, notes: list[str]) -> NDArray[np.float64] | None:
    """Unit normals, or None where the numbers given are none."""
    if normals is None:
        return None
    normals = np.asarray(normals, dtype=np.float64)
    length = np.linalg.norm(normals, axis=1)
    if not np.isfinite(normals).all() or (length < 1e-6).any():
        notes.append("the normals given hold zeros, NaN or infinity and were not used")
        return None
    return normals / length[:, None]


def _distinct(
    points: NDArray[np.float64], normals: NDArray[np.float64] | None, notes: list[str]
) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Each place once; of very many points, those that share a fraction of a cell as one."""
    size = _SHARED * _FINEST if len(points) > _DENSE else _SAME
    cell = np.rint(points / size).astype(np.int64)
    order = np.lexsort(cell.T)
    first = np.flatnonzero(np.r_[True, (np.diff(cell[order], axis=0) != 0).any(axis=1)])
    if len(first) == len(points):
        return points, normals
    notes.append(f"merged {counted(len(points) - len(first), 'point')} with others at the same place")
    merged = np.add.reduceat(points[order], first) / np.diff(np.r_[first, len(points)])[:, None]
    return merged, None if normals is None else normals[order[first]]


def _elements(
    name: str, points: NDArray[np.float64], normals: NDArray[np.float64] | None, notes: list[str]
) -> _Elements:
    """Points with areas, and with normals where they come without."""
    from scipy.spatial import cKDTree

    if len(points) < _FEWEST:
        raise NeedsSurfaceError(
            f"{name}: the points lie at {len(points)} places; at least {_FEWEST} are needed"
        )
    axis = np.linalg.eigh(np.cov(points.T))[1][:, 0]
    if np.ptp(points @ axis) < _FLAT:
        raise FlatShapeError(f"{name}: all points lie in one plane, so there is no inside to fit")
    distance, neighbours = cKDTree(points).query(points, _NEIGHBOURS, workers=-1)
    # The disc to the last neighbour holds the other neighbours, the point itself and half of the last one.
    disc = np.pi * distance[:, -1] ** 2
    if normals is None:
        area = disc / (_NEIGHBOURS - 0.5)
        lines = normal_lines(points, neighbours)
        normals = orient_normals(points, lines, neighbours, _spacing(area))
        notes.append("their normals were estimated from their neighbours and the empty space around")
        return _Elements(points, normals, area, walled=False)
    facing = (normals[neighbours] * normals[:, None]).sum(axis=2)
    area = disc / ((facing > _OPPOSED).sum(axis=1) - 0.5)  # the other side of a wall has a disc of its own
    if ((points - points.mean(axis=0)) * normals).sum(axis=1) @ area < 0:
        normals = -normals
        notes.append("their normals faced inwards and were turned")
    depth = ((points[:, None] - points[neighbours]) * normals[:, None]).sum(axis=2)
    thin = (facing < _BEHIND) & (depth > 0) & (depth < _THIN * _spacing(area))
    return _Elements(points, normals, area, walled=bool(thin.any(axis=1).mean() > _MANY_THIN))


def _spacing(area: NDArray[np.float64]) -> float:
    return float(np.sqrt(area.mean()))


def _surface(elements: _Elements) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Closed mesh through the elements; without faces when they enclose nothing."""
    indicator = Indicator(
        elements.points, elements.normals * elements.area[:, None], max(elements.spacing, LONGEST_SIDE / 128)
    )
    cell = max(elements.spacing / (2 if elements.walled else 1), _FINEST)
    lower, upper = elements.points.min(axis=0), elements.points.max(axis=0)
    sides = np.ceil((upper - lower) / cell).astype(int) + 2 * _MARGIN
    origin = (lower + upper) / 2 - cell * (sides - 1) / 2
    field = 4 * cell * (0.5 - indicator.on_grid(origin, cell, tuple(sides.tolist())))
    near = _cells_near(elements.points, origin, cell, field.shape, max(2.0, _REACH * elements.spacing / cell))
    distance, known = _plane_distance(elements, origin + cell * near)
    field[tuple(near[known].T)] = distance[known]
    vertices, faces = contour(field, origin, cell)
    return vertices, _without_crumbs(vertices, faces, (2 * max(elements.spacing, _FINEST)) ** 3)


def _borne_out(elements: _Elements, vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    """Share of a mesh's area that has an element close by which faces the same way.

    Where normals face the wrong way or the points leave a gap, there is surface that no point bears out.
    """
    from scipy.spatial import cKDTree

    corners = vertices[faces]
    normal = area_vectors(corners)
    apart, nearest = cKDTree(elements.points).query(corners.mean(axis=1), workers=-1)
    agrees = (normal * elements.normals[nearest]).sum(axis=1) > 0
    area = np.linalg.norm(normal, axis=1)
    return float(area[agrees & (apart < _CLOSE * elements.spacing)].sum() / area.sum())


def _cells_near(
    points: NDArray[np.float64],
    origin: NDArray[np.float64],
    cell: float,
    shape: tuple[int, ...],
    reach: float,
) -> NDArray[np.int64]:
    """Grid points (M, 3) within `reach` cells of a cell that holds a point."""
    from scipy.ndimage import distance_transform_edt

    free = np.ones(shape, dtype=bool)
    free[tuple(np.rint((points - origin) / cell).astype(np.int64).T)] = False
    return np.argwhere(distance_transform_edt(free) <= reach)


def _plane_distance(
    elements: _Elements, places: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Signed distance (M,) at places (M, 3) by the nearest elements' planes, and where they reach.

    Across a thin wall the nearest element may be one of the other side: the side that is nearer counts.
    """
    from scipy.spatial import cKDTree

    apart, nearest = cKDTree(elements.points).query(places, _PLANES, workers=-1)
    normal = elements.normals[nearest]
    height = ((places[:, None] - elements.points[nearest]) * normal).sum(axis=2)
    weight = np.exp((apart[:, :1] ** 2 - apart**2) / (_WIDTH * elements.spacing) ** 2)
    facing = (normal * normal[:, :1]).sum(axis=2)
    beside = weight * (facing > _OPPOSED)
    distance = (beside * height).sum(axis=1) / beside.sum(axis=1)
    if elements.walled:
        behind = weight * (facing < _BEHIND)
        borne = behind.sum(axis=1)
        other = (behind * height).sum(axis=1) / np.maximum(borne, _LEAST_BEHIND)
        distance = np.where((borne > _LEAST_BEHIND) & (np.abs(other) < np.abs(distance)), other, distance)
    return distance, apart[:, 0] < _REACH * elements.spacing


def _without_crumbs(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], volume: float
) -> NDArray[np.int64]:
    """Faces (F, 3) without closed bodies and cavities of less than `volume`."""
    body = EdgeTable(faces).bodies
    return faces[(np.abs(signed_volumes(vertices, faces, body)) >= volume)[body]]
