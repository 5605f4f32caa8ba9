"""How a set of made shapes compares with a set of real ones, by distances between clouds of points.

MMD, COV (Achlioptas et al. 2018) and 1-NNA (Yang et al. 2019), with the Chamfer distance between each two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from partwright.errors import SettingError

Clouds = Sequence[NDArray[np.floating]]


@dataclass(frozen=True)
class SetScores:
    """mmd: the mean distance from a real shape to the nearest made one. coverage: the share of real shapes
    that are the nearest to a made one. nearest_accuracy: the share of all shapes whose nearest other one is
    of their own set, 0.5 for sets that cannot be told apart."""

    mmd: float
    coverage: float
    nearest_accuracy: float


def set_scores(made: Clouds, real: Clouds, among_real: NDArray[np.float64] | None = None) -> SetScores:
    """Of clouds (N, 3) each.

    among_real: (B, B) `chamfer_matrix` of the real ones, where several sets are compared with them.

    Raises:
        SettingError: either set has fewer than two.
    """
    if min(len(made), len(real)) < 2:
        raise SettingError(f"{len(made)} made and {len(real)} real shapes: two or more of either are needed")
    among = chamfer_matrix(real) if among_real is None else among_real
    return scores_of_distances(chamfer_matrix(made), chamfer_matrix(made, real), among)


def scores_of_distances(
    among_made: NDArray[np.float64], between: NDArray[np.float64], among_real: NDArray[np.float64]
) -> SetScores:
    """Of distances among A made shapes (A, A), between these and B real ones (A, B), among those (B, B)."""
    distances = np.block([[among_made, between], [between.T, among_real]])
    np.fill_diagonal(distances, np.inf)
    is_made = np.arange(len(distances)) < len(among_made)
    alike = is_made[distances.argmin(axis=1)] == is_made
    return SetScores(
        float(between.min(axis=0).mean()),
        len(np.unique(between.argmin(axis=1))) / len(among_real),
        float(alike.mean()),
    )


def chamfer_matrix(first: Clouds, second: Clouds | None = None) -> NDArray[np.float64]:
    """(A, B): the mean squared distance to the nearest point, from either cloud to the other, added up; where
    there are no second ones (A, A), among the first."""
    rows = [(cloud, cKDTree(cloud)) for cloud in first]

    def distance(a: NDArray[np.floating], own: cKDTree, b: NDArray[np.floating], other: cKDTree) -> float:
        return float((other.query(a)[0] ** 2).mean() + (own.query(b)[0] ** 2).mean())

    if second is not None:
        columns = [(cloud, cKDTree(cloud)) for cloud in second]
        return np.array([[distance(*row, *column) for column in columns] for row in rows])
    result = np.zeros((len(rows), len(rows)))
    for i in range(len(rows)):
        for j in range(i):
            result[i, j] = result[j, i] = distance(*rows[i], *rows[j])
    return result
