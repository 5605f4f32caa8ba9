"""The SuperFrustum: one primitive of eight parameters for boxes, cones, shells, arcs and all between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np

from partwright.fields import kernel
from partwright.fields.base import LARGEST, Array, Field, normalise, number, scale_lengths, vector
from partwright.fields.operations import is_tensor
from partwright.fields.superfrustum_support import support

_TIP = 0.25  # of a wall that tapers to nothing, the part that is looked at
_LEAST = float(np.finfo(np.float32).tiny)  # the kernel's least number: what is smaller is nothing to it


def _or_nothing(share: float) -> float:
    """Bent or straight, hollow or solid: for the kernel as for the reference."""
    return share if share >= _LEAST else 0.0


def tightest_bulge(width: Any, height: Any) -> Any:
    """The largest bulge of a part of these sx and sz: numbers or tensors.

    An arc tighter than half the section's width folds through its own centre.
    """
    if is_tensor(width):
        return (height / width.clamp(min=1e-6)).clamp(0, 1).asin() / (math.pi / 2)
    return math.asin(min(1.0, max(0.0, height / max(width, 1e-6)))) / (math.pi / 2)


@dataclass(frozen=True)
class SuperFrustum(Field):
    """SuperFrusta, section 3.2. The axis is z; docs/superfrustum.md has the formula.

    size: full extents x, y, z before dilation, >= 0.
    roundness: corner radius of the cross-section as a fraction of its smaller half extent, 0..1.
    dilation: offset of the whole surface outwards, a length >= 0.
    taper: the top's inset; 1 a prism, 0 a cone or wedge, 2 a flare.
    bulge: bends the axis into an arc of half angle bulge * pi/2 in the xz-plane, towards -x; 0..1.
    onion: hollows it along the axis, 0 solid, towards 1 a thin tube; 0..1.
    """

    kind: ClassVar[str] = "superfrustum"

    size: tuple[float, float, float]
    roundness: float = 0.0
    dilation: float = 0.0
    taper: float = 1.0
    bulge: float = 0.0
    onion: float = 0.0

    def __post_init__(self) -> None:
        normalise(
            self,
            size=vector(self, "size", 0.0, LARGEST),
            roundness=number(self, "roundness", 0.0, 1.0),
            dilation=number(self, "dilation", 0.0, LARGEST),
            taper=number(self, "taper", 0.0, 2.0),
            bulge=_or_nothing(number(self, "bulge", 0.0, 1.0)),
            onion=_or_nothing(number(self, "onion", 0.0, 1.0)),
        )

    def __call__(self, points: Array) -> Array:
        """Signed distance at points (N, 3): numpy by the kernel in float32, torch by the reference."""
        if is_tensor(points):
            return cast(Array, self._reference(points))
        return cast(Array, kernel.evaluate(self.row()[None], cast(np.ndarray, points)))

    @property
    def stem(self) -> str:
        return "part"

    def superfrustum(self) -> SuperFrustum:
        return self

    def parameters(self) -> tuple[float, ...]:
        """sx, sy, sz, roundness, dilation, taper, bulge, onion."""
        return (*self.size, self.roundness, self.dilation, self.taper, self.bulge, self.onion)

    @classmethod
    def from_parameters(cls, values: Sequence[float] | np.ndarray) -> SuperFrustum:
        """The inverse of `parameters`; also of the columns `columns.FIELD` of a kernel row."""
        sx, sy, sz, roundness, dilation, taper, bulge, onion = (float(value) for value in values)
        return cls((sx, sy, sz), roundness, dilation, taper, bulge, onion)

    def row(
        self,
        translation: Sequence[float] = (0.0, 0.0, 0.0),
        rotation: Sequence[float] = (1.0, 0.0, 0.0, 0.0),
        blend: float = 0.0,
    ) -> np.ndarray:
        """The kernel's row (16,) float32 of this field in a place; rotation (w, x, y, z) local to world."""
        return np.array([*translation, *rotation, *self.parameters(), blend], dtype=np.float32)

    def scaled(self, factor: float) -> SuperFrustum:
        return cast(SuperFrustum, scale_lengths(self, factor, ("size", "dilation")))

    @property
    def hollow(self) -> bool:
        """Whether a hole is left along the axis after dilation."""
        return max(1.0, self.taper) * self._half_width * self.onion > self.dilation

    @property
    def thinnest(self) -> float:
        """Smallest thickness of material: the wall or the width at half height, or the height."""
        wall = (1 + self.taper) / 2 * self._half_width
        wall = wall * (1 - self.onion) if self.hollow else 2 * wall
        return min(wall, self.size[2]) + 2 * self.dilation

    @property
    def wall(self) -> float:
        return float(self.walls().min())

    def walls(self) -> np.ndarray:
        """(3,) how thin the solid is along each local axis, tips aside (no resolution would do for them)."""
        result = np.array(self.size) + 2 * self.dilation
        if self.hollow:
            taper = min(max(self.taper, _TIP), 1.0)
            wall = taper * self._half_width * (1.0 - self.onion)
            result[:2] = np.minimum(result[:2], wall + 2 * self.dilation)
        if self.bulge > 0:
            result[[0, 2]] = min(result[0], result[2])
        return result

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        return support(self, directions, level)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Box around the dilated rectangle of the larger end, swept along the arc and its straight ends."""
        flare = max(0.0, self.taper - 1) * self._half_width
        x, y = (extent / 2 + flare + self.dilation for extent in self.size[:2])
        half, angle = self.size[2] / 2, self.bulge * math.pi / 2
        s, k = math.sin(angle), math.cos(angle)
        top = half + x * s + self.dilation * k
        lower = np.array([-x - half * math.tan(angle / 2), -y, -top])
        return lower, np.array([x * k + self.dilation * s, y, top])

    @property
    def _half_width(self) -> float:
        return min(self.size[:2]) / 2

    def _reference(self, points: Any) -> Any:
        import torch

        from partwright.fields import reference

        values = torch.tensor(self.parameters(), dtype=points.dtype, device=points.device)
        return reference.superfrustum(points, values[:3], *values[3:])
