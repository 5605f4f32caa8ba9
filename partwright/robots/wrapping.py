"""Triangles that bound no solid as one: what cannot be reached from outside is inside.

A lattice of distances to the surface is flooded from its border, through all that is farther from the surface
than a little more than a cell. What the flood does not reach wraps the triangles, with that thickness around
them; without it (a closing, in the terms of mathematical morphology) it is bounded by the triangles
themselves, and sheets that bound nothing are gone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import FlatShapeError, NoSurfaceError
from partwright.meshing import mesh_field
from partwright.meshing.manifolds import closed
from partwright.shapes import MeshDistance, UnitFrame
from partwright.shapes.flooding import reached_from_outside
from partwright.shapes.repair import consistent

if TYPE_CHECKING:
    from manifold3d import Manifold

_CELLS = 96  # along the longest side
_THICK = 1.2  # cells on either side of the surface; a gap of twice that is bridged
_FLAT = 0.2  # cells by which the wrap of fewer triangles may lie off: it has hundreds of thousands
_STEEP = 8.0  # cells that a whole winding number counts as
_NEAR = 2.0  # cells: distance from the triangles within which the winding number is not interpolated
_MOST_SHEETS = 0.5  # of what wraps the triangles: with less inside they bound no solid


def wrapped(vertices: np.ndarray, faces: np.ndarray) -> tuple[Manifold, Manifold]:
    """The solid that triangles bound, as far as they do, and the one that wraps them all.

    vertices: (V, 3). faces: (F, 3). Triangles that are mostly sheets bound what wraps them.

    Raises:
        FlatShapeError: nothing is left to wrap.
    """
    from scipy.ndimage import distance_transform_edt

    frame = UnitFrame.of(vertices[np.unique(faces)])
    unit = frame.to_unit(vertices)
    half = np.abs(unit[np.unique(faces)]).max(axis=0)
    cell = 2 * float(half.max()) / _CELLS
    thick = _THICK * cell
    counts = np.ceil((half + 3 * thick) / cell).astype(int)
    ticks = [cell * np.arange(-n, n + 1) for n in counts]
    points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    near = MeshDistance(unit, faces, faces, False).unsigned(points, within=4 * cell)
    distance = np.minimum(near, 4 * cell).reshape([2 * n + 1 for n in counts])
    outside = reached_from_outside(distance, distance > thick)
    around = np.where(outside, distance - thick, -np.maximum(thick - distance, 0.5 * cell))
    beyond = outside | (cell * distance_transform_edt(~outside) < thick)
    bounded = np.where(beyond, distance, -distance)
    wound = _wound(unit, faces, ticks, distance, beyond)
    beside = np.minimum(np.abs(wound) * _STEEP * cell, distance)  # exact at triangles, smooth across openings
    around = np.minimum(around, np.clip(-wound * _STEEP * cell, -0.5 * cell, np.inf))
    bounded = np.minimum(bounded, np.where(wound > 0, -beside, beside))
    whole = _level(around, counts, cell, frame)
    if whole is None:
        raise FlatShapeError("it encloses nothing that could be wrapped")
    inner = _level(bounded, counts, cell, frame)
    if inner is None or inner.volume() < _MOST_SHEETS * whole.volume():
        return whole, whole
    return inner, whole


def _wound(
    vertices: np.ndarray, faces: np.ndarray, ticks: list[np.ndarray], distance: np.ndarray, asked: np.ndarray
) -> np.ndarray:
    """By how much the winding number exceeds one half where it is asked for, -1 elsewhere.

    ticks: coordinates of the lattice (their number is odd); distance, asked: on it. Away from the triangles
    the winding number is harmonic, so it is interpolated between every other point.
    """
    from scipy.interpolate import RegularGridInterpolator

    wound = np.full(asked.shape, -1.0)
    vertices, faces = consistent(vertices, faces)
    if len(faces) == 0:
        return wound
    surface = MeshDistance(vertices, faces, faces, False)
    cell = ticks[0][1] - ticks[0][0]
    coarse = [axis[::2] for axis in ticks]
    at = np.stack(np.meshgrid(*coarse, indexing="ij"), axis=-1)
    known = surface.winding(at.reshape(-1, 3)).reshape(at.shape[:3])
    near = asked & (distance <= _NEAR * cell)
    far = np.argwhere(asked & ~near)
    place = np.stack([axis[far[:, k]] for k, axis in enumerate(ticks)], axis=-1)
    wound[tuple(far.T)] = RegularGridInterpolator(coarse, known)(place) - 0.5
    close = np.argwhere(near)
    place = np.stack([axis[close[:, k]] for k, axis in enumerate(ticks)], axis=-1)
    wound[tuple(close.T)] = surface.winding(place) - 0.5
    return _bounded(wound, ticks, np.abs(vertices).max(axis=0) + cell)


def _bounded(wound: np.ndarray, ticks: list[np.ndarray], half: np.ndarray) -> np.ndarray:
    """Without the regions that go on beyond a box of these half sides (3,): they lie behind sheets that face
    inwards, not in what the triangles go around."""
    from scipy.ndimage import label

    regions, _ = label(wound > 0)
    beyond = np.zeros(wound.shape, bool)
    for axis, (places, most) in enumerate(zip(ticks, half, strict=True)):
        np.moveaxis(beyond, axis, 0)[np.abs(places) > most] = True
    endless = np.unique(regions[beyond])
    return np.where(np.isin(regions, endless[endless > 0]), -1.0, wound)


def _level(values: np.ndarray, counts: np.ndarray, cell: float, frame: UnitFrame) -> Manifold | None:
    """The zero level of values on the lattice; None where it has none."""
    from scipy.ndimage import map_coordinates

    def level(places: np.ndarray) -> np.ndarray:
        index = (places / cell + counts).T
        return np.asarray(map_coordinates(values, index, order=1, mode="nearest"), np.float32)

    reach = (counts - 1) * cell
    try:
        mesh = mesh_field(level, -reach, reach, 2 * (counts - 1), lipschitz=3.0, sharp=False)
    except NoSurfaceError:
        return None
    vertices = frame.from_unit(mesh.vertices)
    solid = closed(vertices, mesh.faces)
    if solid.is_empty() or solid.volume() <= 0:
        return None
    return solid.simplify(_FLAT / _CELLS * float(np.ptp(vertices, axis=0).max()))
