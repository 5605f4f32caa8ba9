"""The quadrics among which a tree is chosen: detected surfaces, planes that part them, the box around all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.capri import quadric_rows as rows
from partwright.capri.detection import DetectedQuadric
from partwright.capri.oriented_points import OrientedPoints
from partwright.capri.quadric_rows import Row

_DUPLICATE_DISTANCE = 4e-3  # rows whose numbers differ by less are one
_TANGENCY_TOLERANCE = 0.03  # unit lengths and sine: how nearly a plane touches a cylinder
_MAX_PARTING_PLANES = 60  # at most so many planes that part


@dataclass(frozen=True)
class CandidatePool:
    """Rows (K, 10); complement (K,) marks the outside of a curved quadric, which is not convex."""

    rows: NDArray[np.float64]
    complement: NDArray[np.bool_]

    @classmethod
    def of(cls, given: list[Row], *, nested: bool, oriented: bool) -> CandidatePool:
        """Each quadric once, planes with both of their sides; with `nested` the outside of the others, too.

        oriented: keep cross terms; otherwise only rows without (the paper's seven coefficients).
        """
        kept: list[Row] = []
        for row in given:
            plain = row.copy()
            plain[rows.CROSS] = 0.0
            if not oriented and np.abs(row[rows.CROSS]).max() > 0.02 * np.abs(plain).max():
                continue
            row = row if oriented else plain
            if not any(min(np.abs(row - k).max(), np.abs(row + k).max()) < _DUPLICATE_DISTANCE for k in kept):
                kept.append(row)
        table = np.stack(kept)
        flat = rows.is_plane(table)
        second = table if nested else table[flat]
        outside = np.zeros(len(table) + len(second), dtype=bool)
        outside[len(table) :] = ~rows.is_plane(second)
        return cls(np.concatenate([table, -second]), outside)


def candidates(found: list[DetectedQuadric], surface: OrientedPoints) -> list[Row]:
    """Rows of the detected surfaces, of planes that part them, and of the bounding box's sides."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    box = [rows.plane(axis, float((surface.points @ axis).max())) for axis in axes]
    return [one.row for one in found] + box + parting_planes(found)


def parting_planes(found: list[DetectedQuadric]) -> list[Row]:
    """Planes through the axis of a cylinder that a plane touches or cuts, square to that plane.

    A rounded end or edge ends there without a surface of its own, and an arm that runs into a round eye ends
    somewhere within it; a union of convexes needs a face there. Those that touch come first.
    """
    planes = np.array([one.row for one in found if one.kind == "plane"]).reshape(-1, 10)
    touching: list[Row] = []
    cutting: list[Row] = []
    for one in sorted(found, key=lambda one: -len(one.inliers)):
        if one.kind != "cylinder" or len(planes) == 0:
            continue
        form, slope, _ = rows.split(one.row)
        bent, vectors = np.linalg.eigh(form)
        axis, radius = vectors[:, 0], 1 / (2 * bent[-1])
        centre = -np.linalg.pinv(2 * form, rcond=1e-6) @ slope
        normal, offset = planes[:, rows.LINEAR], planes[:, rows.CONSTANT]
        reach = np.abs(normal @ centre + offset) - radius
        for n, over in zip(normal, reach, strict=True):
            if np.abs(n @ axis) > _TANGENCY_TOLERANCE or over > _TANGENCY_TOLERANCE:
                continue
            across = np.cross(n, axis)
            across /= np.linalg.norm(across)
            row = rows.plane(across, float(across @ centre))
            made = touching if over > -_TANGENCY_TOLERANCE else cutting
            if not any(min(np.abs(row - k).max(), np.abs(row + k).max()) < _DUPLICATE_DISTANCE for k in made):
                made.append(row)
    return (touching + cutting)[:_MAX_PARTING_PLANES]
