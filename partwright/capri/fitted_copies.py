"""One convex for all of its places (ours): what each needs, seen from the first, and the convex improved."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.motion import Motion
from partwright.capri import quadric_rows as rows
from partwright.capri import selection
from partwright.capri.csg_tree import Convex, CsgTree
from partwright.capri.samples import OccupancySamples

# Times the distance of a convex's furthest sample from its middle: samples that it is fitted to.
_REACH = 1.4

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class FittedCopies:
    """Fits convexes of a tree's quadrics to the samples of all their places.

    price, convex_price: in weight of samples. pause: called before each local search, and may raise.
    """

    tree: CsgTree
    samples: OccupancySamples
    price: float
    convex_price: float
    pause: Callable[[], None]

    def improved(
        self,
        convex: Convex,
        places: Sequence[Motion],
        covered: Mask,
        middle: NDArray[np.float64],
        reduction: NDArray[np.float32],
    ) -> Convex:
        """The convex improved for all places at once.

        covered (N,), middle (3,): what it covers at the first place, which is where it is. reduction (N,): by
        how much the error falls where any of them covers a sample.
        """
        points = self.samples.points
        reach = _REACH * float(np.linalg.norm(points[covered] - middle, axis=1).max(initial=0.0))
        outside, value = self._pulled_back(places, middle, reach, reduction)
        # A quadric that cuts nothing is never worth its price.
        used = np.asarray(outside.any(axis=0))
        used[list(convex)] = True
        columns = np.flatnonzero(used)
        left_out = outside.take(columns, axis=1).astype(np.float32)
        complement = self.tree.complement[columns]
        problem = selection.Problem(
            left_out,
            value > 0,
            np.abs(value),
            np.where(complement, self.price + self.convex_price, self.price),
            self.convex_price,
            np.random.default_rng(0),
            self.pause,
        )
        start = tuple(int(i) for i in np.searchsorted(columns, convex))
        found, _ = selection.improve(problem, left_out, value, start)
        return tuple(int(columns[i]) for i in found)

    def _pulled_back(
        self,
        places: Sequence[Motion],
        middle: NDArray[np.float64],
        reach: float,
        reduction: NDArray[np.float32],
    ) -> tuple[Mask, NDArray[np.float32]]:
        """Samples around each place as the convex sees them: outside (M, K), and what covering them is worth.

        What is to be covered counts at the nearest place only; what is not to be counts at each.
        """
        points = self.samples.points
        away = np.stack([np.linalg.norm(points - motion(middle), axis=1) for motion in places])
        nearest = away.argmin(axis=0)
        outside, value = [], []
        for i, motion in enumerate(places):
            near = np.flatnonzero((reduction != 0) & (away[i] < reach) & ((reduction < 0) | (nearest == i)))
            local = motion.inverse()(points[near])
            outside.append(rows.values(self.tree.rows, local) > 0)
            value.append(reduction[near])
        return np.concatenate(outside), np.concatenate(value)


def error_reduction(
    samples: OccupancySamples, covered: Sequence[Sequence[Mask]], at: int
) -> NDArray[np.float32]:
    """(N,) by how much the error falls where one more convex in layer `at` covers a sample.

    covered: (N,) masks of what the convexes of each layer cover.
    """
    before = np.zeros(len(samples.weight), dtype=bool)
    free = ~before
    for k, layer in enumerate(covered):
        for mask in layer:
            if k <= at:
                before[mask] = k % 2 == 0
            else:
                free &= ~mask
    painted = at % 2 == 0
    right = samples.inside == painted
    worth = np.where(right, samples.weight, -samples.weight)
    return np.where(free & (before != painted), worth, 0).astype(np.float32)
