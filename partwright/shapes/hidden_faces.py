"""Faces that whoever drew a shape left out, since nobody sees them, and sheets that enclose nothing.

Assets for games are put together of open bodies: walls without a floor on a plate, a panel without a back
before a box, and pictures on sheets in front. What another body or the ground covers is no question to close.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.cleaning import counted
from partwright.shapes.distance import MeshDistance
from partwright.shapes.lids import lids_over, with_lids
from partwright.shapes.orientation import split_bodies
from partwright.shapes.sampling import sample_triangles
from partwright.shapes.topology import EdgeTable, area_vectors, compacted, doubled_areas, is_plane, is_sheet

_TOUCHING = 2e-3  # unit lengths, 0.1 % of the longest side: what is as near lies on it
_PROBES = 32  # points of a lid that are looked at
_COVERED = 0.9  # of them
_ON_GROUND = 1e-4  # unit lengths above it
_A_HALF = 0.25  # a winding number this near to a half is one
_SPACING = 0.01  # unit lengths between points of a rim
_ALONG = 0.02  # unit lengths: a rim that is as near runs along another


@dataclass(frozen=True)
class Ground:
    """up: (3,) unit vector; height: along it, unit lengths."""

    up: NDArray[np.float64]
    height: float


def lift_from_ground(
    vertices: NDArray[np.float64], edges: EdgeTable, ground: Ground | None
) -> tuple[EdgeTable, NDArray[np.int64]]:
    """Without the triangles (N, 3) of open bodies that lie on the ground and face up, and those: a road
    between pavements would be closed against the ground to something of no thickness.

    vertices: (V, 3), unit frame.
    """
    faces = edges.faces
    if ground is None:
        return edges, faces[:0]
    low = (vertices @ ground.up < ground.height + _ON_GROUND)[faces].all(axis=1)
    lying = low & edges.open_bodies[edges.bodies] & (area_vectors(vertices[faces]) @ ground.up > 0)
    if lying.all() or not lying.any():
        return edges, faces[:0]
    return EdgeTable(faces[~lying]), faces[lying]


def close_hidden(
    vertices: NDArray[np.float64], edges: EdgeTable, ground: Ground | None, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """Close the openings that another body covers, or the ground where it is known.

    vertices: (V, 3), unit frame.
    """
    faces = edges.faces
    members = split_bodies(edges.patches)
    if ground is None and len(members) == 1:
        return vertices, edges
    lids = lids_over(vertices, edges)
    sheets = {one for one in {lid.patch for lid in lids} if is_sheet(vertices[faces[members[one]].ravel()])}
    lids = [lid for lid in lids if lid.patch not in sheets]
    if not lids:
        return vertices, edges
    probes = np.stack([_points_on(lid.corners(vertices)) for lid in lids])
    hidden = _covered(vertices, edges, members, probes, np.array([lid.patch for lid in lids]))
    if ground is not None:
        hidden |= probes @ ground.up < ground.height + _TOUCHING
    closed = [lids[one] for one in np.flatnonzero(hidden.mean(axis=1) >= _COVERED)]
    if not closed:
        return vertices, edges
    notes.append(f"closed {counted(len(closed), 'opening')} against other bodies or the ground")
    return with_lids(vertices, edges, closed)


def drop_sheets(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """Without flat sheets that stand by themselves: decals, panes, the ground; and without vertices that no
    triangle uses.

    A sheet whose rim runs along another's, or along that of an opening, is the side of something, and so is
    one with an inside behind it. One that is drawn on both sides has no rim.
    """
    loose = _loose_sheets(vertices, edges)
    if loose:
        notes.append(f"left out {counted(len(loose), 'loose flat sheet')}")
        edges = EdgeTable(np.delete(edges.faces, np.concatenate(loose), axis=0))
    used, faces = compacted(edges.faces, len(vertices))
    return (vertices, edges) if len(used) == len(vertices) else (vertices[used], EdgeTable(faces))


def _loose_sheets(vertices: NDArray[np.float64], edges: EdgeTable) -> list[NDArray[np.int64]]:
    """The triangles of each sheet that stands by itself, unless the shape has little else."""
    members = split_bodies(edges.bodies)
    if len(members) == 1:
        return []
    corners = [vertices[edges.faces[one].ravel()] for one in members]
    flat = np.array(
        [
            (is_sheet if is_open else is_plane)(one)
            for one, is_open in zip(corners, edges.open_bodies, strict=True)
        ]
    )
    if not flat.any() or flat.all():
        return []
    loose = [members[one] for one in np.flatnonzero(flat & ~edges.open_bodies)]
    open_ = [members[one] for one in np.flatnonzero(edges.open_bodies)]
    if open_:
        found = _loose(vertices, edges, open_, flat[edges.open_bodies])
        loose += [open_[one] for one in np.flatnonzero(found)]
    if not loose or not _is_beside_the_point(doubled_areas(vertices, edges.faces), loose):
        return []
    within = _with_inside(vertices, edges.faces, loose)
    return [sheet for sheet, needed in zip(loose, within, strict=True) if not needed]


def _loose(
    vertices: NDArray[np.float64],
    edges: EdgeTable,
    bodies: list[NDArray[np.int64]],
    flat: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """Which of the open bodies are flat and run along no other, those left out that are loose themselves."""
    from scipy.spatial import cKDTree

    rims = [_rim_points(vertices, EdgeTable(edges.faces[one])) for one in bodies]
    of = np.repeat(np.arange(len(rims)), [len(rim) for rim in rims])
    pairs = cKDTree(np.concatenate(rims)).query_pairs(_ALONG, output_type="ndarray")
    pairs = pairs[of[pairs[:, 0]] != of[pairs[:, 1]]]
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    loose = np.zeros(len(rims), bool)
    while True:
        met = np.unique(pairs[~loose[of[pairs[:, 1]]], 0])
        along = np.bincount(of[met], minlength=len(rims)) > 0.5 * np.bincount(of, minlength=len(rims))
        found = flat & ~along
        if (found == loose).all():
            return loose
        loose = found


def _with_inside(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], sheets: list[NDArray[np.int64]]
) -> list[bool]:
    """Whether each sheet parts inside from outside together with all that is no such sheet: the floor of a
    crate, whose walls and bottom are another body's. A decal on a wall and a pane do not.

    Where a sheet is the border, the winding number of the rest is a half, and that of both 1 and 0 beside it.
    On a surface it is a half, too.
    """
    rest = np.delete(faces, np.concatenate(sheets), axis=0)
    source = MeshDistance(vertices, rest, rest, closed=False)
    within = []
    for sheet in sheets:
        probes = _points_on(vertices[faces[sheet]])
        border = np.abs(source.winding(probes) - 0.5) < _A_HALF
        within.append(float((border & (source.exact(probes) > _TOUCHING)).mean()) > 0.5)
    return within


def _is_beside_the_point(area: NDArray[np.float64], sheets: list[NDArray[np.int64]]) -> bool:
    """Whether sheets but the largest, which may be the ground, have less area than all else: a shape of
    nothing but sheets, which no rim joins, is not to be left out for a crumb beside it."""
    areas = np.array([area[sheet].sum() for sheet in sheets])
    return bool(areas.sum() - areas.max() < area.sum() - areas.sum())


def _rim_points(vertices: NDArray[np.float64], edges: EdgeTable) -> NDArray[np.float64]:
    """Points (N, 3) along what is not balanced, `_SPACING` apart at most."""
    start, end = vertices[edges.unbalanced_half_edges].swapaxes(0, 1)
    steps = np.ceil(np.linalg.norm(end - start, axis=1) / _SPACING).astype(int).clip(1)
    of = np.repeat(np.arange(len(steps)), steps)
    part = (np.arange(len(of)) - np.repeat(np.cumsum(steps) - steps, steps)) / steps[of]
    return np.asarray(start[of] + part[:, None] * (end - start)[of])


def _points_on(triangles: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P, 3) of triangles (T, 3, 3)."""
    corners = triangles.reshape(-1, 3)
    return sample_triangles(corners, np.arange(len(corners)).reshape(-1, 3), _PROBES, 0)[0]


def _covered(
    vertices: NDArray[np.float64],
    edges: EdgeTable,
    members: list[NDArray[np.int64]],
    probes: NDArray[np.float64],
    owners: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Which of the probes (L, P, 3) of lids lie on or within patches other than their owner (L,).

    members: face numbers of each patch.
    """
    faces, patch = edges.faces, edges.patches
    whole = MeshDistance(vertices, faces, faces, closed=False)
    points = probes.reshape(-1, 3)
    triangle, distance = whole.nearest(points)
    touching = (distance < _TOUCHING) & (patch[triangle] != np.repeat(owners, probes.shape[1]))
    winding = whole.winding(points).reshape(probes.shape[:2])
    for owner in np.unique(owners):
        own = faces[members[owner]]
        mine = owners == owner
        alone = MeshDistance(vertices, own, own, closed=False).winding(probes[mine].reshape(-1, 3))
        winding[mine] -= alone.reshape(-1, probes.shape[1])
    return touching.reshape(probes.shape[:2]) | (winding > 0.5)
