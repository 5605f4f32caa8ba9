"""The whole question: parameters and their limits, objectives and bounds, and what a point of it measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import trimesh

from partwright.assembly import Assembly
from partwright.errors import NoSurfaceError, SettingError
from partwright.goals.contacts import Contact, allowed, contact_gradients, contacts, pieces_by
from partwright.goals.entry import BLEND, FORM, LATENT, Entry
from partwright.goals.gradient import parameter_gradient
from partwright.goals.objective import Measure, Measured, Start, measured
from partwright.goals.objectives.axes import axis
from partwright.goals.parameters import Parameters
from partwright.goals.regions import TrainedRegion
from partwright.goals.steady import broken_by, gradients, held_parts
from partwright.goals.surface import face_labels, pieces, surface_of, thin_parts
from partwright.goals.symmetry import Mirror
from partwright.goals.wanted import Bound, Wanted, asks_for_labels, bounded, frozen_entries, measure_of
from partwright.methods import check_count, check_number

# What counts as the size of a share that is small, and of a length that is 0, as a share of the longest side.
_SHARE, _LENGTH = 0.2, 0.05
_ROUNDING = 1e-12  # of a natural size: a start below is 0, and no size to divide by
_THIN = 1.3  # cells: walls at the start that leave a part no room to become thinner


@dataclass(frozen=True)
class Options:
    """How a search goes about it.

    steps: surfaces that are tried at most. resolution: cells along the longest side. reach: how far a part
    may go from its place, as a share of the longest side (turns by as much at its far end). change: by which
    share of itself a size may change. anchor: weight of the squared distance from the start (L2). neighbours:
    weight of the distance of latents from those of the training (kNN). contacts: parts that touch go on to.
    still: how far the surface of a learned part that is frozen may follow the others, as a share of the
    longest side; 0 sets no limit. symmetric: an axis (x, y, z), to whose both sides changes are to be the
    same; "" for none.
    """

    steps: int = 60
    resolution: int = 64
    reach: float = 0.1
    change: float = 0.5
    anchor: float = 0.1
    neighbours: float = 0.1
    contacts: bool = True
    still: float = 1e-3
    symmetric: str = ""

    def __post_init__(self) -> None:
        check_count("steps", self.steps, low=1)
        check_count("resolution", self.resolution, low=8)
        check_number("reach", self.reach, 0.0, 10.0)
        check_number("change", self.change, 0.0, 10.0)
        check_number("anchor", self.anchor, 0.0)
        check_number("neighbours", self.neighbours, 0.0)
        check_number("still", self.still, 0.0)
        if self.symmetric:
            axis(self.symmetric, "x", "symmetric")


@dataclass
class Point:
    """Numbers of the parts, their surface, and what it measures.

    change: (D,) of the variables from the start. value: of the weighted sum. broken: (M,) by how much each
    constraint is, <= 0 where kept.
    """

    change: np.ndarray
    assembly: Assembly
    surface: trimesh.Trimesh
    numbers: dict[str, float]
    value: float
    broken: np.ndarray
    sensitivity: np.ndarray
    bounds: list[np.ndarray]
    touching: list[Contact] = field(default_factory=list)


class Problem:
    """Variables are changes of the parameters from the start, in their units (see `Entry`).

    Raises:
        SettingError, ObjectiveError: what is asked for contradicts itself, or cannot be measured.
    """

    def __init__(
        self,
        assembly: Assembly,
        wanted: Sequence[Wanted],
        bounds: Sequence[Bound],
        freeze: Sequence[str],
        options: Options,
    ) -> None:
        if not wanted:
            raise SettingError("there is no objective; give at least one")
        self.options, self.wanted = options, list(wanted)
        self.parameters = Parameters(assembly)
        frozen = frozen_entries(self.parameters, tuple(freeze))
        self.cell = self.parameters.longest / options.resolution
        self.thin = thin_parts(assembly, _THIN * self.cell)
        for i in self.thin:
            frozen[self.parameters.slices[i]] = True
        if frozen.all():
            raise SettingError("every part that is free is thinner than a cell: give a higher resolution")
        self.free = ~frozen
        self.lower, self.upper = self._limits([b for b in bounds if b.of_parameter])
        self.bounds = [b for b in bounds if not b.of_parameter]
        self.region = TrainedRegion(self.parameters)
        surface = surface_of(assembly, options.resolution)
        touching = contacts(assembly)
        self.pieces = max(pieces(surface), pieces_by(touching, assembly))
        # Of the surface: boxes of learned parts are roomy.
        self.length = float(surface.extents.max())
        start = Start(assembly, surface, self.parameters.longest)
        self.measures: dict[str, Measure] = {}
        self.terms: dict[str, tuple[Measured, float]] = {}  # at the start, and a natural size of its numbers
        self.labelled = False
        for name in dict.fromkeys([w.name for w in self.wanted] + [b.name for b in self.bounds]):
            self.measures[name], power = measure_of(name, start)
            self.labelled |= asks_for_labels(name)
            begin, natural = self._measured(name, assembly, surface), start.longest**power
            if power and abs(begin.value) < _ROUNDING * natural:
                begin = replace(begin, value=0.0)
            self.terms[name] = (begin, natural)
        kept = touching if options.contacts else []
        self.touching = [c for c in kept if self._moves(c.a) or self._moves(c.b)]
        self.held = held_parts(assembly, [self._moves(i) for i in range(len(assembly))])
        self.mirror = Mirror.of(assembly, surface, options.symmetric) if options.symmetric else None
        self.depths = [allowed(contact, self.parameters.longest) for contact in self.touching]

    def _moves(self, part: int) -> bool:
        return bool(self.free[self.parameters.slices[part]].any())

    def _limits(self, bounds: list[Bound]) -> tuple[np.ndarray, np.ndarray]:
        """(D,) of the variables."""
        p = self.parameters
        lower, upper = p.lower.copy(), p.upper.copy()
        flat = [entry for entries in p.entries for entry in entries]
        room = np.array([self._room(entry) for entry in flat])
        lower, upper = np.maximum(lower, p.values - room), np.minimum(upper, p.values + room)
        bounded(p, bounds, lower, upper)
        return (lower - p.values) / p.units, (upper - p.values) / p.units

    def _room(self, entry: Entry) -> float:
        if entry.group == LATENT:
            return np.inf
        if entry.group in (FORM, BLEND):
            own = abs(entry.value)
            if entry.upper < np.inf:
                return self.options.change * max(own, _SHARE)
            return self.options.change * (own or _LENGTH * entry.unit)
        return self.options.reach * entry.unit

    def _measured(self, name: str, assembly: Assembly, surface: trimesh.Trimesh) -> Measured:
        return measured(name, self.measures[name], surface, self._labels(assembly, surface))

    def _labels(self, assembly: Assembly, surface: trimesh.Trimesh) -> np.ndarray:
        return face_labels(assembly, surface) if self.labelled else np.zeros(len(surface.faces), np.int64)

    def at(self, change: np.ndarray) -> Point | None:
        """What a change (D,) of the variables makes; None where nothing is left, something has come loose, or
        a part has become thinner than a cell.

        Raises:
            ObjectiveError: an objective has no number there.
        """
        p = self.parameters
        values = np.where(self.free & (change != 0), p.values + change * p.units, p.values)
        assembly = p.with_values(values)
        if not set(thin_parts(assembly, self.cell)) <= set(self.thin):
            return None
        try:
            surface = surface_of(assembly, self.options.resolution)
        except NoSurfaceError:
            return None
        if pieces(surface) > self.pieces:
            return None
        labels = self._labels(assembly, surface)
        found = {name: measured(name, m, surface, labels) for name, m in self.measures.items()}
        value, sensitivity = 0.0, np.zeros_like(surface.vertices)
        for want in self.wanted:
            begin, natural = self.terms[want.name]
            now = found[want.name]
            if want.target is None:
                scale = want.weight / (abs(begin.value) or natural)
                value += scale * now.value
                sensitivity += scale * now.sensitivity
            else:
                target = want.target.beside(begin.value)
                scale = max(abs(begin.value), abs(target)) or natural
                off = (now.value - target) / scale
                value += want.weight * off * off
                sensitivity += 2 * want.weight * off / scale * now.sensitivity
        broken, slopes = [], []
        for bound in self.bounds:
            begin, natural = self.terms[bound.name]
            limit = bound.value.beside(begin.value)
            scale = (1.0 if bound.upper else -1.0) / (max(abs(begin.value), abs(limit)) or natural)
            broken.append(scale * (found[bound.name].value - limit))
            slopes.append(scale * found[bound.name].sensitivity)
        if self.options.still:
            broken += broken_by(self.held, assembly, self.options.still, self.length)
        if self.mirror is not None:
            broken += self.mirror.broken_by(assembly, self.length)
        pairs = [(c.a, c.b) for c in self.touching]
        touching = contacts(assembly, pairs) if pairs else []
        broken += [(c.depth - d) / p.longest for c, d in zip(touching, self.depths, strict=True)]
        value += self.options.anchor * float(change @ change)
        if self.region.parts:
            value += self.options.neighbours * self.region.measure(values)[0]
        numbers = {name: one.value for name, one in found.items()}
        return Point(
            change, assembly, surface, numbers, value, np.array(broken), sensitivity, slopes, touching
        )

    def slopes(self, point: Point) -> tuple[np.ndarray, np.ndarray]:
        """(D,) of the weighted sum and (M, D) of the constraints, by the variables."""
        here = Parameters(point.assembly)
        units = np.where(self.free, self.parameters.units, 0.0)
        stacked = np.stack([point.sensitivity, *point.bounds])
        rows = parameter_gradient(here, point.surface.vertices, point.surface.faces, stacked)
        still = gradients(self.held, here, self.length) if self.options.still else rows[:0]
        alike = rows[:0] if self.mirror is None else self.mirror.gradients(here, self.length)
        touching = contact_gradients(here, point.touching) / self.parameters.longest
        rows = np.concatenate([rows, still, alike, touching]) * units
        slope = rows[0] + 2 * self.options.anchor * np.where(self.free, point.change, 0.0)
        if self.region.parts:
            slope = slope + self.options.neighbours * self.region.measure(here.values)[1] * units
        return slope, rows[1:]
