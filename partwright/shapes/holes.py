"""Openings of a surface: a lid of triangles over each that is one, and how much of it was missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.cleaning import counted
from partwright.shapes.distance import MeshDistance
from partwright.shapes.sampling import uniform_box
from partwright.shapes.topology import EdgeTable, area_vectors, boundary_loops, components, doubled_areas

_HALF = 0.3  # a lid over a true opening sees a winding number within 0.5 +- this on both of its sides
_STEP = 1e-4
_FLAT = 1e-6  # unit lengths: a rim that leaves its plane by less is flat
_PROBES = 4000  # points from which what stays open is looked at


@dataclass(frozen=True)
class Openings:
    """What the input's surface left open and repair made up, or left to the winding number.

    count: openings. share: of the whole surface's area that they take, 0 to 1. largest: middle (3,) of the
    largest, None where there is none.
    """

    count: int = 0
    share: float = 0.0
    largest: tuple[float, float, float] | None = None


def fill_holes(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable, Openings]:
    """Close every opening that one lid closes.

    The rim of a loose patch that other patches already cover is no opening: there the winding number is near
    0 or 1, not near one half, and the patch stays as it is.
    """
    faces = edges.faces
    loops = boundary_loops(edges.unbalanced_half_edges)
    # A closed body around an opening, or across it, says nothing about it.
    open_ = faces[edges.open_bodies[edges.bodies]]
    source = MeshDistance(vertices, open_, open_, closed=False)
    lids: list[NDArray[np.int64]] = []
    middles: list[NDArray[np.float64]] = []
    closed = vertices
    for loop in loops:
        corners, lid = lid_over(closed, loop)
        if _is_opening(source, corners[lid]):
            closed = corners
            lids.append(lid)
            middles.append(vertices[loop].mean(axis=0))
    if not lids:
        return vertices, edges, Openings()
    faces = np.concatenate([faces, *lids])
    area = np.array([_area(closed, one) for one in lids])
    share = float(area.sum()) / _area(closed, faces)
    notes.append(f"filled {counted(len(lids), 'hole')} ({share:.1%} of the surface)")
    x, y, z = middles[int(area.argmax())].tolist()
    return closed, EdgeTable(faces), Openings(len(lids), share, (x, y, z))


def lid_over(
    vertices: NDArray[np.float64], loop: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """All vertices with what a lid adds, and its triangles (T, 3), over the opening whose rim is a loop (K,).

    Half-edges of the surface run along the rim, so the lid's run against it. A flat rim is filled between its
    own corners; another gets a fan from its middle.
    """
    rim = vertices[loop]
    normal = np.cross(rim - rim[0], np.roll(rim, -1, axis=0) - rim[0]).sum(axis=0)
    length = float(np.linalg.norm(normal))
    if length > _STEP**2 and np.ptp(rim @ (normal / length)) < _FLAT:
        from manifold3d import triangulate

        across = np.linalg.svd(normal[None])[2][1:]
        across[1] *= np.sign(np.linalg.det(np.stack([*across, normal])))
        flat = np.asarray(triangulate([rim @ across.T]), dtype=np.int64)
        if len(flat) == len(loop) - 2:
            return vertices, loop[flat[:, ::-1]]
    middle = np.full(len(loop), len(vertices))
    fan = np.stack([np.roll(loop, -1), loop, middle], axis=1)
    return np.concatenate([vertices, rim.mean(axis=0)[None]]), fan


def with_what_stays_open(filled: Openings, vertices: NDArray[np.float64], edges: EdgeTable) -> Openings:
    """`filled` and what no lid closes: there the share is that of directions, from points within, in which
    no surface is met, which is what their winding number lacks to 1."""
    faces = edges.faces
    points = uniform_box(vertices.min(axis=0), vertices.max(axis=0), _PROBES, 0)
    winding = MeshDistance(vertices, faces, faces, closed=False).winding(points)
    inside = winding > 0.5
    share = float(np.clip(1 - winding[inside], 0, None).mean()) if inside.any() else 0.0
    rim = edges.unbalanced_half_edges
    used, numbered = np.unique(rim, return_inverse=True)
    numbered = numbered.reshape(-1, 2)
    label = components(len(used), numbered[:, 0], numbered[:, 1])[numbered[:, 0]]
    length = np.linalg.norm(np.diff(vertices[rim], axis=1)[:, 0], axis=1)
    longest = label == np.bincount(label, length).argmax()
    largest = filled.largest
    if share > filled.share:
        x, y, z = np.average(vertices[rim[longest]].mean(axis=1), axis=0, weights=length[longest]).tolist()
        largest = (x, y, z)
    return Openings(filled.count + int(label.max()) + 1, min(1.0, filled.share + share), largest)


def _is_opening(source: MeshDistance, lid: NDArray[np.float64]) -> bool:
    """lid: (T, 3, 3)."""
    normal = area_vectors(lid).sum(axis=0)
    normal /= max(float(np.linalg.norm(normal)), np.finfo(np.float64).tiny)
    place = lid.mean(axis=1)
    winding = source.winding(np.concatenate([place - _STEP * normal, place + _STEP * normal]))
    return bool(np.median(np.abs(winding - 0.5)) < _HALF)


def _area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    return float(doubled_areas(vertices, faces).sum() / 2)
