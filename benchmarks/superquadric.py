"""Superquadrics in place of SuperFrusta, for the comparison of families (SuperFrusta, Table 2).

The driver, its growth, losses and solver stay; only the distance of a part in its own frame is another. A
superquadric of half extents a, b, c and exponents e1 (along z) and e2 (across) is where

    F(x, y, z) = (|x/a|^(2/e2) + |y/b|^(2/e2))^(e2/e1) + |z/c|^(2/e1) = 1

(Barr, Superquadrics and Angle-Preserving Transformations, 1981). Its distance here is the radial one,

    d(p) = |p| (1 - F(p)^(-e1/2)),

along the ray from the centre to p (Gross and Boult, Error of Fit Measures for Recovering Parametric Solids,
1988), which Marching Primitives fits with, too. F^(e1/2) is a p-norm, with p = 2/e1, of |z/c| and of the
p-norm, with p = 2/e2, of |x/a| and |y/b|; as such it is computed, since the powers themselves overflow.

In a parameter row the exponents are e2 = 0.1 + 1.9 roundness and e1 = 0.1 + 1.9 onion, so convex and at least
nearly a box; dilation, taper and bulge have no effect.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, ClassVar
from unittest import mock

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray
from torch import Tensor

from partwright.assembly import Assembly, Part
from partwright.fields import reference
from partwright.fields.base import LARGEST, Array, Field, normalise, number, scale_lengths, vector
from partwright.fields.columns import PROPORTIONS, Column
from partwright.meshing import mesh_field
from partwright.superfrusta import growing, initialisation
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.torch_kernel import TorchKernel

SHARPEST, SOFTEST = 0.1, 2.0
BOXY, ROUND = 0.3, 1.0  # exponents that fits start from
ROUNDNESS, DILATION, TAPER, BULGE, ONION = list(Column)[PROPORTIONS]
MESH_RESOLUTION, STEEPEST = 96, 1e3
_SMALL = 1e-6


def exponent(share: Tensor) -> Tensor:
    return SHARPEST + (SOFTEST - SHARPEST) * share


def share(exponent: float) -> float:
    return (exponent - SHARPEST) / (SOFTEST - SHARPEST)


def p_norm(first: Tensor, second: Tensor, p: Tensor) -> Tensor:
    """(first^p + second^p)^(1/p) of values >= 0, for p >= 1, without overflow; at least `_SMALL`."""
    larger = torch.maximum(first, second).clamp(min=_SMALL)
    ratio = torch.minimum(first, second) / larger
    return larger * (1 + ratio**p) ** (1 / p)


def superquadric(
    points: Tensor,
    size: Tensor,
    roundness: Tensor,
    dilation: Tensor,
    taper: Tensor,
    bulge: Tensor,
    onion: Tensor,
) -> Tensor:
    """Radial distance (..., N) of local points (..., N, 3); the signature of `reference.superfrustum`."""
    x, y, z = (points.abs() / (size.unsqueeze(-2) / 2)).unbind(-1)
    across = p_norm(x, y, 2 / exponent(roundness).unsqueeze(-1))
    scale = p_norm(across, z, 2 / exponent(onion).unsqueeze(-1))
    length = (points * points).sum(-1).clamp(min=_SMALL**2).sqrt()
    unused = 0 * (dilation + taper + bulge)  # the kernel asks for the derivative by every parameter
    return length * (1 - 1 / scale) + unused.unsqueeze(-1)


@dataclass(frozen=True)
class Superquadric(Field):
    """A superquadric of full extents `size`, with the exponents' shares in their range as above."""

    kind: ClassVar[str] = "superquadric"

    size: tuple[float, float, float]
    roundness: float
    onion: float

    def __post_init__(self) -> None:
        normalise(
            self,
            size=vector(self, "size", 0.0, LARGEST),
            roundness=number(self, "roundness", 0.0, 1.0),
            onion=number(self, "onion", 0.0, 1.0),
        )

    def __call__(self, points: Array) -> Array:
        given = torch.as_tensor(points)
        size, roundness, onion = (given.new_tensor(v) for v in (self.size, self.roundness, self.onion))
        unused = torch.zeros_like(roundness)
        distance = superquadric(given, size, roundness, unused, unused, unused, onion)
        return distance.numpy() if isinstance(points, np.ndarray) else distance

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        half = np.array(self.size) / 2
        return -half, half

    def scaled(self, factor: float) -> Superquadric:
        return scale_lengths(self, factor, ("size",))


def starts(
    points: NDArray[np.float32], spacing: float, frames: NDArray[np.float32] = initialisation._NONE
) -> Rows:
    """In every straight frame of the SuperFrustum's starts: a box, a cylinder and an ellipsoid."""
    rows = initialisation.starts(points, spacing, frames)
    rows = rows[(rows[:, ONION] == 0) & (rows[:, BULGE] == 0)]
    rows[:, [DILATION, TAPER]] = 0.0, 1.0
    made = []
    for across, along in ((BOXY, BOXY), (ROUND, BOXY), (ROUND, ROUND)):
        one = rows.copy()
        one[:, [ROUNDNESS, ONION]] = share(across), share(along)
        made.append(one)
    together = np.concatenate(made)
    _, first = np.unique(together, axis=0, return_index=True)
    return together[np.sort(first)]


@contextmanager
def fitted_with_superquadrics() -> Iterator[None]:
    """Within, fits grow superquadrics: the rows of their assemblies are read by `as_superquadrics`.

    The kernel in PyTorch takes a part's distance from the reference, which is another one meanwhile.
    """
    original = FitSamples.of

    def of(*given: Any) -> FitSamples:
        return replace(original(*given), kernel=TorchKernel("cpu"))

    with (
        mock.patch.object(FitSamples, "of", of),
        mock.patch.object(reference, "superfrustum", superquadric),
        mock.patch.object(growing, "starts", starts),
    ):
        yield


def as_superquadrics(assembly: Assembly) -> Assembly:
    """The assembly that a fit within `fitted_with_superquadrics` stands for."""
    parts: list[Part] = []
    for part in assembly.parts:
        field = part.field
        parts.append(replace(part, field=Superquadric(field.size, field.roundness, field.onion)))
    return replace(assembly, children=tuple(parts))


def mesh(assembly: Assembly) -> trimesh.Trimesh:
    """The surface of an assembly of superquadrics, on a dense grid: beside a flat one the radial distance
    rises so steeply that a sparse search would miss it."""
    lower, upper = assembly.bounds()
    return mesh_field(assembly.distance, lower, upper, MESH_RESOLUTION, lipschitz=STEEPEST)
