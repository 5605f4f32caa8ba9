"""Lids over the openings of a surface: triangles that close each of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.shapes.orientation import split_bodies
from partwright.shapes.topology import EdgeTable, boundary_loops

_FLAT = 1e-6  # unit lengths: a rim that leaves its plane by less is flat
_DIGITS = 5  # of a plane's numbers, that rims in one plane share


@dataclass(frozen=True)
class Lid:
    """triangles: (T, 3) vertices; -1 stands for the lid's own `middle` (3,), which only a fan has. rim: the
    vertices (K,) around the opening. patch: number of the surface's patch that is open there."""

    triangles: NDArray[np.int64]
    rim: NDArray[np.int64]
    patch: int
    middle: NDArray[np.float64] | None = None

    def corners(self, vertices: NDArray[np.float64]) -> NDArray[np.float64]:
        """(T, 3, 3)"""
        places = vertices[self.triangles]
        if self.middle is not None:
            places[self.triangles < 0] = self.middle
        return places


def lids_over(vertices: NDArray[np.float64], edges: EdgeTable) -> list[Lid]:
    """One over each opening of a surface with vertices (V, 3) in the unit frame.

    Flat rims are filled within their outline, which may have islands; others get a fan from their middle.
    Triangles run against the surface's half-edges, so that both together are wound the same way.
    """
    loops = boundary_loops(edges.unbalanced_half_edges)
    owners = _owners(edges, loops)
    areas = [_area_vector(vertices[loop]) for loop in loops]
    together: dict[tuple[float, ...], list[int]] = {}
    lids = []
    for k, (loop, area) in enumerate(zip(loops, areas, strict=True)):
        plane = _plane(vertices[loop], area)
        if plane is None:
            lids.append(_fan(vertices, loop, owners[k]))
        else:
            together.setdefault((float(owners[k]), *plane), []).append(k)
    for group in together.values():
        lids += _flat_lids(vertices, [loops[k] for k in group], [areas[k] for k in group], owners[group[0]])
    return lids


def with_lids(
    vertices: NDArray[np.float64], edges: EdgeTable, lids: Sequence[Lid]
) -> tuple[NDArray[np.float64], EdgeTable]:
    """The surface with lids, and its vertices with their middles."""
    faces = [edges.faces]
    middles: list[NDArray[np.float64]] = []
    for lid in lids:
        number = len(vertices) + len(middles)
        faces.append(np.where(lid.triangles < 0, number, lid.triangles))
        if lid.middle is not None:
            middles.append(lid.middle)
    if middles:
        vertices = np.concatenate([vertices, np.stack(middles)])
    return vertices, EdgeTable(np.concatenate(faces))


def _owners(edges: EdgeTable, loops: Sequence[NDArray[np.int64]]) -> list[int]:
    """The patch that has most of each loop's half-edges."""
    faces, patch = edges.faces, edges.patches
    count = int(faces.max(initial=0)) + 1
    key = (faces * count + np.roll(faces, -1, axis=1)).ravel()
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    found = []
    for loop in loops:
        at = order[np.searchsorted(ordered, loop * count + np.roll(loop, -1))]
        numbers, times = np.unique(patch[at // 3], return_counts=True)
        found.append(int(numbers[times.argmax()]))
    return found


def _area_vector(rim: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) normal of a rim (K, 3), about which it runs counterclockwise, as long as twice its area."""
    away = rim - rim[0]
    return np.asarray(np.cross(away, np.roll(away, -1, axis=0)).sum(axis=0))


def _plane(rim: NDArray[np.float64], area: NDArray[np.float64]) -> tuple[float, ...] | None:
    """What all rims (K, 3) in one plane have in common, whichever way they run; None for one in no plane."""
    length = float(np.linalg.norm(area))
    if length < _FLAT**2:
        return None
    normal = area / length
    height = rim @ normal
    if np.ptp(height) > _FLAT:
        return None
    sign = np.sign(normal[np.abs(normal).argmax()])
    return tuple(np.round(sign * np.append(normal, height.mean()), _DIGITS) + 0.0)


def _flat_lids(
    vertices: NDArray[np.float64],
    loops: Sequence[NDArray[np.int64]],
    areas: Sequence[NDArray[np.float64]],
    patch: int,
) -> Iterator[Lid]:
    """Over the openings whose rims, and those of islands in them, lie in one plane."""
    if len(loops) == 1:
        yield _flat_lid(vertices, loops[0], areas[0], patch)
        return
    triangles = _triangulated(vertices, loops, np.sum(areas, axis=0))
    wanted = np.concatenate([np.stack([np.roll(loop, -1), loop], axis=1) for loop in loops])
    found = EdgeTable(triangles)
    if len(triangles) and _same_rows(found.unbalanced_half_edges, wanted):
        for mine in split_bodies(found.bodies):
            yield Lid(triangles[mine], np.unique(triangles[mine]), patch)
        return
    for loop, area in zip(loops, areas, strict=True):
        yield _flat_lid(vertices, loop, area, patch)


def _flat_lid(
    vertices: NDArray[np.float64], loop: NDArray[np.int64], area: NDArray[np.float64], patch: int
) -> Lid:
    """Over one rim; a fan where its outline crosses itself."""
    if len(loop) == 3:
        return Lid(loop[None, ::-1], loop, patch)
    triangles = _triangulated(vertices, [loop], area)
    return Lid(triangles, loop, patch) if len(triangles) == len(loop) - 2 else _fan(vertices, loop, patch)


def _triangulated(
    vertices: NDArray[np.float64], loops: Sequence[NDArray[np.int64]], normal: NDArray[np.float64]
) -> NDArray[np.int64]:
    """(T, 3) of what loops in one plane enclose, those of islands the other way round, wound against them."""
    from manifold3d import triangulate

    across = np.linalg.svd(normal[None])[2][1:]
    if np.linalg.det(np.stack([*across, normal])) < 0:
        across = across[::-1]
    found = np.asarray(triangulate([vertices[loop] @ across.T for loop in loops]), dtype=np.int64)
    return np.concatenate(loops)[found.reshape(-1, 3)[:, ::-1]]


def _same_rows(one: NDArray[np.int64], other: NDArray[np.int64]) -> bool:
    return np.array_equal(one[np.lexsort(one.T)], other[np.lexsort(other.T)])


def _fan(vertices: NDArray[np.float64], loop: NDArray[np.int64], patch: int) -> Lid:
    triangles = np.stack([np.roll(loop, -1), loop, np.full(len(loop), -1)], axis=1)
    return Lid(triangles, loop, patch, vertices[loop].mean(axis=0))
