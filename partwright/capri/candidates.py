"""The quadrics among which a tree is chosen: detected surfaces, planes that part or end them, the box around
all."""

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
_MAX_ENDING_PLANES = 40
_ALONG = 15, 60  # points of a round wall in each slice across its axis, on average; slices at most
_CLOSE, _MOSTLY = 0.0015, 0.5  # unit lengths from a wall, at which its end shows, and of its points that are
_SAME_END = 0.015  # unit lengths from a flat face that is an end already
_SQUARE = 0.999  # cosine between its normal and the axis


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
    made = [one.row for one in found] + box
    return made + parting_planes(found) + ending_planes(found, made, surface)


def ending_planes(found: list[DetectedQuadric], made: list[Row], surface: OrientedPoints) -> list[Row]:
    """Planes square to the axes of cylinders where their walls end though no flat face is there.

    A pipe goes over into its bend so, and a rod into a round: without a face its cylinder goes on through
    what lies beyond, and that is then cut away piece by piece. Those of the largest walls come first.
    """
    flat = np.stack(made)
    flat = flat[rows.is_plane(flat)]
    ends: list[Row] = []
    for one in sorted(found, key=lambda one: -len(one.inliers)):
        if one.kind != "cylinder":
            continue
        axis, _ = _axis(one.row)
        wall = surface.points[one.inliers]
        close = np.abs(rows.distances(one.row, wall)) < _CLOSE
        along = (wall[close] if close.mean() > _MOSTLY else wall) @ axis
        parallel = flat[np.abs(flat[:, rows.LINEAR] @ axis) > _SQUARE]
        known = -parallel[:, rows.CONSTANT] * np.sign(parallel[:, rows.LINEAR] @ axis)
        for height in _reach(along):
            if np.abs(known - height).min(initial=np.inf) > _SAME_END:
                ends.append(rows.plane(axis, float(height)))
    return ends[:_MAX_ENDING_PLANES]


def _reach(along: NDArray[np.float64]) -> tuple[float, float]:
    """From where to where points at these places (N,) of an axis are as dense as they mostly are, by half: a
    bend that begins as a wall goes on is within its tolerance for a while, at two lines of it."""
    count, edges = np.histogram(along, int(np.clip(len(along) // _ALONG[0], 1, _ALONG[1])))
    dense = np.flatnonzero(count >= np.median(count[count > 0]) / 2)
    return float(edges[dense[0]]), float(edges[dense[-1] + 1])


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
        axis, radius = _axis(one.row)
        form, slope, _ = rows.split(one.row)
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


def _axis(row: Row) -> tuple[NDArray[np.float64], float]:
    """Direction (3,) of a cylinder's axis, and its radius."""
    form, _, _ = rows.split(row)
    bent, vectors = np.linalg.eigh(form)
    return vectors[:, 0], float(1 / (2 * bent[-1]))
