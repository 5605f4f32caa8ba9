"""Settings of a SuperFrusta fit. Defaults that differ from the paper say so and why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal

from partwright.errors import SettingError
from partwright.methods import check_number, preset
from partwright.superfrusta.families import FAMILIES, Family, locked_values

_SMALL_PRICE = 2e-4

Optimiser = Literal["newton", "adam"]


@dataclass(frozen=True)
class Settings:
    """How a shape is fitted. Lengths are in the unit frame (longest side 1.8).

    Residual Primitive Fitting (sections 3.1, 3.3, 3.4, 4):
        rounds: at most so many rounds of growing (paper: 10).
        regions: regions of the decomposition a round (paper: 7 iterations of MSD).
        kappa: share of the remaining volume that a core must hold (eq. 5; the paper gives no value).
        alpha: price of a part in the objective (eq. 2). At the paper's 1e-3 the last third of the parts buys
            about one point of IoU.
        optimiser: "newton", Levenberg-Marquardt on the occupancy residuals with analytic derivatives, or
            "adam", the paper's three losses by gradient descent.
        overlap, blending: weights of the quality terms of eq. 8 beside the reconstruction (paper: 1e-2 in a
            mean that is not squared). More of them costs parts and surface rather than buying less overlap.
        subtract: parts may also be taken away from what came before them, where too much is covered.
        smooth: parts blend into each other (eq. 4); otherwise unions are plain.
        family: "superfrustum", or less of it: "superprimitive" (no taper, no bulge), "cuboid" (Table 2), or
            "solid": each part one of the named kinds (solid_kinds.py). Parts of a start keep what
            they have of the rest.

    Ours:
        merging: replace touching pairs of parts by one where it explains as much.
        attempts: times that the shape is fitted from the start, each with other regions; the best is kept.
        cycles: times that the grown assembly is thinned out, refitted and grown again.
        trials: removals that are tried with a refit before the cheapest is taken.
        patience: rounds without progress before growing stops.
        max_parts: at most so many parts (None: as many as pay for themselves).
        min_iou: stop removing parts where the IoU would fall below, and keep removing above (None: by alpha).
        symmetry: where the shape has a mirror plane or a rotation, parts come as repeats (docs/repeats.md).
        curve: thin out down to one part and keep the assembly of every size on the way.
        near, uniform: sample points near the surface and in the box. resolution: grid of the decomposition.
    """

    method: ClassVar[str] = "superfrusta"

    rounds: int = 10
    regions: int = 7
    kappa: float = 0.02
    alpha: float = 3.55e-3
    optimiser: Optimiser = "newton"
    overlap: float = 0.02
    blending: float = 0.02
    subtract: bool = False
    smooth: bool = True
    family: Family = "superfrustum"
    merging: bool = True
    attempts: int = 1
    cycles: int = 2
    trials: int = 3
    patience: int = 2
    max_parts: int | None = None
    min_iou: float | None = None
    near: int = 30_000
    uniform: int = 30_000
    resolution: int = 96
    curve: bool = False
    symmetry: bool = True

    def __post_init__(self) -> None:
        for name in ("rounds", "regions", "attempts", "trials", "patience", "near", "uniform"):
            check_number(name, getattr(self, name), low=1)
        check_number("cycles", self.cycles, low=0)
        check_number("resolution", self.resolution, low=24, high=512)
        check_number("kappa", self.kappa, low=1e-4, high=1.0)
        for name in ("alpha", "overlap", "blending"):
            check_number(name, getattr(self, name), low=0.0)
        if self.max_parts is not None:
            check_number("max_parts", self.max_parts, low=1)
        if self.min_iou is not None:
            check_number("min_iou", self.min_iou, low=0.0, high=1.0)
        if self.optimiser not in ("newton", "adam"):
            raise SettingError(f'optimiser: expected "newton" or "adam", got {self.optimiser!r}')
        if self.family not in FAMILIES:
            raise SettingError(f"family: expected one of {', '.join(FAMILIES)}, got {self.family!r}")
        if self.optimiser == "adam" and (locked_values(self.family, self.smooth) or self.subtract):
            raise SettingError(
                'optimiser "adam" moves all parameters of parts that are added: it needs family '
                f'"superfrustum", smooth unions and no subtraction, got {self.family!r}, '
                f"smooth={self.smooth} and subtract={self.subtract}"
            )

    @classmethod
    def for_quality(cls, quality: str = "normal", **changes: Any) -> Settings:
        """The preset `draft`, `normal` or `high`, with `changes` on top.

        Raises:
            SettingError: the preset or a change is unknown or out of range.
        """
        return preset(PRESETS, quality, changes)

    def at_once(self, round_: int, most: int) -> int:
        """Parts that one round may add: few at first where some are subtracted, for each changes what is left
        to explain."""
        return min(most, 1 + round_ // 2) if self.subtract else most

    @property
    def price(self) -> float:
        """What a part must pay while growing: nothing where a target or a whole curve asks for more parts."""
        return _SMALL_PRICE if self.curve or self.min_iou is not None else self.alpha


PRESETS: dict[str, Settings] = {
    "draft": Settings(rounds=2, regions=14, cycles=1, trials=1, near=10_000, uniform=10_000, resolution=64),
    "normal": Settings(),
    "high": Settings(attempts=3, cycles=3, alpha=2e-3, near=45_000, uniform=45_000),
}
