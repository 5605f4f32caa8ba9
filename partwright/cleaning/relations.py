"""The relations that hold in an assembly, in words: what cleaning found, and what was there before."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.cleaning.dimensions import RATIOS
from partwright.cleaning.features import Family, Feature, clusters, families, meaningful
from partwright.cleaning.grid import Grid
from partwright.cleaning.model import Model
from partwright.cleaning.orientations import Frames, aligned
from partwright.cleaning.patterns import Circle, circles, mirror_pairs

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Relation:
    """What holds exactly between parts."""

    kind: str
    """"aligned", "parallel", "coaxial", "centred", "flush", "tangent", "equal", "circle", "mirrored" or
    "repeated"."""
    parts: tuple[str, ...]
    """Their names, a copy of a repeated part as "name/2"."""
    text: str
    """The relation in words."""

    def __str__(self) -> str:
        return f"{', '.join(self.parts)}: {self.text}"

    def to_dict(self) -> dict[str, Any]:
        """For report.json."""
        return asdict(self) | {"parts": list(self.parts)}


def relations(assembly: Assembly, frames: Frames, grid: Grid) -> tuple[Relation, ...]:
    """All that hold exactly, to rounding, along the axes of the frames; what copies of one part have in
    common with each other alone goes without saying."""
    model = Model.of(assembly)
    words = _Words(model, assembly.unit, grid)
    rounds = list(circles(model, model.vector, frames, 10 * grid.same))
    found: list[Relation] = []
    found += _orientations(model, frames, words)
    found += _repeats(model)
    found += (_around(model, frames, words, circle) for circle in rounds)
    found += _coaxial(model, frames, words, grid)
    together = [set(circle.copies) for circle in rounds]
    for family in families(model, frames):
        found += _family(model, family, words, grid, together)
        if family.kind == "centre":
            found += _mirrors(model, frames, family, words, grid, together)
    return tuple(found)


@dataclass(frozen=True)
class _Words:
    """Numbers and parts in words."""

    model: Model
    unit: str | None
    grid: Grid

    def length(self, value: float) -> str:
        return f"{0.0 if abs(value) < 10 * self.grid.same else value:.6g}" + (
            f" {self.unit}" if self.unit else ""
        )

    def copies(self, copies: Sequence[int]) -> tuple[str, ...]:
        """Names; all copies of a part are the part."""
        names = []
        for leaf in dict.fromkeys(self.model.leaf_of[list(copies)].tolist()):
            own = np.flatnonzero(self.model.leaf_of == leaf)
            name = self.model.leaves[leaf].name
            given = [c for c in own if c in copies]
            if len(given) == len(own):
                names.append(name)
            else:
                names += [name if c == own[0] else f"{name}/{c - own[0] + 1}" for c in given]
        return tuple(names)

    def axis(self, direction: Floats) -> str:
        whole = int(np.abs(direction).argmax())
        if abs(direction[whole]) > 1 - 1e-9:
            return "xyz"[whole]
        return "(" + ", ".join(f"{v + 0.0:.4g}" for v in np.round(direction, 9)) + ")"


def _orientations(model: Model, frames: Frames, words: _Words) -> Iterator[Relation]:
    for f, frame in enumerate(frames.rotations):
        lying = [
            c
            for c in range(len(model.leaf_of))
            if model.freely(c) != "all" and aligned(frame, model.rotations[c], model.freely(c)) is not None
        ]
        if f == 0 and lying:
            yield Relation("aligned", words.copies(lying), "along the input's axes")
        elif len(lying) > 1:
            yield Relation("parallel", words.copies(lying), "parallel or square to one another")


def _repeats(model: Model) -> Iterator[Relation]:
    for part in model.leaves:
        if part.instances:
            yield Relation("repeated", (part.name,), f"one part, {len(part.copies)} times")


def _around(model: Model, frames: Frames, words: _Words, circle: Circle) -> Relation:
    across, along = circle.radius(model, frames, 0.0)
    radius = float(np.hypot(across @ model.vector, along @ model.vector))
    axis = words.axis(frames.rotations[circle.frame][:, circle.axis])
    text = f"{len(circle.copies)} around a circle of radius {words.length(radius)} about {axis}"
    return Relation("circle", words.copies(circle.copies), text)


def _coaxial(model: Model, frames: Frames, words: _Words, grid: Grid) -> Iterator[Relation]:
    """Bodies of revolution on one line."""
    lines: dict[tuple[int, ...], list[int]] = {}
    for c in range(len(model.leaf_of)):
        for f, frame in enumerate(frames.rotations):
            freely = model.freely(c)
            axes = aligned(frame, model.rotations[c], freely) if freely in ("axis", "arrow") else None
            if axes is not None:
                k = int(np.flatnonzero(axes == 2)[0])
                place = np.delete(frame.T @ model.vector[model.places(c)], k) / (20 * grid.same)
                lines.setdefault((f, k, *np.rint(place).astype(int).tolist()), []).append(c)
                break
    for (f, k, *_), copies in lines.items():
        if len(set(model.leaf_of[copies].tolist())) > 1:
            axis = words.axis(frames.rotations[f][:, k])
            yield Relation("coaxial", words.copies(copies), f"coaxial along {axis}")


def _family(
    model: Model, family: Family, words: _Words, grid: Grid, together: Sequence[set[int]]
) -> Iterator[Relation]:
    names = {
        "centre": ("centred", "centred on"),
        "face": ("flush", "flush at"),
        "side": ("tangent", "touch at"),
    }
    for group in clusters(family.members, model.vector, 10 * grid.same):
        owners = [one.owner for one in group if one.owner is not None]
        where = words.length(group[0].value(model.vector))
        if family.kind == "number":
            yield from _equal(model, group, where, words)
            continue
        grounded = family.kind == "centre" and len(owners) < len(group)
        alone = len(set(model.leaf_of[owners].tolist())) < 2 or any(set(owners) <= one for one in together)
        if (alone and not grounded) or not meaningful(family, group):
            continue
        assert family.axis is not None
        kind, text = names[family.kind]
        yield Relation(kind, words.copies(owners), f"{text} {words.axis(family.axis)} = {where}")


def _equal(model: Model, group: Sequence[Feature], value: str, words: _Words) -> Iterator[Relation]:
    leaves = [int(model.leaf_of[one.owner]) for one in group if one.owner is not None]
    names = [model.leaves[leaf].name for leaf in leaves]
    if group[0].name in RATIOS or abs(group[0].value(model.vector)) <= 10 * words.grid.same:
        return  # a plain ratio, or nothing: no wonder that several have it
    sorts = {one.name for one in group}
    if len(sorts) == 1:
        yield Relation("equal", tuple(names), f"equal {sorts.pop().replace('_', ' ')} {value}")
    else:
        named = (f"{n} {one.name.replace('_', ' ')}" for n, one in zip(names, group, strict=True))
        yield Relation("equal", tuple(named), f"equal, {value}")


def _mirrors(
    model: Model,
    frames: Frames,
    family: Family,
    words: _Words,
    grid: Grid,
    together: Sequence[set[int]],
) -> Iterator[Relation]:
    assert family.axis is not None
    frame, axis = frames.find(family.axis)
    same = 10 * grid.same
    planes = [one for one in family.members if one.owner is None]
    planes += [group[0] for group in clusters(family.members, model.vector, same)]
    for a, b, _ in mirror_pairs(model, model.vector, frames, planes, axis, frame, same):
        if any({a, b} <= one for one in together):
            continue
        plane = float((model.vector[model.places(a)] + model.vector[model.places(b)]) @ family.axis / 2)
        where = f"{words.axis(family.axis)} = {words.length(plane)}"
        yield Relation("mirrored", words.copies([a, b]), f"mirror images across {where}")
