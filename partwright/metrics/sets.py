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


def set_scores(made: Clouds, real: Clouds) -> SetScores:
    """Of clouds (N, 3) each.

    Raises:
        SettingError: either set has fewer than two.
    """
    if min(len(made), len(real)) < 2:
        raise SettingError(f"{len(made)} made and {len(real)} real shapes: two or more of either are needed")
    every = [*made, *real]
    distances = chamfer_matrix(every, every)
    between = distances[: len(made), len(made) :]
    np.fill_diagonal(distances, np.inf)
    is_made = np.arange(len(every)) < len(made)
    alike = is_made[distances.argmin(axis=1)] == is_made
    return SetScores(
        float(between.min(axis=0).mean()),
        len(np.unique(between.argmin(axis=1))) / len(real),
        float(alike.mean()),
    )


def chamfer_matrix(first: Clouds, second: Clouds) -> NDArray[np.float64]:
    """(A, B): the mean squared distance to the nearest point, from either cloud to the other, added up."""
    trees = [cKDTree(cloud) for cloud in second]

    def distance(a: NDArray[np.floating], own: cKDTree, b: NDArray[np.floating], other: cKDTree) -> float:
        return float((other.query(a)[0] ** 2).mean() + (own.query(b)[0] ** 2).mean())

    rows = [(a, cKDTree(a)) for a in first]
    return np.array([[distance(a, own, b, t) for b, t in zip(second, trees, strict=True)] for a, own in rows])
