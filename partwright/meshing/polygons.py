"""The polygons that marching cubes leaves in the cells, before they are cut into triangles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Polygons:
    """A closed polygon surface, one polygon a loop of a cell.

    vertices: (V, 3); index: (P, L) corners in order, padded with 0; length: (P,); cut: (P, L - 2, 3) places
    within the polygon that cut it into triangles; cell: (P, 3) lattice coordinates of the polygon's cell.
    """

    vertices: np.ndarray
    index: np.ndarray
    length: np.ndarray
    cut: np.ndarray
    cell: np.ndarray

    def __len__(self) -> int:
        return len(self.length)

    @property
    def used(self) -> np.ndarray:
        """(P, L) where `index` is not padding."""
        return np.arange(self.index.shape[1]) < self.length[:, None]

    def triangles(self, chosen: np.ndarray | None = None) -> np.ndarray:
        """(F, 3) triangles of the chosen polygons (all of them by default)."""
        index, cut, length = self.index, self.cut, self.length
        if chosen is not None:
            index, cut, length = index[chosen], cut[chosen], length[chosen]
        real = np.arange(cut.shape[1]) < (length - 2)[:, None]
        polygon = np.repeat(np.arange(len(length)), length - 2)
        return index[polygon[:, None], cut[real]]
