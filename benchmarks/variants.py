"""What `ablations.py` compares: variants of the default fit, by its settings or with one piece replaced."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from typing import Any
from unittest import mock

import numpy as np
from numpy.typing import NDArray

from partwright.fields.columns import Column
from partwright.fields.kernel import Rows, Target
from partwright.superfrusta import growing, initialisation
from partwright.superfrusta.backend import Kernel
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings

# Smaller than the default, so that all of it runs in minutes; no round or cycle less.
BASE = Settings(near=8_000, uniform=8_000, resolution=64)
# For what runs in PyTorch.
SMALL = replace(BASE, near=4_000, uniform=4_000, rounds=4, cycles=1)
SHORT = replace(BASE, rounds=3, cycles=1)
SINGLE = replace(BASE, rounds=1, regions=32, cycles=0)

FAMILIES = "Families and unions (Table 2)"
QUADRICS = "Superquadrics (Table 2), on few samples"
PIECES = "Decomposition and fitting (Table 3)"
LOSSES = "Losses and targets"
SEARCH = "Search"
BEYOND = "Carving and mending"
OPTIMISERS = "The paper's optimiser"
TERMS = "The paper's losses"
# section -> what its reader has to know
NOTES = {
    QUADRICS: "Superquadrics are fitted in PyTorch by the radial distance, with 4,000 + 4,000 samples, four "
    "rounds and one cycle; their seconds do not compare. The bold row is the SuperFrustum in the compiled "
    "kernel at the same settings.",
    PIECES: "Single shot is one round from up to 32 regions, without merging and thinning. CoACD decomposes "
    "the mesh of the residual's grid, with its default concavity and a shortened search. The default is "
    "residual and morphological.",
    OPTIMISERS: "Growth, merging and removals are the same, with their own fits by least squares; whole "
    "assemblies are optimised by Adam. Three rounds and one cycle.",
    TERMS: "As the table before, with 150 steps of 2,048 points.",
}

Hook = Callable[[], AbstractContextManager[object]]


@dataclass(frozen=True)
class Variant:
    """A row of a table. base: name of the row that it is compared with. few: fitted to every third shape.

    hook: replaces a piece of the method while it is entered. superquadrics: the fit's parts are to be read as
    such.
    """

    section: str
    name: str
    base: str
    settings: Settings
    hook: Hook = nullcontext
    few: bool = False
    superquadrics: bool = False


@contextmanager
def with_samples(change: Callable[[FitSamples], FitSamples]) -> Iterator[None]:
    """Fits see changed samples."""
    original = FitSamples.of

    def of(*given: Any) -> FitSamples:
        return change(original(*given))

    with mock.patch.object(FitSamples, "of", of):
        yield


class HardTargets:
    """A kernel whose fits compare with the shape's 0/1 occupancy instead of sigmoid(-beta * distance)."""

    FAR = 1e3

    def __init__(self, kernel: Kernel) -> None:
        self.kernel = kernel

    def __getattr__(self, name: str) -> Any:
        return getattr(self.kernel, name)

    def harden(self, target: Target) -> Target:
        return replace(target, distance=np.where(target.distance < 0, -self.FAR, self.FAR).astype(np.float32))

    def levenberg_marquardt(self, rows: Rows, target: Target, *rest: Any, **options: Any) -> Any:
        return self.kernel.levenberg_marquardt(rows, self.harden(target), *rest, **options)

    def fit_starts(
        self, rows: Rows, ranges: NDArray[np.int64], target: Target, *rest: Any, **options: Any
    ) -> Any:
        return self.kernel.fit_starts(rows, ranges, self.harden(target), *rest, **options)


def hard_targets() -> AbstractContextManager[object]:
    return with_samples(lambda samples: replace(samples, kernel=HardTargets(samples.kernel)))


def without_curvature() -> AbstractContextManager[object]:
    """Every sample near the surface weighs the same, on average as before."""

    def change(samples: FitSamples) -> FitSamples:
        weight = samples.weight.copy()
        weight[: samples.near] = weight[: samples.near].mean()
        return replace(samples, weight=weight)

    return with_samples(change)


def one_start(
    points: NDArray[np.float32], spacing: float, frames: NDArray[np.float32] = initialisation._NONE
) -> Rows:
    """The one start of section 3.3: along the principal axis around which the region is the most cylindrical.

    As the measure of that, which the paper leaves to its supplement: how alike the other two extents are.
    """
    straight = initialisation.starts(points, spacing, frames)[:6:2]  # along each of the three principal axes
    width, depth = straight[:, Column.SX], straight[:, Column.SY]
    alike = np.minimum(width, depth) / np.maximum(width, depth)
    chosen = straight[[int(alike.argmax())]]
    chosen[:, Column.ROUNDNESS] = 0.5
    return chosen


def single_starts() -> AbstractContextManager[object]:
    return mock.patch.object(growing, "starts", one_start)


def coacd() -> AbstractContextManager[object]:
    import convex_pieces

    return mock.patch.object(growing, "regions", convex_pieces.regions)


def superquadrics() -> AbstractContextManager[object]:
    from superquadric import fitted_with_superquadrics

    return fitted_with_superquadrics()


def adam(**changes: Any) -> AbstractContextManager[object]:
    """The paper's optimiser with another configuration."""
    from partwright.superfrusta import paper

    return mock.patch.object(paper, "PaperConfig", partial(paper.PaperConfig, **changes))


def quick_adam(**changes: Any) -> Hook:
    return partial(adam, iterations=150, batch=2048, **changes)


def variants() -> list[Variant]:
    """All rows, in the order of the tables; the base of a table comes first."""
    default, small, short = "default", "SuperFrustum, few samples", "ours, 3 rounds"
    quick = "the paper's, 150 steps"
    descent = replace(SHORT, optimiser="adam")
    return [
        Variant(FAMILIES, default, default, BASE),
        Variant(FAMILIES, "SuperFrustum, plain unions", default, replace(BASE, smooth=False)),
        Variant(FAMILIES, "superprimitive", default, replace(BASE, family="superprimitive")),
        Variant(
            FAMILIES,
            "superprimitive, plain unions",
            default,
            replace(BASE, family="superprimitive", smooth=False),
        ),
        Variant(FAMILIES, "cuboid", default, replace(BASE, family="cuboid")),
        Variant(FAMILIES, "cuboid, plain unions", default, replace(BASE, family="cuboid", smooth=False)),
        Variant(QUADRICS, small, small, SMALL, few=True),
        Variant(QUADRICS, "superquadric", small, SMALL, superquadrics, few=True, superquadrics=True),
        Variant(
            QUADRICS,
            "superquadric, plain unions",
            small,
            replace(SMALL, smooth=False),
            superquadrics,
            few=True,
            superquadrics=True,
        ),
        Variant(PIECES, "single shot, CoACD", default, SINGLE, coacd),
        Variant(PIECES, "single shot, morphological", default, SINGLE),
        Variant(PIECES, "residual, CoACD", default, BASE, coacd),
        Variant(LOSSES, "no overlap loss", default, replace(BASE, overlap=0.0)),
        Variant(LOSSES, "no blending loss", default, replace(BASE, blending=0.0)),
        Variant(LOSSES, "neither", default, replace(BASE, overlap=0.0, blending=0.0)),
        Variant(LOSSES, "no weight on curvature", default, BASE, without_curvature),
        Variant(LOSSES, "hard target", default, BASE, hard_targets),
        Variant(SEARCH, "no merging", default, replace(BASE, merging=False)),
        Variant(SEARCH, "no thinning (0 cycles)", default, replace(BASE, cycles=0)),
        Variant(SEARCH, "one start", default, BASE, single_starts),
        Variant(SEARCH, "no symmetry", default, replace(BASE, symmetry=False)),
        Variant(BEYOND, "nothing subtracted", default, replace(BASE, subtract=False)),
        Variant(BEYOND, "not mended", default, replace(BASE, mends=0)),
        Variant(BEYOND, "neither subtracted nor mended", default, replace(BASE, subtract=False, mends=0)),
        Variant(OPTIMISERS, short, short, SHORT, few=True),
        Variant(OPTIMISERS, "the paper's, 300 steps", short, descent, few=True),
        Variant(TERMS, quick, quick, descent, quick_adam(), few=True),
        Variant(TERMS, "no count loss", quick, descent, quick_adam(count=0.0), few=True),
        Variant(TERMS, "no quality loss", quick, descent, quick_adam(quality=0.0), few=True),
        Variant(TERMS, "no reconstruction loss", quick, descent, quick_adam(reconstruction=0.0), few=True),
        Variant(TERMS, "soft target", quick, descent, quick_adam(soft_target=True), few=True),
    ]
