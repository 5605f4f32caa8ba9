"""Pieces that float though the shape is one body: a part for each neck that was left out.

A neck as thin as a voxel holds next to nothing, so that nothing else feels whether it is there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse.csgraph import connected_components

from partwright.fields.columns import Column
from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.objective import score
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded

_TOUCHING = 0.6  # voxels: parts as near as that to one of the grid's points may meet beside it
_FINE = 9  # points along two voxels
_AT_ONCE = 100  # voxels that are looked at so
_MARGIN, _ELSEWHERE = 0.2, 0.3  # of a region that one part is fitted to
_ALL_AROUND = np.ones((3, 3, 3), bool)


@dataclass(frozen=True)
class Pieces:
    """What of an assembly hangs together. of_part: (M,) numbers of the pieces that its parts are of, those
    that are subtracted left out. field: (X, Y, Z) its distance on the grid. owner: (X, Y, Z) number of the
    piece that each voxel within it is of, -1 for the others."""

    count: int
    of_part: NDArray[np.int64]
    field: NDArray[np.float32]
    owner: NDArray[np.int64]

    @classmethod
    def of(cls, samples: FitSamples, rows: Rows) -> Pieces:
        """Parts are of one piece where a point of the grid is near both, or where each is nearest in one
        body, as where a blend joins them."""
        grid, field = samples.grid, samples.grid_field(rows)
        near = np.flatnonzero(field.ravel() < grid.spacing)
        apart = samples.parts_of(_added(rows), samples.grid_points[near])
        body = ndimage.label(field < 0)[0].ravel()[near]
        within, nearest = body > 0, apart.argmin(axis=0)
        fills = np.zeros((len(apart), int(body.max(initial=0)) + 1), bool)
        fills[nearest[within], body[within]] = True
        shared = np.concatenate([apart < _TOUCHING * grid.spacing, fills], axis=1).astype(np.float32)
        count, piece = connected_components(shared @ shared.T > 0, directed=False)
        owner = np.full(field.shape, -1, np.int64)
        owner.ravel()[near[within]] = piece[nearest[within]]
        return cls(count, piece, field, owner)

    def meet(self, samples: FitSamples, rows: Rows, new: Rows, about: NDArray[np.float32]) -> bool:
        """Whether new rows (K, 17) join all pieces, by overlaps near points (N, 3)."""
        steps = samples.grid.spacing * np.linspace(-1, 1, _FINE)
        around = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3).astype(np.float32)
        piece = np.append(self.of_part, self.count + np.arange(len(new)))
        meet = np.zeros((piece.max() + 1,) * 2, bool)
        for some in np.array_split(about, -(-len(about) // _AT_ONCE)):
            points = (some[:, None] + around).reshape(-1, 3)
            within = samples.parts_of(np.concatenate([_added(rows), new]), points) < 0
            filled = np.stack([within[piece == k].any(axis=0) for k in range(len(meet))]).astype(np.float32)
            meet |= filled @ filled.T > 0
        return bool(connected_components(meet, directed=False)[0] == 1)


def rejoined(samples: FitSamples, leaves: list[RepeatedPart], settings: Settings) -> list[RepeatedPart]:
    """Leaves, and a part for each neck between pieces that float, where the shape is one body.

    The same leaves where they are one piece, or so near that the grid does not see it; where that would cost
    more than the parts' price, or take more of them than a budget has room for.
    """
    rows = expanded(leaves)
    if ndimage.label(samples.grid.values < 0, _ALL_AROUND)[1] != 1:
        return leaves
    apart = Pieces.of(samples, rows)
    regions = [
        Region(voxels, rows, samples.grid.spacing, _MARGIN, _ELSEWHERE) for voxels in necks(samples, apart)
    ]
    room = len(regions) if settings.max_parts is None else settings.max_parts - len(leaves)
    if not regions or len(regions) > room:
        return leaves
    new = fit_regions(samples, regions, settings)
    about = samples.grid_points[np.any([region.voxels for region in regions], axis=0)]
    whole = np.concatenate([rows, new])
    worse = score(samples, whole) < score(samples, rows) - settings.price * len(new)
    if worse or not apart.meet(samples, rows, new, about):
        return leaves
    return [*leaves, *map(RepeatedPart, new)]


def necks(samples: FitSamples, apart: Pieces) -> list[NDArray[np.bool_]]:
    """Voxels (X * Y * Z,) of the shape that lie between pieces, and beside these, of each neck."""
    if apart.count < 2:
        return []
    solid = samples.grid.values < 0
    label, count = ndimage.label(solid & (apart.field > 0), _ALL_AROUND)
    beside = np.zeros((apart.count, count + 1), bool)
    for piece, at in enumerate(beside):
        at[label[ndimage.binary_dilation(apart.owner == piece, _ALL_AROUND)]] = True
    between = [number for number in np.flatnonzero(beside.sum(axis=0) > 1) if number]
    return [(ndimage.binary_dilation(label == one, _ALL_AROUND) & solid).ravel() for one in between]


def _added(rows: Rows) -> Rows:
    return rows[rows[:, Column.SIGN] > 0]
