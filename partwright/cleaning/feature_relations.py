"""What holds between features, and their numbers beside what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from partwright.approximation.separation import subtracted_names
from partwright.assembly import Assembly, Part
from partwright.cleaning.dimensions import dimensions, values
from partwright.cleaning.feature_cleaning import groups
from partwright.cleaning.feature_levels import Key, Lying, Size, levels, lying, sides_of, sizes
from partwright.cleaning.grid import Grid
from partwright.cleaning.hole_standards import is_drawn_in_inches, standard_hole
from partwright.cleaning.outline_equations import bend_at
from partwright.cleaning.relations import Relation
from partwright.fields import Extrusion, Pipe, Revolution, Swept
from partwright.fields.profile import circle_of

_SAME = 20.0  # times what is one length on the grid
_SMOOTH = 1e-6  # radians
_KINDS = {"face": ("flush", "flush at"), "centre": ("centred", "centred on")}


@dataclass(frozen=True)
class FeatureNumber:
    """A number of a part: as it was fitted, and as it is now."""

    part: str
    name: str
    """"diameter", "height", "depth" of what is cut, or as the field calls it."""
    nominal: float
    measured: float
    standard: str = ""
    """Of a hole, what it is made for."""

    @property
    def deviation(self) -> float:
        return self.measured - self.nominal

    def __str__(self) -> str:
        made_for = f" ({self.standard})" if self.standard else ""
        return f"{self.part}: {self.name} {self.nominal:.6g}{made_for}, measured {self.measured:.6g}"

    def to_dict(self) -> dict[str, Any]:
        """For report.json."""
        return asdict(self) | {"deviation": float(f"{self.deviation:.6g}")}


def feature_relations(assembly: Assembly, grid: Grid) -> tuple[Relation, ...]:
    """All that hold exactly: along shared axes, at one level, of one radius, smooth, repeated."""
    same = _SAME * grid.same
    frames: list[np.ndarray] = [np.eye(3)]
    parts = [lying(part, frames, same) for part in assembly.parts]
    unit = f" {assembly.unit}" if assembly.unit else ""
    found = [*_lying(parts, frames), *_repeated(parts), *_levels(parts, same, unit)]
    return (*found, *_equal(parts, same, unit), *_smooth_corners(parts))


def _lying(parts: list[Lying], frames: list[np.ndarray]) -> Iterator[Relation]:
    for k, frame in enumerate(frames):
        names = tuple(one.part.name for one in parts if one.frame is frame)
        if k == 0 and names:
            yield Relation("aligned", names, "along the input's axes")
        elif len(names) > 1:
            yield Relation("parallel", names, "parallel or square to one another")


def _repeated(parts: list[Lying]) -> Iterator[Relation]:
    for one in parts:
        if one.part.instances:
            yield Relation("repeated", (one.part.name,), f"one part, {len(one.part.copies)} times")


def _levels(parts: list[Lying], same: float, unit: str) -> Iterator[Relation]:
    own = [
        level for i, one in enumerate(parts) if one.frame is parts[0].frame for level in levels(i, one, same)
    ]
    for kind, (relation, words) in _KINDS.items():
        for axis in range(3):
            members = [level for level in own if level.kind == kind and level.axis == axis]
            for group in groups(members, lambda level: level.value, same):
                names = tuple(dict.fromkeys(parts[level.part].part.name for level in group))
                if len(names) > 1:
                    value = group[0].value
                    where = f"{0.0 if abs(value) < same else value:.6g}{unit}"
                    yield Relation(relation, names, f"{words} {'xyz'[axis]} = {where}")


def _equal(parts: list[Lying], same: float, unit: str) -> Iterator[Relation]:
    measured = [size for i, one in enumerate(parts) for size in sizes(i, one, same)]
    for group in groups(measured, lambda size: size.value, same):
        names = tuple(dict.fromkeys(parts[size.part].part.name for size in group))
        if len(names) > 1:
            yield Relation("equal", names, f"equal radius {group[0].value:.6g}{unit}")


def _smooth_corners(parts: list[Lying]) -> Iterator[Relation]:
    for one in parts:
        count = sum(1 for _ in _smooth(one.part.field)) if isinstance(one.part.field, Swept) else 0
        if count:
            corners = "a corner" if count == 1 else f"{count} corners"
            yield Relation("tangent", (one.part.name,), f"sides run smoothly into one another at {corners}")


def _smooth(field: Swept) -> Iterator[int]:
    corners = field.profile.corners
    for number, loop in enumerate(field.profile.loops):
        if circle_of(loop) is not None:
            continue
        sides = list(sides_of(field, number))
        for (a, b), (_, c) in zip(sides, sides[1:] + sides[:1], strict=True):
            if corners[[a, b], 2].any() and abs(bend_at(corners, a, b, c)) < _SMOOTH:
                yield b


def feature_numbers(given: Assembly, made: Assembly, tolerance: float) -> tuple[FeatureNumber, ...]:
    """Numbers of the parts of `made` beside those of the same parts in `given`. tolerance: how far a hole may
    be off the size that it is made for."""
    cuts, inches = subtracted_names(made), is_drawn_in_inches(made)
    found: list[FeatureNumber] = []
    for before, after in zip(given.parts, made.parts, strict=True):
        cut = after.name in cuts
        known = _numbers(before, cut, 4 * tolerance)
        for key, (name, nominal) in _numbers(after, cut, tolerance).items():
            if key not in known:
                continue
            hole = cut and name == "diameter"
            standard = standard_hole(nominal, tolerance, made.unit, inches) if hole else None
            one = FeatureNumber(after.name, name, nominal, known[key][1], standard[0] if standard else "")
            if one not in found:
                found.append(one)
    return tuple(found)


def _numbers(part: Part, cut: bool, tolerance: float) -> dict[Key, tuple[str, float]]:
    """Names and values by where the part has them. tolerance: within which a side is upright."""
    field, along = part.field, "depth" if cut else "height"
    if not isinstance(field, Swept | Pipe):
        own = zip(dimensions(type(field)), values(field).tolist(), strict=True)
        return {(k,): _named(dimension.name, value, along) for k, (dimension, value) in enumerate(own)}
    one = Lying(part, np.eye(3), np.eye(3), np.zeros(3))
    found = {size.key: _size(size) for size in sizes(0, one, tolerance)}
    if isinstance(field, Extrusion):
        found["height",] = (along, field.height)
    if isinstance(field, Revolution) and not field.full:
        found["angle",] = ("angle", field.angle)
    return found


def _named(name: str, value: float, along: str) -> tuple[str, float]:
    if name == "radius":
        return "diameter", 2 * value
    return along if name == "height" else name.replace("_", " "), value


def _size(size: Size) -> tuple[str, float]:
    return ("diameter", 2 * size.value) if size.whole else (size.name, size.value)
