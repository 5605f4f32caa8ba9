"""`frontal_area@AXIS`, `silhouette@AXIS`: what the solid covers, seen along an axis from afar."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from partwright.goals.objective import Measure, Objective, Start
from partwright.goals.objectives.axes import axis
from partwright.meshing.thin_parts import as_manifold

if TYPE_CHECKING:
    from manifold3d import CrossSection

_ALONG = 1e-3  # cosine between a face and the axis: along it


def _frame(direction: np.ndarray) -> np.ndarray:
    """(2, 3) axes of the picture: both at right angles to the direction."""
    i = int(np.abs(direction).argmax())
    return np.eye(3)[[(i + 1) % 3, (i + 2) % 3]]


def _outline(vertices: np.ndarray, faces: np.ndarray, frame: np.ndarray) -> CrossSection:
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    turn = np.vstack([frame, np.cross(*frame)])
    return as_manifold(mesh).transform(np.column_stack([turn, np.zeros(3)])).project()


def _slopes(
    section: CrossSection, vertices: np.ndarray, faces: np.ndarray, frame: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Corners of the outline (N, 2), the vertex (N,) at each, and the derivative (N, 2) of the area by it.

    Only vertices between faces that look along the axis and faces that do not, either way, can be there.
    """
    corners, slopes = [], []
    for polygon in section.to_polygons():
        ring = np.asarray(polygon, dtype=np.float64)
        ahead, behind = np.roll(ring, -1, axis=0), np.roll(ring, 1, axis=0)
        chord = (ahead - behind) / 2
        corners.append(ring)
        slopes.append(np.column_stack([chord[:, 1], -chord[:, 0]]))
    where, slope = np.concatenate(corners), np.concatenate(slopes)
    facing = trimesh.Trimesh(vertices, faces, process=False).face_normals @ np.cross(*frame)
    least, most = np.full(len(vertices), 1.0), np.full(len(vertices), -1.0)
    np.minimum.at(least, faces.ravel(), np.repeat(facing, 3))
    np.maximum.at(most, faces.ravel(), np.repeat(facing, 3))
    rim = np.flatnonzero((least < _ALONG) & (most > -_ALONG))
    return where, rim[cKDTree(vertices[rim] @ frame.T).query(where)[1]], slope


def _frontal_area(argument: str, start: Start) -> Measure:
    frame = _frame(axis(argument, "x", "frontal_area"))

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        section = _outline(vertices, faces, frame)
        _, vertex, slope = _slopes(section, vertices, faces, frame)
        sensitivity = np.zeros_like(vertices)
        np.add.at(sensitivity, vertex, slope @ frame)
        return section.area(), sensitivity

    return measure


def _silhouette(argument: str, start: Start) -> Measure:
    """The area by which the outline differs from that of the start."""
    frame = _frame(axis(argument, "x", "silhouette"))
    given = _outline(np.array(start.surface.vertices), np.array(start.surface.faces), frame)
    rings = [np.asarray(polygon, dtype=np.float64) for polygon in given.to_polygons()]

    def measure(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> tuple[float, np.ndarray]:
        section = _outline(vertices, faces, frame)
        where, vertex, slope = _slopes(section, vertices, faces, frame)
        inside, edge = _inside(where, rings, 1e-6 * start.longest)
        side = np.where(edge, 0.0, np.where(inside, -1.0, 1.0))
        sensitivity = np.zeros_like(vertices)
        np.add.at(sensitivity, vertex, (side[:, None] * slope) @ frame)
        return (section - given).area() + (given - section).area(), sensitivity

    return measure


def _inside(points: np.ndarray, rings: list[np.ndarray], width: float) -> tuple[np.ndarray, np.ndarray]:
    """(N,) whether points lie inside of closed rings by the even-odd rule, and whether on their edges."""
    inside, edge = np.zeros(len(points), bool), np.zeros(len(points), bool)
    x, y = points[:, :1], points[:, 1:]
    for ring in rings:
        a, b = ring, np.roll(ring, -1, axis=0)
        along = b - a
        crossing = (a[:, 1] > y) != (b[:, 1] > y)
        rise = np.where(along[:, 1] == 0, 1.0, along[:, 1])
        at = a[:, 0] + (y - a[:, 1]) / rise * along[:, 0]
        inside ^= (crossing & (x < at)).sum(axis=1) % 2 == 1
        length = np.maximum((along**2).sum(axis=1), np.finfo(float).tiny)
        t = np.clip(((x - a[:, 0]) * along[:, 0] + (y - a[:, 1]) * along[:, 1]) / length, 0, 1)
        off = np.hypot(x - a[:, 0] - t * along[:, 0], y - a[:, 1] - t * along[:, 1])
        edge |= off.min(axis=1) < width
    return inside, edge


FRONTAL_AREA, SILHOUETTE = (
    Objective(_frontal_area, power=2, labelled=False),
    Objective(_silhouette, power=2, labelled=False),
)
