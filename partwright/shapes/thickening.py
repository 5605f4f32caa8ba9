"""Sheets to walls: surfaces that were drawn without a thickness, given one.

Car bodies, cloth and leaves in assets for games enclose nothing; their walls are a rendering's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from partwright.rows import units
from partwright.shapes.cleaning import counted
from partwright.shapes.lids import lids_over, with_lids
from partwright.shapes.orientation import split_bodies
from partwright.shapes.topology import (
    EdgeTable,
    area_vectors,
    compacted,
    doubled_areas,
    is_plane,
    plane_normal,
    principal_axes,
)

_SMALL = 0.05  # of a body's surface, all its openings together
_NARROW = 0.5  # of a body's middle side, any of its openings
_LEAST_COSINE = 0.5  # between a corner's faces and their mean: sharper ones are blunted, not spikes


def thicken(
    vertices: NDArray[np.float64], edges: EdgeTable, thickness: float, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """With a wall in the place of each surface that is open, or closed and flat; half of it on either side.

    vertices: (V, 3), and thickness in units of theirs. A surface that meets others along an edge of three
    triangles or more gets a wall of its own. Bodies with small holes are closed, and get none.
    """
    vertices, edges = _with_small_holes_closed(vertices, edges, notes)
    faces, sheets = _parted(vertices, edges)
    count = int(sheets.max(initial=-1)) + 1
    if count == 0:
        notes.append("no surface is open or flat, so none was given a thickness")
        return vertices, edges
    is_solid = sheets < 0
    places, rows = np.unique(
        np.stack([np.repeat(sheets[~is_solid], 3), faces[~is_solid].ravel()], axis=1),
        axis=0,
        return_inverse=True,
    )
    middle, sheet = vertices[places[:, 1]], rows.reshape(-1, 3)
    step = thickness / 2 * _outward(middle, sheet)
    rim = EdgeTable(sheet).unbalanced_half_edges
    start, end = rim.T
    far = len(middle)
    walls = [
        sheet,
        sheet[:, ::-1] + far,
        np.stack([end, start, start + far], axis=1),
        np.stack([end, start + far, end + far], axis=1),
    ]
    notes.append(f"gave {counted(count, 'sheet')} a thickness")
    vertices = np.concatenate([middle + step, middle - step, vertices])
    used, faces = compacted(np.concatenate([*walls, faces[is_solid] + 2 * far]), len(vertices))
    return vertices[used], EdgeTable(faces)


def _with_small_holes_closed(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """A body whose openings are a small share of its surface, and not as wide as it, is a solid that lacks a
    few faces; a pipe is none."""
    lids = lids_over(vertices, edges) if edges.balance.any() else []
    first = np.unique(edges.patches, return_index=True)[1]
    body = np.array([edges.bodies[first[lid.patch]] for lid in lids], np.int64)
    lid_area = [np.linalg.norm(area_vectors(lid.corners(vertices)), axis=1).sum() for lid in lids]
    area = np.bincount(edges.bodies, doubled_areas(vertices, edges.faces))
    small = np.bincount(body, lid_area, len(area)) < _SMALL * area
    for lid, one in zip(lids, body, strict=True):
        if small[one]:
            wide = _sides(vertices[lid.rim])[2]
            small[one] = wide < _NARROW * _sides(vertices[edges.faces[edges.bodies == one].ravel()])[1]
    chosen = [lid for lid, one in zip(lids, body, strict=True) if small[one]]
    if not chosen:
        return vertices, edges
    notes.append(f"filled {counted(len(chosen), 'small hole')}")
    return with_lids(vertices, edges, chosen)


def _sides(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) ascending, of the box along the principal axes of points (N, 3)."""
    return np.sort(np.ptp(points @ principal_axes(points), axis=0))


def _parted(vertices: NDArray[np.float64], edges: EdgeTable) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Triangles (F, 3), and the number (F,) of the sheet that each is of, -1 for those of solids. Of a sheet
    that is drawn on both sides only one side is there."""
    faces = edges.faces
    number = np.full(len(faces), -1)
    kept = np.ones(len(faces), bool)
    count = 0
    for body, is_open in zip(split_bodies(edges.bodies), edges.open_bodies, strict=True):
        corners = vertices[faces[body]]
        if is_open:
            for sheet in _sheets_of(faces, edges.patches, body):
                number[sheet] = count
                count += 1
        elif is_plane(corners.reshape(-1, 3)):
            above = area_vectors(corners) @ plane_normal(corners.reshape(-1, 3)) > 0
            number[body[above]] = count
            kept[body[~above]] = False
            count += 1
    return faces[kept], number[kept]


def _sheets_of(
    faces: NDArray[np.int64], patch: NDArray[np.int64], body: NDArray[np.int64]
) -> list[NDArray[np.int64]]:
    """Of an open body's triangles those of each patch that is open; but where all that do not end free close
    among themselves, as a ball with a brim does, only those that do."""
    patches = [body[one] for one in split_bodies(np.unique(patch[body], return_inverse=True)[1])]
    free = body[EdgeTable(faces[body]).open_faces]
    ends_free = [bool(np.isin(free, one).any()) for one in patches]
    rest = [one for one, is_free in zip(patches, ends_free, strict=True) if not is_free]
    if rest and not EdgeTable(faces[np.concatenate(rest)]).balance.any():
        return [one for one, is_free in zip(patches, ends_free, strict=True) if is_free]
    return [one for one in patches if EdgeTable(faces[one]).balance.any()]


def _outward(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(V, 3): from each vertex to where the planes of its faces (F, 3) meet after a step of one along their
    normals; where they are turned far from one another, not as far."""
    corners = vertices[faces]
    normal = units(area_vectors(corners))
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    cross = np.linalg.norm(np.cross(ahead, behind), axis=2)
    angle = np.arctan2(cross, (ahead * behind).sum(axis=2))
    at = faces.ravel()

    def summed(values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.bincount(at, values, len(vertices)).astype(np.float64)

    weight = angle.ravel()
    each = np.repeat(normal, 3, axis=0)
    mean = np.stack([summed(weight * each[:, k]) for k in range(3)], axis=1)
    mean = units(mean)
    cosine = summed(weight * (each * mean[at]).sum(axis=1)) / np.maximum(
        summed(weight), np.finfo(np.float64).tiny
    )
    return np.asarray(mean / np.maximum(cosine, _LEAST_COSINE)[:, None])
