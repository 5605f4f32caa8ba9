"""Solids with a name and their own few numbers, each exactly a SuperFrustum.

All are centred at the origin with the axis along z, and all their numbers are lengths.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, fields
from typing import ClassVar, Self, cast

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.base import LARGEST, Array, Field, normalise, number, scale_lengths, vector
from partwright.fields.superfrustum import SuperFrustum


class Solid(Field):
    """A field that is a SuperFrustum under its usual name."""

    @abstractmethod
    def superfrustum(self) -> SuperFrustum:
        """The SuperFrustum with exactly this surface."""

    def __call__(self, points: Array) -> Array:
        return self.superfrustum()(points)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.superfrustum().bounds()

    def scaled(self, factor: float) -> Self:
        names = tuple(entry.name for entry in fields(self))  # type: ignore[arg-type]
        return cast(Self, scale_lengths(self, factor, names))

    def _check_positive(self, *names: str) -> None:
        normalise(self, **{name: number(self, name, 0.0, LARGEST, above=True) for name in names})


@dataclass(frozen=True)
class Box(Solid):
    """A cuboid of full extents x, y, z."""

    kind: ClassVar[str] = "box"
    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        normalise(self, size=vector(self, "size", 0.0, LARGEST))

    def superfrustum(self) -> SuperFrustum:
        return SuperFrustum(self.size)


@dataclass(frozen=True)
class Cylinder(Solid):
    kind: ClassVar[str] = "cylinder"
    radius: float
    height: float

    def __post_init__(self) -> None:
        self._check_positive("radius", "height")

    def superfrustum(self) -> SuperFrustum:
        return SuperFrustum(_round(self.radius, self.height), roundness=1.0)


@dataclass(frozen=True)
class Cone(Solid):
    """The tip is at z = height/2."""

    kind: ClassVar[str] = "cone"
    radius: float
    height: float

    def __post_init__(self) -> None:
        self._check_positive("radius", "height")

    def superfrustum(self) -> SuperFrustum:
        return SuperFrustum(_round(self.radius, self.height), roundness=1.0, taper=0.0)


@dataclass(frozen=True)
class Frustum(Solid):
    """A cone cut off; the top may be up to twice as wide as the bottom."""

    kind: ClassVar[str] = "frustum"
    bottom_radius: float
    top_radius: float
    height: float

    def __post_init__(self) -> None:
        self._check_positive("bottom_radius", "height")
        normalise(self, top_radius=number(self, "top_radius", 0.0, LARGEST))
        if self.top_radius > 2 * self.bottom_radius:
            raise ParameterError(
                f"frustum: top_radius is {self.top_radius:g}; expected at most twice the bottom_radius "
                f"{self.bottom_radius:g}; swap the two and turn the part over"
            )

    def superfrustum(self) -> SuperFrustum:
        size = _round(self.bottom_radius, self.height)
        return SuperFrustum(size, roundness=1.0, taper=min(2.0, self.top_radius / self.bottom_radius))


@dataclass(frozen=True)
class Sphere(Solid):
    kind: ClassVar[str] = "sphere"
    radius: float

    def __post_init__(self) -> None:
        self._check_positive("radius")

    def superfrustum(self) -> SuperFrustum:
        return SuperFrustum((0.0, 0.0, 0.0), dilation=self.radius)


@dataclass(frozen=True)
class Capsule(Solid):
    """A cylinder of this radius and height with a half sphere on each end: height + 2 radius in all."""

    kind: ClassVar[str] = "capsule"
    radius: float
    height: float

    def __post_init__(self) -> None:
        self._check_positive("radius", "height")

    def superfrustum(self) -> SuperFrustum:
        return SuperFrustum((0.0, 0.0, self.height), dilation=self.radius)


@dataclass(frozen=True)
class Tube(Solid):
    """A cylinder of this outer radius with a coaxial round hole that leaves a wall of this thickness."""

    kind: ClassVar[str] = "tube"
    radius: float
    thickness: float
    height: float

    def __post_init__(self) -> None:
        self._check_positive("radius", "thickness", "height")
        if self.thickness >= self.radius:
            raise ParameterError(
                f"tube: thickness is {self.thickness:g}; expected less than the radius {self.radius:g}; "
                "a tube without a hole is a cylinder"
            )

    def superfrustum(self) -> SuperFrustum:
        onion = 1 - self.thickness / self.radius
        return SuperFrustum(_round(self.radius, self.height), roundness=1.0, onion=onion)


@dataclass(frozen=True)
class Torus(Solid):
    """A ring around z: the tube's centre runs at major_radius, the tube's own radius is minor_radius."""

    kind: ClassVar[str] = "torus"
    major_radius: float
    minor_radius: float

    def __post_init__(self) -> None:
        self._check_positive("major_radius", "minor_radius")
        if self.minor_radius >= self.major_radius:
            raise ParameterError(
                f"torus: minor_radius is {self.minor_radius:g}; expected less than the major_radius "
                f"{self.major_radius:g}, so that the ring has a hole"
            )

    def superfrustum(self) -> SuperFrustum:
        size = _round(self.major_radius, 0.0)
        return SuperFrustum(size, roundness=1.0, dilation=self.minor_radius, onion=1.0)


def _round(radius: float, height: float) -> tuple[float, float, float]:
    return 2 * radius, 2 * radius, height
