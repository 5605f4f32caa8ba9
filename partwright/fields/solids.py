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

_BEYOND = 0.1  # share of its length by which a hole goes beyond the solid, so that no faces coincide


class Solid(Field):
    """A field that is a SuperFrustum under its usual name."""

    @abstractmethod
    def superfrustum(self) -> SuperFrustum:
        """The SuperFrustum with exactly this surface."""

    def __call__(self, points: Array) -> Array:
        return self.superfrustum()(points)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.superfrustum().bounds()

    @property
    def wall(self) -> float:
        return self.superfrustum().wall

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        return self.superfrustum().support(directions, level)

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


@dataclass(frozen=True)
class HollowBox(Solid):
    """A cuboid of full extents x, y, z with a rectangular hole along z inside walls of this thickness."""

    kind: ClassVar[str] = "hollow_box"
    size: tuple[float, float, float]
    thickness: float

    def __post_init__(self) -> None:
        normalise(self, size=vector(self, "size", 0.0, LARGEST))
        self._check_positive("thickness")
        if 2 * self.thickness >= min(self.size[:2]):
            raise ParameterError(
                f"hollow_box: thickness is {self.thickness:g}; expected less than half of the sides "
                f"{self.size[0]:g} and {self.size[1]:g}; a hollow box without a hole is a box"
            )

    def superfrustum(self) -> SuperFrustum:
        return SuperFrustum(self.size, onion=1 - 2 * self.thickness / min(self.size[:2]))

    def pieces(self) -> tuple[Solid, Solid]:
        """The box, and the box through it that is its hole."""
        x, y, z = self.size
        wall = 2 * self.thickness
        return Box(self.size), Box((x - wall, y - wall, (1 + _BEYOND) * z))


@dataclass(frozen=True)
class HollowFrustum(Solid):
    """A frustum with a coaxial round hole whose radius is the same share of the outer one at both ends.

    thickness: of the wall at the bottom; at the top it is in proportion. A top_radius of 0 is a hollow cone.
    """

    kind: ClassVar[str] = "hollow_frustum"
    bottom_radius: float
    top_radius: float
    thickness: float
    height: float

    def __post_init__(self) -> None:
        outer = Frustum(self.bottom_radius, self.top_radius, self.height)
        normalise(self, bottom_radius=outer.bottom_radius, top_radius=outer.top_radius, height=outer.height)
        self._check_positive("thickness")
        if self.thickness >= self.bottom_radius:
            raise ParameterError(
                f"hollow_frustum: thickness is {self.thickness:g}; expected less than the bottom_radius "
                f"{self.bottom_radius:g}; a hollow frustum without a hole is a frustum"
            )

    def superfrustum(self) -> SuperFrustum:
        taper = min(2.0, self.top_radius / self.bottom_radius)
        onion = 1 - self.thickness / self.bottom_radius
        return SuperFrustum(_round(self.bottom_radius, self.height), roundness=1.0, taper=taper, onion=onion)

    def pieces(self) -> tuple[Solid, Solid]:
        """The frustum, and the frustum through it that is its hole; a hollow cone's hole ends at the tip."""
        outer = Frustum(self.bottom_radius, self.top_radius, self.height)
        share = 1 - self.thickness / self.bottom_radius
        bottom, top = share * self.bottom_radius, share * self.top_radius
        lean = bottom - top
        more = _BEYOND if lean == 0 else min(_BEYOND, 2 * min(bottom, top) / abs(lean))
        bottom, top = bottom + lean * more / 2, max(top - lean * more / 2, 0.0)
        return outer, Frustum(bottom, top, (1 + more) * self.height)


def _round(radius: float, height: float) -> tuple[float, float, float]:
    return 2 * radius, 2 * radius, height
