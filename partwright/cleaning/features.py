"""What may coincide: centres and faces along the axes along which parts lie, and dimensions of parts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from partwright.cleaning.dimensions import dimensions, flat, reaches
from partwright.cleaning.model import Model
from partwright.cleaning.orientations import Frames, aligned

Floats = NDArray[np.float64]
Kind = Literal["centre", "face", "side", "number"]

_ALIKE = 1e-9  # of cosines
_SHARED = 1 / 3  # of the parts must lie along a direction that is not the input's for it to count
_LENGTHS = ("size", "height")
_RADII = ("radius", "bottom_radius", "top_radius", "major_radius", "minor_radius")


@dataclass(frozen=True)
class Feature:
    """A number that equations can bind: row @ vector."""

    kind: Kind
    """What sort of number it is."""
    owner: int | None
    """The copy whose it is (of a dimension, the first of its leaf); None of the input's own origin."""
    row: Floats
    """(n,) what it takes of each entry of the model's vector."""
    name: str = ""
    """Of its dimension, or "lower" or "upper" end."""

    def value(self, vector: Floats) -> float:
        return float(self.row @ vector)


@dataclass(frozen=True)
class Family:
    """Features of which those that nearly coincide should: about one axis, or of one sort of dimension."""

    kind: Kind
    """What is compared; among sides there are faces, too."""
    members: tuple[Feature, ...]
    """In the order of the model's copies."""
    axis: Floats | None = None
    """(3,) direction of places along it; None for dimensions."""


def families(model: Model, frames: Frames) -> Iterator[Family]:
    """All families of a model, in the order in which they are to be tried."""
    copies = range(len(model.leaf_of))
    for kind in ("centre", "number", "face", "side"):
        if kind == "number":
            yield from _numbers(model)
            continue
        for direction, world in frames.directions():
            found = [one for c in copies for one in _along(model, frames, c, direction, world)]
            leaves = {int(model.leaf_of[one.owner]) for one in found if one.owner is not None}
            if not world and len(leaves) < max(2.0, _SHARED * len(model.leaves)):
                continue
            # A round side may touch a face as well.
            members = [one for one in found if one.kind == kind or (kind == "side" and one.kind == "face")]
            if world:
                members.append(Feature(kind, None, np.zeros(len(model.variables))))
            yield Family(kind, tuple(members), direction)


def _lying(model: Model, frames: Frames, copy: int, direction: Floats, world: bool) -> int | None:
    """The local axis of a copy that lies along a direction, -1 for any across an axis of revolution; None
    where there is none. Bodies of revolution along the input's axes are compared along these alone."""
    rotation = model.rotations[copy]
    freely = model.freely(copy)
    if freely == "all":
        return -1 if world else None
    cosines = np.abs(direction @ rotation)
    if cosines.max() > 1 - _ALIKE:
        local = int(cosines.argmax())
        return local if freely not in ("axis", "arrow") or local == 2 else -1
    if freely in ("axis", "arrow") and cosines[2] < _ALIKE:
        return -1 if world or aligned(frames.rotations[0], rotation, freely) is None else None
    return None


def _along(model: Model, frames: Frames, copy: int, axis: Floats, world: bool) -> Iterator[Feature]:
    """Centre and ends of a copy along an axis, if it lies along it."""
    local = _lying(model, frames, copy, axis, world)
    if local is None:
        return
    leaf = int(model.leaf_of[copy])
    field = model.leaves[leaf].field
    centre = np.zeros(len(model.variables))
    centre[model.places(copy)] = axis
    yield Feature("centre", copy, centre)
    reach = reaches(field)
    if reach is None:
        return
    kind: Kind = "face" if local >= 0 and flat(field)[local] else "side"
    for sign, name in ((-1.0, "lower"), (1.0, "upper")):
        row = centre.copy()
        row[model.numbers(leaf)] = sign * reach[max(local, 0)]
        yield Feature(kind, copy, row, name)


def _numbers(model: Model) -> Iterator[Family]:
    """Radii, lengths, and each other dimension by itself."""
    sorts: dict[str, list[Feature]] = {}
    for leaf, part in enumerate(model.leaves):
        for k, dimension in enumerate(dimensions(type(part.field))):
            row = np.zeros(len(model.variables))
            row[model.column("number", leaf, k)] = 1.0
            sort = dimension.attribute
            sort = "length" if sort in _LENGTHS else "radius" if sort in _RADII else sort
            feature = Feature("number", int(model.firsts[leaf]), row, dimension.name)
            sorts.setdefault(sort, []).append(feature)
    for sort in sorted(sorts, key=lambda s: (s != "radius", s)):
        yield Family("number", tuple(sorts[sort]))


def clusters(
    members: Sequence[Feature], vector: Floats, reach: float, relative: float = 0.0
) -> list[list[Feature]]:
    """Features within `reach` of one another (and within a share of the value, if given), largest first.

    The ends of one copy are never in one cluster: that would leave it without thickness.
    """
    ordered = sorted(members, key=lambda one: one.value(vector))
    pending = [ordered]
    found = []
    while pending:
        group = pending.pop()
        if len(group) < 2:
            continue
        values = np.array([one.value(vector) for one in group])
        most = min(reach, relative * float(np.abs(values).mean())) if relative else reach
        places = [one.owner for one in group if one.kind != "number"]
        if values[-1] - values[0] <= most and len(set(places)) == len(places):
            found.append(group)
            continue
        pending += halves(group, vector)
    return sorted(found, key=lambda group: (-len(group), _spread(group, vector)))


def halves(group: list[Feature], vector: Floats) -> list[list[Feature]]:
    """The group, sorted by value, parted at its widest gap."""
    values = np.array([one.value(vector) for one in group])
    at = int(np.diff(values).argmax()) + 1
    return [group[:at], group[at:]]


def _spread(group: Sequence[Feature], vector: Floats) -> float:
    values = [one.value(vector) for one in group]
    return max(values) - min(values)


def meaningful(family: Family, group: Sequence[Feature]) -> bool:
    """Whether the group says something: round sides count only where they touch a face."""
    return family.kind != "side" or len({one.kind for one in group if one.owner is not None}) == 2
