"""Openings of a surface: a lid of triangles over each that is one, and how much of it was missing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.cleaning import counted
from partwright.shapes.distance import MeshDistance
from partwright.shapes.lids import lids_over, with_lids
from partwright.shapes.sampling import uniform_box
from partwright.shapes.topology import EdgeTable, area_vectors, components, doubled_areas

_HALF = 0.3  # a lid over a true opening sees a winding number within 0.5 +- this on both of its sides
_STEP = 1e-4
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

    def and_more(self, others: Openings) -> Openings:
        """Both together."""
        largest = others.largest if others.share > self.share else self.largest
        return Openings(self.count + others.count, min(1.0, self.share + others.share), largest)


def fill_holes(
    vertices: NDArray[np.float64], edges: EdgeTable, notes: list[str]
) -> tuple[NDArray[np.float64], EdgeTable, Openings]:
    """Close every opening that one lid closes.

    The rim of a loose patch that other patches already cover is no opening: there the winding number is near
    0 or 1, not near one half, and the patch stays as it is.
    """
    faces = edges.faces
    # A closed body around an opening, or across it, says nothing about it.
    open_ = faces[edges.open_bodies[edges.bodies]]
    source = MeshDistance(vertices, open_, open_, closed=False)
    found = lids_over(vertices, edges)
    is_opening = _are_openings(source, [lid.corners(vertices) for lid in found])
    lids = [lid for lid, over in zip(found, is_opening, strict=True) if over]
    if not lids:
        return vertices, edges, Openings()
    area = np.array([np.linalg.norm(area_vectors(lid.corners(vertices)), axis=1).sum() for lid in lids])
    largest = vertices[lids[int(area.argmax())].rim].mean(axis=0)
    vertices, edges = with_lids(vertices, edges, lids)
    share = float(area.sum() / doubled_areas(vertices, edges.faces).sum())
    notes.append(f"filled {counted(len(lids), 'hole')} ({share:.1%} of the surface)")
    x, y, z = largest.tolist()
    return vertices, edges, Openings(len(lids), share, (x, y, z))


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
    x, y, z = np.average(vertices[rim[longest]].mean(axis=1), axis=0, weights=length[longest]).tolist()
    return filled.and_more(Openings(int(label.max()) + 1, share, (x, y, z)))


def openings_of(vertices: NDArray[np.float64], faces: NDArray[np.int64], made: NDArray[np.bool_]) -> Openings:
    """Of a closed surface of which the marked triangles (F,) were made up: each connected piece is one."""
    if not made.any():
        return Openings()
    area = doubled_areas(vertices, faces)
    pieces = EdgeTable(faces[made]).bodies
    largest = faces[made][pieces == np.bincount(pieces, area[made]).argmax()]
    x, y, z = vertices[largest].mean(axis=(0, 1)).tolist()
    return Openings(int(pieces.max()) + 1, float(area[made].sum() / area.sum()), (x, y, z))


def _are_openings(source: MeshDistance, lids: list[NDArray[np.float64]]) -> list[bool]:
    """Of lids (T, 3, 3) each, all looked at in one go."""
    if not lids:
        return []
    beside = []
    for lid in lids:
        normal = area_vectors(lid).sum(axis=0)
        normal /= max(float(np.linalg.norm(normal)), np.finfo(np.float64).tiny)
        place = lid.mean(axis=1)
        beside.append(np.concatenate([place - _STEP * normal, place + _STEP * normal]))
    off = np.abs(source.winding(np.concatenate(beside)) - 0.5)
    ends = np.cumsum([len(points) for points in beside])[:-1]
    return [bool(np.median(one) < _HALF) for one in np.split(off, ends)]
