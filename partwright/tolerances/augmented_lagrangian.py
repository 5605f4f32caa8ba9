"""Least squares under bounds: the surface follows the shape, and whatever breaks a bound weighs ever more.

A bound on the assembly is one on its distance F at points: lower <= F <= upper. Points of the shape's surface
may lie `out` outside the assembly and, for a tolerance, as far inside it; points of the assembly's surface,
taken anew in every round, may lie `beyond` outside the shape. Violations enter squared with a weight that
rises from round to round, and with multipliers that remember where they persist: the few worst points are
not left over for the sake of the many (the augmented Lagrangian; Nocedal and Wright, Numerical Optimization,
section 17.3).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.errors import NoSurfaceError
from partwright.least_squares import Damping, minimise
from partwright.meshing import mesh_assembly
from partwright.shapes import Samples, Shape
from partwright.tolerances.check import assembly_points, shape_points
from partwright.tolerances.distance_bounds import DistanceBounds
from partwright.tolerances.leaves import free_numbers, moved, slope, weigh

_NEAR, _UNIFORM = 4_000, 2_000
_SURFACE, _DENSE = 6_000, 40_000
_CELLS = 64
_ROUNDS = 10
_DAMPING = Damping(trials=15, start=1e-2, down=0.3, up=5.0, least=1e-6, floor=1e-6, steps=3, refusals=5)
_SHARPNESS = 60.0  # of the occupancy sigmoid, per unit length
_FIRST, _RISE = 10.0, 3.0  # weight of the violations beside the reconstruction, and its rise
_KEPT = 500  # fresh violated points that a round adds
_MARGIN = 1e-3  # unit lengths that violations are pushed beyond their bound

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Constraints:
    """lower <= F <= upper at points."""

    points: NDArray[np.float32]
    """(N, 3) in the unit frame."""
    lower: Floats
    """(N,) unit lengths; minus infinity where F may be as low as it likes."""
    upper: Floats
    """(N,) unit lengths; infinity where it may be as high."""

    def violation(self, field: Floats, multipliers: Floats | float = 0.0) -> Floats:
        """(N,) how far F is outside its bounds: positive above, negative below, 0 within.

        multipliers (N,) are of the same sign and make a bound that much narrower.
        """
        above = np.maximum(field - self.upper + np.maximum(multipliers, 0.0), 0.0)
        below = np.maximum(self.lower - field - np.minimum(multipliers, 0.0), 0.0)
        return above - below

    def worst(self, assembly: Assembly, most: int) -> Constraints:
        """Those that are violated, at most so many, the worst first."""
        violation = np.abs(self.violation(weigh(assembly, self.points)[0]))
        order = np.argsort(-violation, kind="stable")[:most]
        order = order[violation[order] > 0]
        return Constraints(self.points[order], self.lower[order], self.upper[order])

    def __add__(self, other: Constraints) -> Constraints:
        return Constraints(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.lower, other.lower]),
            np.concatenate([self.upper, other.upper]),
        )


def on_shape(shape: Shape, bounds: DistanceBounds, count: int, seed: int) -> Constraints:
    """What points of the shape's surface ask of F."""
    points = shape_points(shape, count, seed)
    full = np.ones(len(points))
    return Constraints(points, -bounds.within * full, bounds.out * full)


def on_assembly(
    assembly: Assembly, shape: Shape, bounds: DistanceBounds, count: int, seed: int, cells: int
) -> Constraints:
    """What points of a unit-frame assembly's surface ask of F: where they lie too far outside the shape the
    surface has to fall back by that much, where too far inside it has to rise."""
    points = assembly_points(assembly, mesh_assembly(assembly, cells), count, seed)
    depth = shape.unit_distance(points).astype(np.float64)
    return Constraints(points, depth - bounds.beyond, depth + bounds.within)


def augmented_lagrangian(
    assembly: Assembly,
    shape: Shape,
    bounds: DistanceBounds,
    locked: frozenset[str] = frozenset(),
    seed: int = 0,
) -> Iterator[Assembly]:
    """Assemblies (unit frame) that break the bounds less and less, one a round; leaves in `locked` stay."""
    samples = shape.samples(_NEAR, _UNIFORM, seed + 11)
    free = [free_numbers(part) & (part.name not in locked) for part in assembly.parts]
    if not any(may.any() for may in free):
        return
    # a little more than is asked for, so that what lies between the samples holds too
    aim = bounds.narrowed(_MARGIN)
    wanted = on_shape(shape, aim, _SURFACE, seed + 12)
    multipliers = np.zeros(len(wanted.points))
    weight, damping = _FIRST, _DAMPING.start
    for round_ in range(_ROUNDS):
        try:
            cuts = _cuts(assembly, shape, aim, seed + 13 + round_)
        except NoSurfaceError:
            return
        wanted, multipliers = wanted + cuts, np.append(multipliers, np.zeros(len(cuts.points)))
        problem = _Problem(samples, wanted, multipliers, weight * _SHARPNESS**2 / 16 / _SURFACE)
        assembly, damping = _descend(assembly, problem, free, damping)
        yield assembly
        multipliers = problem.shortfall(weigh(assembly, wanted.points)[0]) / _RISE
        weight *= _RISE


def _cuts(assembly: Assembly, shape: Shape, aim: DistanceBounds, seed: int) -> Constraints:
    """The worst violations at fresh, dense samples: few samples would miss what is amiss in a small place."""
    cuts = on_shape(shape, aim, _DENSE, seed).worst(assembly, _KEPT)
    if math.isfinite(aim.beyond):
        cuts = cuts + on_assembly(assembly, shape, aim, _SURFACE, seed, _CELLS).worst(assembly, 2 * _KEPT)
    return cuts


@dataclass(frozen=True)
class _Problem:
    """The loss of one round."""

    samples: Samples
    """Where the occupancies are to follow the shape's."""
    constraints: Constraints
    """(N,) of them, those of all rounds so far."""
    multipliers: Floats
    """(N,) over `weight`, in unit lengths, signed as violations."""
    weight: float
    """Of a squared violation beside a squared residual."""

    def shortfall(self, field: Floats) -> Floats:
        """(N,) violations with what lasts of earlier ones."""
        return self.constraints.violation(field, self.multipliers)

    def loss(self, assembly: Assembly) -> float:
        residual, _ = self._reconstruction(weigh(assembly, self.samples.points)[0])
        short = self.shortfall(weigh(assembly, self.constraints.points)[0])
        return float(residual @ residual + self.weight * (short @ short))

    def _reconstruction(self, field: Floats) -> tuple[Floats, Floats]:
        """Weighted residuals of the occupancies, and their derivative by F."""
        root = np.sqrt(self.samples.weight / self.samples.weight.sum())
        own = _occupancy(field)
        residual = root * (own - _occupancy(self.samples.distance))
        return residual, -root * _SHARPNESS * own * (1 - own)

    def normal_equations(
        self, assembly: Assembly, free: list[NDArray[np.bool_]]
    ) -> tuple[float, Floats, Floats]:
        """Loss, J^T r and J^T J over the free numbers."""
        found = slope(assembly, self.samples.points, free)
        residual, by_field = self._reconstruction(found.value)
        jacobian = by_field[:, None] * found.by_number
        gradient, matrix = jacobian.T @ residual, jacobian.T @ jacobian
        short = self.shortfall(weigh(assembly, self.constraints.points)[0])
        active = np.flatnonzero(short)
        if len(active):
            pushed = slope(assembly, self.constraints.points[active], free).by_number
            gradient = gradient + self.weight * pushed.T @ short[active]
            matrix = matrix + self.weight * pushed.T @ pushed
        return float(residual @ residual + self.weight * (short @ short)), gradient, matrix


def _descend(
    assembly: Assembly, problem: _Problem, free: list[NDArray[np.bool_]], damping: float
) -> tuple[Assembly, float]:
    """A few damped steps, and the damping for those of the next round."""
    found = minimise(
        assembly,
        lambda at: problem.normal_equations(at, free),
        problem.loss,
        lambda at, step: _stepped(at, step, free),
        replace(_DAMPING, start=damping),
    )
    return found.state, min(found.damping, 1.0)


def _stepped(assembly: Assembly, step: Floats, free: list[NDArray[np.bool_]]) -> Assembly:
    at = 0
    for part, may in zip(assembly.parts, free, strict=True):
        if not may.any():
            continue
        own = np.zeros(len(may))
        own[may] = step[at : at + np.count_nonzero(may)]
        at += int(np.count_nonzero(may))
        assembly = assembly.replace_part(part.name, moved(part, own))
    return assembly


def _occupancy(distance: NDArray[Any]) -> Floats:
    return 1 / (1 + np.exp(np.clip(_SHARPNESS * distance, -50, 50)))
