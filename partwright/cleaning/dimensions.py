"""The numbers of a field that a person would type, and how far the solid reaches along its axes by them."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from partwright.fields import Box, Field, HollowBox, Sphere, SuperFrustum

RATIOS = ("roundness", "taper", "bulge", "onion")

# kind -> name -> half extents along the local x, y, z as sums of its dimensions
_HALF = {"size x": (0.5, 0, 0), "size y": (0, 0.5, 0), "size z": (0, 0, 0.5)}
_REACH: dict[str, Mapping[str, tuple[float, float, float]]] = {
    "superfrustum": _HALF | {"dilation": (1, 1, 1)},
    "box": _HALF,
    "cylinder": {"radius": (1, 1, 0), "height": (0, 0, 0.5)},
    "cone": {"radius": (1, 1, 0), "height": (0, 0, 0.5)},
    "frustum": {"bottom_radius": (1, 1, 0), "height": (0, 0, 0.5)},
    "sphere": {"radius": (1, 1, 1)},
    "hollow_box": _HALF,
    "hollow_frustum": {"bottom_radius": (1, 1, 0), "height": (0, 0, 0.5)},
    "capsule": {"radius": (1, 1, 1), "height": (0, 0, 0.5)},
    "tube": {"radius": (1, 1, 0), "height": (0, 0, 0.5)},
    "torus": {"major_radius": (1, 1, 0), "minor_radius": (1, 1, 1)},
}
_FREELY = {"box": "box", "hollow_box": "box"} | dict.fromkeys(("cone", "frustum", "hollow_frustum"), "arrow")
_FREELY |= dict.fromkeys(("cylinder", "capsule", "tube", "torus"), "axis")


@dataclass(frozen=True)
class Dimension:
    """One number of a field."""

    attribute: str
    """Of the field's class."""
    index: int | None = None
    """Which entry, where the attribute is a triple."""

    @property
    def name(self) -> str:
        return self.attribute if self.index is None else f"{self.attribute} {'xyz'[self.index]}"

    @property
    def ratio(self) -> bool:
        return self.attribute in RATIOS

    @property
    def radial(self) -> bool:
        """Whether the surface moves by as much as the number does; by half of it otherwise."""
        return self.attribute.endswith("radius") or self.attribute in ("thickness", "dilation")


@cache
def dimensions(kind: type[Field]) -> tuple[Dimension, ...]:
    """Of a kind of field, in the order of its parameters."""
    found: list[Dimension] = []
    for entry in dataclasses.fields(kind):  # type: ignore[arg-type]
        if entry.name == "size":
            found += [Dimension("size", i) for i in range(3)]
        else:
            found.append(Dimension(entry.name))
    return tuple(found)


def values(field: Field) -> NDArray[np.float64]:
    """(K,) in the order of `dimensions`."""
    return np.hstack([getattr(field, e.name) for e in dataclasses.fields(field)]).astype(np.float64)  # type: ignore[arg-type]


def with_values(kind: type[Field], numbers: Sequence[float] | NDArray[np.float64]) -> Field:
    """The field of these numbers (K,).

    Raises:
        ParameterError: the kind does not allow them.
    """
    given: dict[str, float | tuple[float, ...]] = {}
    for dimension, value in zip(dimensions(kind), numbers, strict=True):
        if dimension.index is None:
            given[dimension.attribute] = float(value)
        else:
            given[dimension.attribute] = (*given.get(dimension.attribute, ()), float(value))  # type: ignore[misc]
    return kind(**given)


def reaches(field: Field) -> NDArray[np.float64] | None:
    """(3, K): half extents along the local axes are `reaches(field) @ values(field)`.

    None where the solid is bent or tapers, so that it has no such faces, or its kind is not known here.
    """
    if isinstance(field, SuperFrustum) and (field.bulge > 0 or field.taper != 1.0):
        return None
    table = _REACH.get(field.kind)
    if table is None:
        return None
    return np.array([table.get(d.name, (0.0, 0.0, 0.0)) for d in dimensions(type(field))], float).T


def flat(field: Field) -> tuple[bool, bool, bool]:
    """Along which local axes the solid ends in a plane."""
    if isinstance(field, Box | HollowBox):
        return True, True, True
    if isinstance(field, SuperFrustum):
        sharp = field.dilation == 0
        return (field.roundness < 1, field.roundness < 1, True) if sharp else (False, False, False)
    return False, False, field.kind in ("cylinder", "tube", "cone", "frustum", "hollow_frustum")


def turned_freely(field: Field) -> str:
    """Which turns about its own centre leave the field as it is.

    "all" (a sphere), "axis" (about z, and upside down), "arrow" (about z), "box" (half turns about x, y and
    z), "half" (a half turn about z), "none".
    """
    if isinstance(field, Sphere):
        return "all"
    if not isinstance(field, SuperFrustum):
        return _FREELY.get(field.kind, "none")
    upright = field.taper == 1.0
    if field.bulge > 0:
        return "none"
    if field.size[0] == field.size[1] and field.roundness == 1.0:
        return "axis" if upright else "arrow"
    return "box" if upright else "half"
