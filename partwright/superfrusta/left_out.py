"""Small detail that no feature has: letters that are engraved in a face or stand out of it, a shallow mark, a
small hole right through.

It hardly shows in any score, yet who reads the features should know that it is not among them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.part_roles import FREEFORM
from partwright.assembly import Assembly
from partwright.metrics.deviation import places_in
from partwright.rows import units
from partwright.shapes import Shape, length_text
from partwright.shapes.topology import EdgeTable, area_vectors, components
from partwright.superfrusta.far_places import Solid
from partwright.superfrusta.feature_mending import FAR

_LEAST = 3e-3  # unit lengths: what is less deep is no detail; what is deeper than `FAR` is told otherwise
_SMALL, _CRUMB = 0.02, 2e-5  # of the surface's area, that what a detail covers is at most, and at least
_ON = 1e-3  # unit lengths: what is as near to what was fitted lies on it
_ALIKE = 0.95  # length of the mean of unit normals, and cosine, of what faces one way
_AROUND = 0.8  # of its outline, along which the face that it is on goes on
_GOOD = 0.95  # of the rest of the surface, that is off by less than the least: else places are other faults


@dataclass(frozen=True)
class Detail:
    """A small place of a face that was fitted, which goes on around it. depth: unit lengths by which the
    shape stands out there at most; negative where it is cut in. area: of the face, that it covers. box:
    (2, 3)."""

    depth: float
    area: float
    box: NDArray[np.float64]

    def is_beside(self, point: NDArray[np.float64]) -> bool:
        """Whether a point (3,) is one of its own."""
        room = abs(self.depth)
        return bool(((point > self.box[0] - room) & (point < self.box[1] + room)).all())


def left_out_warnings(shape: Shape, found: Sequence[Detail]) -> tuple[str, ...]:
    """One sentence for all; none where there is nothing."""
    if not found:
        return ()
    depth = float(shape.frame.length_from_unit(max(abs(detail.depth) for detail in found)))
    places = places_in(shape, (detail.box.mean(axis=0) for detail in found))
    ways = {True: "stands out", False: "is cut in"}
    how = " or ".join(dict.fromkeys(ways[detail.depth > 0] for detail in found))
    many = f" ({len(found)} places, as letters are)" if len(found) > 2 else ""
    return (
        f"left out: small detail{many} that {how} by {length_text(depth, shape.unit, 2)} at the {places}: "
        "no feature has it",
    )


def left_out(shape: Shape, own: Assembly, fitted: Solid) -> list[Detail]:
    """Of a shape beside what was fitted to it, the largest first; none where the fit is poor, and none of
    what freeform steps leave. own: what was fitted, in the unit frame; fitted: its solid."""
    steps = [part.bounds() for part in own.parts if part.name.startswith(FREEFORM)]
    found = _details(*shape.unit_mesh, fitted)
    return [
        detail
        for detail in found
        if not any((detail.box[0] < high).all() and (detail.box[1] > low).all() for low, high in steps)
    ]


def _facing(normals: NDArray[np.float64], area: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """(3,) unit, the way in which walls (N, 3) face, or face away, as both sides do of what a hole goes
    through; and how nearly they do, 1 at most."""
    weight, axes = np.linalg.eigh(np.einsum("n,ni,nj->ij", area, normals, normals))
    return axes[:, 2], float(np.sqrt(weight[2] / weight.sum()))


def _details(vertices: NDArray[np.float64], faces: NDArray[np.int64], fitted: Solid) -> list[Detail]:
    corners = vertices[faces]
    normal = area_vectors(corners) / 2
    area = np.linalg.norm(normal, axis=1)
    at_middle, nearest = fitted.surface.signed_nearest(corners.mean(axis=1))
    wall = fitted.walls[nearest]
    off = np.column_stack([at_middle, fitted.surface.signed(vertices)[faces]])
    off = np.take_along_axis(off, np.abs(off).argmax(axis=1)[:, None], axis=1)[:, 0]
    is_off = np.abs(off) > _ON
    edges, beside = EdgeTable(faces).pairs
    length = np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)
    one, other = beside.T
    together = is_off[one] & is_off[other] & (off[one] * off[other] > 0)
    label = components(len(faces), one[together], other[together])
    extent, whole = np.bincount(label, area), float(area.sum())
    rest = np.ones(len(faces), bool)
    found: list[Detail] = []
    for k in np.unique(label[is_off]):
        if extent[k] < _CRUMB * whole:
            continue
        mine = label == k
        depth = float(off[mine][np.abs(off[mine]).argmax()])
        up, alike = _facing(wall[mine], area[mine])
        covered = abs(float((normal[mine] @ up).sum()))
        if not _LEAST < abs(depth) < FAR or alike < _ALIKE or covered > _SMALL * whole:
            continue
        rim = mine[one] != mine[other]
        outer = np.where(mine[one], other, one)[rim]
        goes_on = ~is_off[outer] & (np.abs(units(normal[outer]) @ up) > _ALIKE)
        if length[rim][goes_on].sum() > _AROUND * length[rim].sum():
            ends = corners[mine].min(axis=(0, 1)), corners[mine].max(axis=(0, 1))
            found.append(Detail(depth, covered, np.stack(ends)))
            rest &= ~mine
    good = area[rest & (np.abs(at_middle) < _LEAST)].sum() >= _GOOD * area[rest].sum()
    return sorted(found, key=lambda detail: -detail.area) if good else []
