"""Balls that stand for a solid: as much of it, and as little beside it, as so many can.

Volume is counted on a lattice: a cell inside is gained by the balls that cover it, one outside is lost. Balls
begin greedily, each where it gains most of what those before it have left. Then each in turn is moved, with
the best radius at every place, as long as that gains, and those that gain least are tried where most is left.
Fewer balls than a hollow shape needs would gain most in the hollow. Where they are to be in the material they
reach no farther out of it than its surface is from their centres: in a plate, half its thickness.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from partwright.meshing.manifolds import surface_of
from partwright.shapes import MeshDistance

if TYPE_CHECKING:
    from manifold3d import Manifold

Balls = np.ndarray  # (N, 4): centre and radius
_INSIDE, _EACH, _MOST = 16_000, 40, 1_500_000  # cells inside, inside for each ball, and in all
_CANDIDATES, _CANDIDATES_EACH = 500, 6  # places at which balls may begin
_ROUNDS, _SWEEPS = 14, 3  # moves of each ball; and how often balls are tried elsewhere
_MOVED, _TRIED = 0.25, 24  # share of the balls that are tried elsewhere, and at how many places
_BINS = 8  # radii to a cell
_FINEST = 0.25  # cells: a ball that gains by no such step stays
_ROUNDING = 1e-6  # of the size: by how much a ball within is smaller than it might be
_MOVES = np.concatenate([np.eye(3), -np.eye(3)])
_OUT = 2.0  # times the depth of a centre: the radius of a ball in the material
_Depth = Callable[[np.ndarray], np.ndarray]
Place = Literal["within", "in", "anywhere"]


def filling_balls(
    solid: Manifold, count: int, place: Place = "in", firmness: float = 1.0, seed: int = 0
) -> Balls:
    """(N, 4) centres and radii of at most `count` balls, with little volume in the solid or the balls alone.

    place: whether they lie within the solid, in its material, or anywhere. firmness: how many times what they
    add what they lack counts.
    """
    lattice, depth = _lattice(solid, max(_INSIDE, _EACH * count))
    search = _Search(lattice, depth, place, firmness, np.random.default_rng(seed))
    search.begin(count)
    for sweep in range(_SWEEPS):
        search.refine()
        if sweep == _SWEEPS - 1 or not search.relocate():
            break
    return search.result()


@dataclass(frozen=True, eq=False)
class _Lattice:
    """signed: (X, Y, Z) distances to the surface at origin + cell * (i, j, k), negative inside."""

    origin: np.ndarray
    cell: float
    signed: np.ndarray


@dataclass
class _Ball:
    centre: np.ndarray
    radius: float
    gain: float
    step: float


def _lattice(solid: Manifold, inside: int) -> tuple[_Lattice, _Depth]:
    """So many cells inside, and how deep inside points (N, 3) are."""
    vertices, faces = surface_of(solid)
    lower, upper = vertices.min(axis=0), vertices.max(axis=0)
    size = float((upper - lower).max())
    cell = math.cbrt(max(solid.volume() / inside, float(np.prod(upper - lower)) / _MOST))
    surface = MeshDistance((vertices - lower) / size, faces, faces, True)

    def signed(points: np.ndarray) -> np.ndarray:
        return size * surface.signed((points - lower) / size).astype(np.float64)

    counts = np.ceil((upper - lower) / cell).astype(int) + 4
    origin = (lower + upper - cell * (counts - 1)) / 2
    axes = [origin[k] + cell * np.arange(counts[k]) for k in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    whole = _Lattice(origin, cell, signed(points).reshape(counts))
    return whole, lambda places: -signed(places) - _ROUNDING * size


class _Search:
    """Balls on a lattice, at places of such a depth."""

    def __init__(
        self, lattice: _Lattice, depth: _Depth, place: Place, firmness: float, rng: np.random.Generator
    ) -> None:
        self._origin, self._cell, self._rng = lattice.origin, lattice.cell, rng
        self._depth, self._place = depth, place
        signed = lattice.signed
        worth = np.clip(-2 * signed / lattice.cell, -1, 1)  # of a cell, 1 inside and -1 outside
        self._worth = np.where(worth > 0, firmness * worth, worth)
        self._covered = np.zeros(signed.shape, np.int16)  # by how many balls
        self._axes = [self._origin[k] + self._cell * np.arange(n) for k, n in enumerate(signed.shape)]
        self._places = np.argwhere(signed < 0)
        self._deep = -signed[signed < 0]
        self._balls: list[_Ball] = []

    def begin(self, count: int) -> None:
        """The balls, each where it gains most; fewer where no more gain anything."""
        most = max(_CANDIDATES, _CANDIDATES_EACH * count)
        chosen = self._rng.permutation(len(self._places))[:most]
        chosen = np.unique(np.append(chosen, self._deep.argmax()))
        centres = self._at(self._places[chosen])
        reach = self._reach(centres, 2 * self._deep[chosen] + 2 * self._cell)
        waiting = [(-self._best(c, r)[1], i) for i, (c, r) in enumerate(zip(centres, reach, strict=True))]
        heapq.heapify(waiting)
        while waiting and len(self._balls) < count:
            _, i = heapq.heappop(waiting)
            radius, gain = self._best(centres[i], reach[i])
            if waiting and gain < -waiting[0][0]:
                heapq.heappush(waiting, (-gain, i))
            elif gain > 0:
                self._balls.append(_Ball(centres[i], radius, gain, radius / 2))
                self._count(self._balls[-1], 1)
            else:
                break

    def refine(self) -> None:
        """Each ball moved by steps that become shorter, the others being where they are."""
        for _ in range(_ROUNDS):
            for ball in self._balls:
                if ball.step >= _FINEST * self._cell:
                    self._move(ball)

    def relocate(self) -> bool:
        """The balls that gain least, where most is left; whether any is better off there."""
        for ball in self._balls:
            ball.gain = self._own(ball)
        moved = False
        few = math.ceil(_MOVED * len(self._balls))
        for ball in sorted(self._balls, key=lambda ball: ball.gain)[:few]:
            left = np.flatnonzero(self._covered[tuple(self._places.T)] == 0)
            if not len(left):
                break
            self._count(ball, -1)
            tried = self._rng.choice(left, min(_TRIED, len(left)), replace=False)
            centres = self._at(self._places[tried])
            reach = self._reach(centres, 2 * self._deep[tried] + 2 * self._cell)
            found = [self._best(c, r) for c, r in zip(centres, reach, strict=True)]
            best = max(range(len(found)), key=lambda i: found[i][1])
            if found[best][1] > max(ball.gain, 0.0):
                ball.centre, (ball.radius, ball.gain), moved = centres[best], found[best], True
            self._count(ball, 1)
        for ball in self._balls:
            ball.step = ball.radius / 2 if moved else 0.0
        return moved

    def result(self) -> Balls:
        least = self._cell / 2  # the lattice does not tell what is smaller
        kept = [ball for ball in self._balls if ball.radius > least and self._own(ball) > 0]
        return np.array([[*ball.centre, ball.radius] for ball in kept]).reshape(-1, 4)

    def _move(self, ball: _Ball) -> None:
        self._count(ball, -1)
        places = ball.centre + ball.step * _MOVES
        own, *reach = self._reach(np.vstack([ball.centre, places]), 1.3 * ball.radius + 2 * self._cell)
        ball.radius, ball.gain = self._best(ball.centre, own)
        found = [self._best(place, most) for place, most in zip(places, reach, strict=True)]
        best = max(range(len(found)), key=lambda i: found[i][1])
        if found[best][1] > ball.gain:
            ball.centre, (ball.radius, ball.gain) = places[best], found[best]
        else:
            ball.step /= 2
        self._count(ball, 1)

    def _reach(self, centres: np.ndarray, most: np.ndarray | float) -> list[float]:
        """How large balls about centres (N, 3) may be: at most so large (N,), and as their place allows."""
        reach = np.broadcast_to(most, len(centres))
        if self._place == "within":
            reach = self._depth(centres)
        elif self._place == "in":
            reach = np.minimum(reach, _OUT * self._depth(centres))
        return [float(one) for one in reach]

    def _best(self, centre: np.ndarray, reach: float) -> tuple[float, float]:
        """The radius up to `reach` that gains most at a place of what no ball covers yet, and how many cells
        that is."""
        if reach <= 0:
            return 0.0, 0.0
        box, far = self._around(centre, reach)
        bins = int(np.ceil(reach / self._cell * _BINS))
        which = (far * (_BINS / self._cell)).astype(np.intp).ravel()
        near = which < bins
        free = np.where(self._covered[box] == 0, self._worth[box], 0.0).ravel()
        gains = np.bincount(which[near], free[near], bins).cumsum()
        if self._place == "within":
            return reach, float(gains[-1])
        radii = np.minimum(self._cell / _BINS * np.arange(1, bins + 1), reach)
        counted = np.bincount(which[near], minlength=bins).cumsum()
        gains = gains - self._beyond(centre, radii, counted)
        best = int(gains.argmax())
        return (float(radii[best]), float(gains[best])) if gains[best] > 0 else (0.0, 0.0)

    def _beyond(self, centre: np.ndarray, radii: np.ndarray, counted: np.ndarray) -> np.ndarray:
        """Cells of balls of these radii that are not on the lattice, where so many are."""
        room = min(min(c - axis[0], axis[-1] - c) for c, axis in zip(centre, self._axes, strict=True))
        lost = 4 / 3 * np.pi * (radii / self._cell) ** 3 - counted
        return np.where(radii > room, np.maximum(lost, 0.0), 0.0)

    def _own(self, ball: _Ball) -> float:
        """What the ball alone covers."""
        box, far = self._around(ball.centre, ball.radius)
        near = far < ball.radius
        counted = np.array([near.sum()])
        lost = self._beyond(ball.centre, np.array([ball.radius]), counted)[0]
        return float(self._worth[box][near & (self._covered[box] == 1)].sum() - lost)

    def _count(self, ball: _Ball, by: int) -> None:
        box, far = self._around(ball.centre, ball.radius)
        self._covered[box] += (by * (far < ball.radius)).astype(np.int16)

    def _around(self, centre: np.ndarray, reach: float) -> tuple[tuple[slice, ...], np.ndarray]:
        """The box of the lattice around a ball, and how far (X, Y, Z) its cells are from the centre."""
        first = np.maximum(np.ceil((centre - reach - self._origin) / self._cell).astype(int), 0)
        last = np.floor((centre + reach - self._origin) / self._cell).astype(int) + 1
        box = tuple(slice(a, max(a, b)) for a, b in zip(first.tolist(), last.tolist(), strict=True))
        x, y, z = ((axis[s] - c) ** 2 for axis, s, c in zip(self._axes, box, centre, strict=True))
        return box, np.sqrt(x[:, None, None] + y[None, :, None] + z[None, None, :])

    def _at(self, indices: np.ndarray) -> np.ndarray:
        return np.asarray(self._origin + self._cell * indices)
