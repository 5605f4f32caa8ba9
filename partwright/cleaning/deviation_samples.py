"""What changes are tested on: points of surfaces, each owned by a part, and how far off the solid is there.

With a shape, the points lie on the shape's surface and on the given assembly's, and the target is the shape's
signed distance. Without one, they lie on the assembly's own surface, and the target is its own distance.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly, Similarity
from partwright.assembly.distance import unit_similarity
from partwright.cleaning.model import Model
from partwright.fields import kernel
from partwright.shapes import Shape

Floats = NDArray[np.float64]

BAND = 0.05  # unit lengths: who is off by more counts as off by this
_TRIED, _KEPT = 1200, 240  # points a copy, of which those that no other part hides are kept
_ON_SHAPE = 8000
_ON_SURFACE, _EXPOSED = 1e-4, 2e-3  # unit lengths
_NEWTON, _NUDGE = 5, 1e-3


@dataclass(frozen=True)
class DeviationSamples:
    """Points of both surfaces, the same from the given assembly to the cleaned one."""

    points: NDArray[np.float32]
    """(N, 3) in the unit frame."""
    target: NDArray[np.float32]
    """(N,) signed distances that the assembly should have there, unit lengths."""
    owner: NDArray[np.int64]
    """(N,) the leaf whose surface each is a point of, or lies nearest to."""
    centre: Floats
    """(3,) of the unit frame, own units."""
    scale: float
    """Unit lengths in one of own units: u = (p - centre) * scale."""

    @classmethod
    def of(cls, model: Model, shape: Shape | None) -> DeviationSamples:
        if shape is None:
            frame = unit_similarity(model.assembly)
            scale, centre = frame.scale, -np.array(frame.translation) / frame.scale
        else:
            scale, centre = shape.frame.scale, np.array(shape.frame.centre)
        rows = _rows(model, model.vector, range(len(model.leaf_of)), centre, scale)
        blends = model.blends * scale
        points, owner = _exposed(model, rows, blends, centre, scale)
        if shape is None:
            target = model.fold(kernel.evaluate_parts(rows, points), blends)
            return cls(points, target, owner, centre, scale)
        on_shape = shape.unit_surface(_ON_SHAPE, 0).points
        nearest = np.abs(kernel.evaluate_parts(rows, on_shape)).argmin(axis=0)
        points = np.concatenate([points, on_shape])
        owner = np.concatenate([owner, model.leaf_of[nearest]])
        return cls(points, shape.unit_distance(points), owner, centre, scale)

    def distances(self, model: Model, vector: Floats, copies: Iterable[int]) -> NDArray[np.float32]:
        """(C, N) of some copies alone. Raises ParameterError where a field does not allow its numbers."""
        rows = _rows(model, vector, copies, self.centre, self.scale)
        return kernel.evaluate_parts(rows, self.points)

    @property
    def frame(self) -> Similarity:
        """From own units to the unit frame."""
        x, y, z = (-self.scale * self.centre).tolist()
        return Similarity(self.scale, translation=(x, y, z))

    def mean_deviation(self, local: Assembly) -> float:
        """Mean difference between a unit-frame assembly's distance and the target, own units."""
        return float(np.abs(local.distance(self.points) - self.target).mean()) / self.scale

    @cached_property
    def clipped(self) -> NDArray[np.float32]:
        return np.clip(self.target, -BAND, BAND)


@dataclass(frozen=True)
class State:
    """A model with its distances at the samples: what a step of cleaning starts from, and what it makes."""

    samples: DeviationSamples
    model: Model
    vector: Floats
    """(n,) the numbers that are tried, own units; `model.vector` until something moves."""
    distances: NDArray[np.float32]
    """(C, N) of each copy alone, unit lengths."""
    field: NDArray[np.float32]
    """(N,) of the whole, unit lengths."""

    @classmethod
    def of(cls, samples: DeviationSamples, model: Model, vector: Floats | None = None) -> State:
        """Raises ParameterError where a field does not allow its numbers."""
        vector = model.vector if vector is None else vector
        distances = samples.distances(model, vector, range(len(model.leaf_of)))
        field = model.fold(distances, model.blends * samples.scale)
        return cls(samples, model, vector, distances, field)

    def changed(self, model: Model, vector: Floats, leaves: Sequence[int]) -> State:
        """The state after a change of some leaves alone. Raises ParameterError as `of`."""
        copies = np.flatnonzero(np.isin(model.leaf_of, leaves))
        distances = self.distances.copy()
        distances[copies] = self.samples.distances(model, vector, copies.tolist())
        field = self.field.copy()
        near = (np.minimum(np.abs(distances[copies]), np.abs(self.distances[copies])) < 2 * BAND).any(axis=0)
        index = np.flatnonzero(near)
        field[index] = model.fold(distances[:, index], model.blends * self.samples.scale)
        return State(self.samples, model, vector, distances, field)

    def settled(self) -> State:
        """The same, its model being what the vector says."""
        model = self.model.moved(self.vector)
        return State(self.samples, model, model.vector, self.distances, self.field)

    @cached_property
    def deviations(self) -> Floats:
        """(L,) mean distance to the target over each leaf's own points, unit lengths; 0 without points."""
        apart = np.abs(np.clip(self.field, -BAND, BAND) - self.samples.clipped)
        count = len(self.model.leaves)
        sums = np.bincount(self.samples.owner, apart, minlength=count)
        points = np.bincount(self.samples.owner, minlength=count)
        return np.asarray(sums / np.maximum(points, 1))


def _rows(
    model: Model, vector: Floats, copies: Iterable[int], centre: Floats, scale: float
) -> NDArray[np.float32]:
    return np.concatenate([model.rows([vector], c, centre, scale) for c in copies])


def _exposed(
    model: Model,
    rows: NDArray[np.float32],
    blends: Floats,
    centre: Floats,
    scale: float,
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Points of the copies' surfaces that are points of the whole's surface, and their leaves."""
    points, owner = [], []
    for c, copy in enumerate(copy for leaf in model.leaves for copy in leaf.copies):
        lower, upper = (copy.bounds() - centre) * scale
        rng = np.random.default_rng(c)
        found = _on_surface(rows[[c]], rng.uniform(lower - 0.01, upper + 0.01, (_TRIED, 3)))
        whole = model.fold(kernel.evaluate_parts(rows, found), blends) if len(found) else np.empty(0)
        found = found[np.abs(whole) < _EXPOSED][:_KEPT]
        points.append(found)
        owner.append(np.full(len(found), model.leaf_of[c]))
    return np.concatenate(points), np.concatenate(owner)


def _on_surface(row: NDArray[np.float32], points: Floats) -> NDArray[np.float32]:
    """Points taken to the zero of the row's distance by Newton steps; those that arrive."""
    nudges = _NUDGE * np.concatenate([np.eye(3), -np.eye(3)])
    for _ in range(_NEWTON):
        around = (points[:, None] + nudges).reshape(-1, 3)
        values = kernel.evaluate(row, around.astype(np.float32)).reshape(-1, 6).astype(np.float64)
        slope = (values[:, :3] - values[:, 3:]) / (2 * _NUDGE)
        value = kernel.evaluate(row, points.astype(np.float32)).astype(np.float64)
        points = points - slope * (value / np.maximum((slope**2).sum(axis=1), 0.1))[:, None]
    arrived = np.abs(kernel.evaluate(row, points.astype(np.float32))) < _ON_SURFACE
    return points[arrived].astype(np.float32)
