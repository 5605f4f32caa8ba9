"""Faces that whoever drew a shape left out, since nobody sees them, and sheets that enclose nothing.

Assets for games are put together of open bodies: walls without a floor on a plate, a panel without a back
before a box, and pictures on sheets in front. What another body or the ground covers is no question to close.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from partwright.shapes.cleaning import counted
from partwright.shapes.distance import MeshDistance
from partwright.shapes.holes import lid_over
from partwright.shapes.orientation import split_bodies
from partwright.shapes.sampling import sample_triangles
from partwright.shapes.topology import EdgeTable, boundary_loops, components

_TOUCHING = 2e-3  # unit lengths, 0.1 % of the longest side: what is as near lies on it
_PROBES = 32  # points of a lid that are looked at
_COVERED = 0.9  # of them
_FLAT = 1e-4  # unit lengths: what is thinner is a sheet
_SPACING = 0.01  # unit lengths between points of a rim
_ALONG = 0.02  # unit lengths: a rim that is as near runs along another


def close_hidden(
    vertices: NDArray[np.float64], edges: EdgeTable, up: str | None, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """Close the openings that another body covers, or the ground where the up axis is known.

    vertices: (V, 3), unit frame. up: "x", "y", "-z" ... or None.
    """
    faces = edges.faces
    patch = components(len(faces), *edges.pairs[1].T)
    sheet = np.array([_is_flat(vertices[faces[one]].reshape(-1, 3)) for one in split_bodies(patch)])
    lids: list[NDArray[np.int64]] = []
    owners: list[int] = []
    corners = vertices
    for loop, owner in _rims(edges, patch):
        if sheet[owner]:
            continue
        corners, lid = lid_over(corners, loop)
        lids.append(lid)
        owners.append(owner)
    if not lids:
        return vertices, edges
    probes = np.stack([sample_triangles(corners, lid, _PROBES, 0)[0] for lid in lids])
    hidden = _covered(vertices, faces, patch, probes, np.array(owners)) | _on_ground(vertices, probes, up)
    closed = np.flatnonzero(hidden.mean(axis=1) >= _COVERED)
    if len(closed) == 0:
        return vertices, edges
    notes.append(f"closed {counted(len(closed), 'opening')} against other bodies or the ground")
    return corners, EdgeTable(np.concatenate([faces, *(lids[one] for one in closed)]))


def drop_sheets(vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]) -> EdgeTable:
    """Without flat sheets that stand by themselves: decals, panes, the ground.

    A sheet whose rim runs along another's, or along that of an opening, is the side of something.
    """
    count = 0
    while loose := _loose_sheets(vertices, edges):  # what lies along such a sheet may be another
        count += len(loose)
        edges = EdgeTable(np.delete(edges.faces, np.concatenate(loose), axis=0))
    if count:
        notes.append(f"left out {counted(count, 'loose flat sheet')}")
    return edges


def _loose_sheets(vertices: NDArray[np.float64], edges: EdgeTable) -> list[NDArray[np.int64]]:
    """Face numbers of each, none where there is nothing else."""
    members = split_bodies(edges.bodies)
    open_ = [members[one] for one in np.flatnonzero(edges.open_bodies)]
    flat = [_is_flat(vertices[edges.faces[one]].reshape(-1, 3)) for one in open_]
    if not any(flat) or sum(flat) == len(members):
        return []
    rims = [_rim_points(vertices, EdgeTable(edges.faces[one])) for one in open_]
    return [one for k, one in enumerate(open_) if flat[k] and not _beside(rims[k], rims[:k] + rims[k + 1 :])]


def _rim_points(vertices: NDArray[np.float64], edges: EdgeTable) -> NDArray[np.float64]:
    """Points (N, 3) along what is not balanced, `_SPACING` apart at most."""
    start, end = vertices[edges.unbalanced_half_edges].swapaxes(0, 1)
    steps = np.ceil(np.linalg.norm(end - start, axis=1) / _SPACING).astype(int).clip(1)
    of = np.repeat(np.arange(len(steps)), steps)
    part = (np.arange(len(of)) - np.repeat(np.cumsum(steps) - steps, steps)) / steps[of]
    return np.asarray(start[of] + part[:, None] * (end - start)[of])


def _beside(rim: NDArray[np.float64], others: list[NDArray[np.float64]]) -> bool:
    """Whether half of a rim (N, 3) runs along others."""
    if not others:
        return False
    away, _ = cKDTree(np.concatenate(others)).query(rim, distance_upper_bound=_ALONG)
    return bool(np.mean(np.isfinite(away)) > 0.5)


def _is_flat(points: NDArray[np.float64]) -> bool:
    centred = points - points.mean(axis=0)
    normal = np.linalg.eigh(centred.T @ centred)[1][:, 0]
    return bool(np.ptp(centred @ normal) < _FLAT)


def _rims(edges: EdgeTable, patch: NDArray[np.int64]) -> list[tuple[NDArray[np.int64], int]]:
    """Vertex loops along what is not balanced, and the patch that has most of each."""
    faces = edges.faces
    count = int(faces.max()) + 1
    key = (faces * count + np.roll(faces, -1, axis=1)).ravel()
    order = np.argsort(key, kind="stable")
    found = []
    for loop in boundary_loops(edges.unbalanced_half_edges):
        wanted = loop * count + np.roll(loop, -1)
        first = np.searchsorted(key[order], wanted, side="left")
        last = np.searchsorted(key[order], wanted, side="right")
        at = np.concatenate([order[a:b] for a, b in zip(first, last, strict=True)])
        found.append((loop, int(np.bincount(patch[at // 3]).argmax())))
    return found


def _covered(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    patch: NDArray[np.int64],
    probes: NDArray[np.float64],
    owners: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Which of the probes (L, P, 3) of lids lie on or within patches other than their owner (L,)."""
    whole = MeshDistance(vertices, faces, faces, closed=False)
    points = probes.reshape(-1, 3)
    triangle, distance = whole.nearest(points)
    touching = (distance < _TOUCHING) & (patch[triangle] != np.repeat(owners, probes.shape[1]))
    winding = whole.winding(points).reshape(probes.shape[:2])
    for owner in np.unique(owners):
        own = faces[patch == owner]
        mine = owners == owner
        alone = MeshDistance(vertices, own, own, closed=False).winding(probes[mine].reshape(-1, 3))
        winding[mine] -= alone.reshape(-1, probes.shape[1])
    return touching.reshape(probes.shape[:2]) | (winding > 0.5)


def _on_ground(
    vertices: NDArray[np.float64], probes: NDArray[np.float64], up: str | None
) -> NDArray[np.bool_]:
    """Which of the probes (L, P, 3) lie as low as anything does."""
    if up is None:
        return np.zeros(probes.shape[:2], bool)
    axis, sign = "xyz".index(up[-1]), -1.0 if up.startswith("-") else 1.0
    height = sign * probes[..., axis]
    return np.asarray(height < (sign * vertices[:, axis]).min() + _TOUCHING)
