"""What every signed-distance field is, and how its numbers are checked and written down."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass, replace
from reprlib import repr as brief
from typing import TYPE_CHECKING, Any, ClassVar, Self, TypeVar

import numpy as np

from partwright.errors import ParameterError

if TYPE_CHECKING:
    import torch
    import trimesh

    from partwright.fields.quadric import Quadric
    from partwright.fields.superfrustum import SuperFrustum

    Array = TypeVar("Array", np.ndarray, torch.Tensor)
else:
    Array = TypeVar("Array")

# Longest length a field accepts: its square still fits into float32, in which distances are computed.
LARGEST = 1e12

# How much faster than distance a field may change. Unions, poses and tapers keep 1; a SuperFrustum's bend
# stretches the inside of its arc (up to pi/2 at a third of the radius), and callers' fields are rarely exact.
LIPSCHITZ = 1.6

NUMBERS = (int, float, np.integer, np.floating)


class Field(ABC):
    """A signed distance: negative inside, positive outside, in the length unit of its own parameters.

    Fields are frozen dataclasses of numbers and triples in a local frame; a `Part` gives them their place.
    What others need to know of a field it says itself: a new kind overrides what it knows better.
    """

    kind: ClassVar[str]  # its name in an assembly file

    @abstractmethod
    def __call__(self, points: Array) -> Array:
        """Distances (N,) at points (N, 3): numpy in, numpy (float32) out; torch in, torch out."""

    @abstractmethod
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner (3,) of a box, aligned with the local axes, that holds all of the inside."""

    @abstractmethod
    def scaled(self, factor: float) -> Self:
        """The same solid `factor` times as large; raises ParameterError unless factor is positive."""

    @property
    def stem(self) -> str:
        """What the names of its parts begin with where they have none: "cylinder_01"."""
        return self.kind

    @property
    def lipschitz(self) -> float:
        """How much its value changes per length at most, near the surface."""
        return LIPSCHITZ

    @property
    def wall(self) -> float:
        """How thin it is where it is thinnest, tips aside; infinite where that is not known."""
        return math.inf

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        """(K,) how far the inside of the level set at `level` (>= 0) reaches along unit directions (K, 3).

        Infinite where that has no end or is not known, minus infinity where nothing is inside.
        """
        lower, upper = self.bounds()
        return np.asarray(np.maximum(directions * lower, directions * upper).sum(axis=1) + level)

    def superfrustum(self) -> SuperFrustum | None:
        """The SuperFrustum with exactly this surface, None where there is none."""
        return None

    def quadric(self) -> Quadric | None:
        """The quadric that it is, None where it is none."""
        return None

    def surface(self, resolution: int) -> trimesh.Trimesh | None:
        """Closed mesh of its own making, in its own frame; None where it leaves that to `meshing`.

        resolution: about so many cells along the longest side of its bounds, or more. Raises NoSurfaceError
        where it has none.
        """
        return None

    def to_dict(self) -> dict[str, Any]:
        """Its kind and parameters as JSON types; `fields.from_dict` is the inverse."""
        if not is_dataclass(self):
            raise TypeError(f"{type(self).__name__} has to be a dataclass or to define its own to_dict")
        values = {entry.name: getattr(self, entry.name) for entry in fields(self)}
        return {"kind": self.kind} | {k: list(v) if isinstance(v, tuple) else v for k, v in values.items()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """The field with these parameters (without `kind`).

        Raises ParameterError for unknown or missing names, wrong types, and values out of range.
        """
        if not is_dataclass(cls):
            raise TypeError(f"{cls.__name__} has to be a dataclass or to define its own from_dict")
        known = {entry.name: entry.default is MISSING for entry in fields(cls)}
        unknown = [name for name in data if name not in known]
        missing = [name for name, required in known.items() if required and name not in data]
        if unknown or missing:
            raise ParameterError(
                f"{cls.kind}: unknown parameters {brief(unknown)}, missing parameters {brief(missing)}; "
                f"expected {', '.join(known)}"
            )
        return cls(**data)


def number(owner: Field, name: str, low: float, high: float, *, above: bool = False) -> float:
    """The parameter `name` of a field as a float in [low, high], or in (low, high] with `above`."""
    return checked(f"{owner.kind}: {name}", getattr(owner, name), low, high, above)


def vector(owner: Field, name: str, low: float, high: float) -> tuple[float, float, float]:
    """The parameter `name` of a field as three floats in [low, high]."""
    given = getattr(owner, name)
    if not isinstance(given, (tuple, list, np.ndarray)) or len(given) != 3:
        raise ParameterError(f"{owner.kind}: {name} is {brief(given)}; expected three numbers x, y, z")
    x, y, z = (checked(f"{owner.kind}: {name}", value, low, high, False) for value in given)
    return x, y, z


def normalise(owner: Field, **values: float | tuple[float, ...]) -> None:
    """Store checked values in a frozen dataclass from its __post_init__."""
    for name, value in values.items():
        object.__setattr__(owner, name, value)


def scale_lengths(field: Any, factor: float, names: tuple[str, ...]) -> Any:
    """A copy of a dataclass field with the named lengths (numbers or triples) times `factor`."""
    factor = checked(f"{field.kind}: scale factor", factor, 0.0, LARGEST, True)

    def scaled(value: Any) -> Any:
        return tuple(factor * v for v in value) if isinstance(value, tuple) else factor * value

    return replace(field, **{name: scaled(getattr(field, name)) for name in names})


def checked(what: str, given: Any, low: float, high: float, above: bool = False) -> float:
    """`given` as a float in [low, high], or in (low, high] with `above`; raises ParameterError otherwise."""
    is_number = not isinstance(given, bool) and isinstance(given, NUMBERS)
    # Compared before the conversion: an integer of a file may be too large for a float. NaN fails, too.
    if not is_number or not low <= given <= high or (above and given == low):
        none = "" if is_number else ", which is no number"
        raise ParameterError(
            f"{what} is {brief(given)}{none}; expected {low:g} <{'' if above else '='} value <= {high:g}"
        )
    return float(given)
