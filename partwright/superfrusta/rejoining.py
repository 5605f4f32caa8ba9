"""Pieces that float though the shape is one body: a part for each neck that was left out.

A neck as thin as a voxel holds next to nothing, so that nothing else feels whether it is there.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.spatial import cKDTree

from partwright.approximation.sketches.directions import frame_along
from partwright.assembly.similarity import quaternions
from partwright.fields.columns import ROTATION, SIZE, TRANSLATION, WIDTH, Column
from partwright.shapes import Shape
from partwright.shapes.topology import components, signed_volumes
from partwright.superfrusta.families import locked_values, with_locked_values
from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.limits import LEAST_BLEND, SHORTEST
from partwright.superfrusta.objective import score
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded

Floats = NDArray[np.float64]
Neck = TypeVar("Neck")
Mask = NDArray[np.bool_]
Surface = Callable[[list[RepeatedPart]], tuple[Floats, NDArray[np.int64]]]
"""Vertices (V, 3), in the unit frame, and faces (F, 3) of the surface that leaves make, copies included."""

_CRUMB = 1e-3  # of the volume: what is smaller is a chip, not a piece that should be joined
_BESIDE = 0.02  # unit lengths: what is as near to where a gap is narrowest belongs to it
_BETWEEN = np.array([0.25, 0.5, 0.75])[:, None, None]  # of the way from voxel to voxel
_MARGIN, _ELSEWHERE = 0.2, 0.3  # of a region that one part is fitted to
_ALL_AROUND = np.ones((3, 3, 3), bool)


@dataclass(frozen=True)
class Pieces:
    """What of an assembly hangs together. points: (N, 3) of all its surface, unit frame. piece: (N,) numbers
    of the pieces that they are of, the largest first, -1 for chips."""

    points: Floats
    piece: NDArray[np.int64]

    @property
    def count(self) -> int:
        return int(self.piece.max(initial=-1)) + 1

    @classmethod
    def of(cls, vertices: Floats, faces: NDArray[np.int64]) -> Pieces:
        component = components(len(vertices), faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel())
        volume = signed_volumes(vertices, faces, component[faces[:, 0]])
        order = np.argsort(-volume, kind="stable")
        order = order[volume[order] > _CRUMB * volume.sum()]
        number = np.full(len(volume), -1)
        number[order] = np.arange(len(order))
        return cls(vertices, number[component])


def rejoined(
    shape: Shape,
    samples: FitSamples,
    leaves: list[RepeatedPart],
    settings: Settings,
    surface: Surface,
    known: int = 0,
) -> list[RepeatedPart]:
    """Leaves, and before the last `known` of them a part for each neck between pieces that float, where the
    shape is one body.

    The same leaves where they are one piece, where no neck joins any, would cost more than the parts' price,
    or would take more of them than a budget has room for.
    """
    rows = expanded(leaves)
    field = samples.grid_field(rows)
    if not _is_body(shape, samples) or is_one(samples, rows, field):
        return leaves
    apart = Pieces.of(*surface(leaves))
    if apart.count < 2:
        return leaves
    last = len(leaves) - known
    ways = partial(_fitted, samples, apart, rows, field, settings), partial(_rods, samples, apart, settings)
    for way in ways:
        new = way()
        room = len(new) if settings.max_parts is None else settings.max_parts - len(leaves)
        if not 0 < len(new) <= room:
            continue
        whole = [*leaves[:last], *map(RepeatedPart, new), *leaves[last:]]
        worse = score(samples, expanded(whole)) < score(samples, rows) - settings.price * len(new)
        if not worse and Pieces.of(*surface(whole)).count < apart.count:
            return whole
    return leaves


def _is_body(shape: Shape, samples: FitSamples) -> bool:
    """Whether a shape is one: by its voxels, where its surfaces go through one another, or by its surface,
    where its walls are thinner than those."""
    _, bodies = ndimage.label(samples.grid.values < 0, _ALL_AROUND)
    return bool(bodies == 1) or Pieces.of(shape.vertices, shape.faces).count == 1


def is_one(samples: FitSamples, rows: Rows, field: NDArray[np.float32]) -> bool:
    """Whether an assembly is one piece for sure: its voxels hang together by ways that lie within it.

    field: (X, Y, Z) of it on the grid.
    """
    place = np.arange(field.size).reshape(field.shape)
    links = []
    for axis in range(3):
        depth, number = np.moveaxis(field, axis, 0), np.moveaxis(place, axis, 0)
        within = (depth[:-1] < 0) & (depth[1:] < 0)
        links.append(np.stack([number[:-1][within], number[1:][within]]))
    link, flat = np.concatenate(links, axis=1), field.ravel()
    # Nothing that is nearer to a point within than the surface is outside.
    sure = -flat[link].sum(axis=0) > samples.grid.spacing
    piece = components(field.size, *link[:, sure])
    asked = link[:, ~sure & (piece[link[0]] != piece[link[1]])]
    ends = samples.grid_points[asked]
    between = (ends[0] + _BETWEEN * (ends[1] - ends[0])).reshape(-1, 3).astype(np.float32)
    open_ = (samples.distance_of(rows, between).reshape(len(_BETWEEN), -1) < 0).all(axis=0)
    known = np.concatenate([link[:, sure], asked[:, open_]], axis=1)
    size = np.bincount(components(field.size, *known)[flat < 0])
    return bool(np.count_nonzero(size > _CRUMB * size.sum()) < 2)


def needed(count: int, necks: Iterable[tuple[Neck, list[int]]]) -> list[Neck]:
    """The necks that join what those before them do not, of so many pieces."""
    joined = np.eye(count, dtype=bool)
    found = []
    for neck, pieces in necks:
        if not joined[np.ix_(pieces, pieces)].all():
            joined |= np.outer(joined[pieces].any(axis=0), joined[pieces].any(axis=0))
            found.append(neck)
    return found


def _fitted(
    samples: FitSamples, apart: Pieces, rows: Rows, field: NDArray[np.float32], settings: Settings
) -> Rows:
    """Parts (K, 17) for regions within the shape that no part fills and that lie beside several pieces."""
    found = needed(apart.count, _left_open(samples, apart, field))
    depth = samples.grid.spacing
    regions = [Region(voxels, rows, depth, _MARGIN, _ELSEWHERE) for voxels in found]
    return fit_regions(samples, regions, settings) if regions else rows[:0]


def _left_open(
    samples: FitSamples, apart: Pieces, field: NDArray[np.float32]
) -> Iterator[tuple[Mask, list[int]]]:
    """Voxels (X * Y * Z,) of such a region and of the shape around it, and the pieces that it lies beside."""
    solid, shown = samples.grid.values < 0, apart.piece >= 0
    beside = (np.abs(field) < 2 * samples.grid.spacing).ravel()
    owner = np.full(field.size, -1)
    nearest = cKDTree(apart.points[shown]).query(samples.grid_points[beside])[1]
    owner[beside] = apart.piece[shown][nearest]
    owner = np.where(field < 0, owner.reshape(field.shape), -1)
    label, _ = ndimage.label(solid & (field > 0), _ALL_AROUND)
    touched = [
        set(label[ndimage.binary_dilation(owner == k, _ALL_AROUND)].tolist()) for k in range(apart.count)
    ]
    for one in sorted(set().union(*touched) - {0}):
        pieces = [k for k, numbers in enumerate(touched) if one in numbers]
        if len(pieces) > 1:
            yield (ndimage.binary_dilation(label == one, _ALL_AROUND) & solid).ravel(), pieces


def _rods(samples: FitSamples, apart: Pieces, settings: Settings) -> Rows:
    """Cylinders (K, 17) across gaps that are too narrow for a fit to feel, as thick as the shape is there."""
    found = np.array(needed(apart.count, _gaps(samples, apart)), np.float32).reshape(-1, WIDTH)
    return with_locked_values(found, locked_values(settings.family, settings.smooth))


def _gaps(samples: FitSamples, apart: Pieces) -> Iterator[tuple[NDArray[np.float32], list[int]]]:
    """Where each piece but the largest is nearest to another across the shape's inside: a cylinder (17,)."""
    for k in range(1, apart.count):
        own, others = apart.piece == k, (apart.piece >= 0) & (apart.piece != k)
        away, nearest = cKDTree(apart.points[others]).query(apart.points[own])
        one, other = apart.points[own], apart.points[others][nearest]
        depth = -samples.near_distance(((one + other) / 2).astype(np.float32))
        near = np.flatnonzero((depth > 0) & (away < away[depth > 0].min(initial=np.inf) + _BESIDE))
        if len(near):
            best = near[depth[near].argmax()]
            joins = int(apart.piece[others][nearest[best]])
            yield _cylinder(one[best], other[best], float(depth[best])), [joins, k]


def _cylinder(one: Floats, other: Floats, radius: float) -> NDArray[np.float32]:
    """(17,) about the way between two points (3,), and its radius beyond."""
    along = other - one
    length = float(np.linalg.norm(along))
    row = np.zeros(WIDTH, np.float32)
    row[TRANSLATION] = (one + other) / 2
    row[ROTATION] = quaternions(frame_along(along / length) if length > 0 else np.eye(3))
    row[SIZE] = np.maximum([2 * radius, 2 * radius, length + 2 * radius], SHORTEST)
    row[[Column.ROUNDNESS, Column.TAPER, Column.SIGN]] = 1
    row[Column.BLEND] = LEAST_BLEND
    return row
