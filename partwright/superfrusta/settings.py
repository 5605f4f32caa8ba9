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
    """How a shape is fitted. Lengths are in the unit frame (longest side 1.8)."""

    method: ClassVar[str] = "superfrusta"

    # Residual Primitive Fitting (sections 3.1, 3.3, 3.4, 4)
    rounds: int = 10
    """At most so many rounds of growing (paper: 10)."""
    regions: int = 7
    """Regions of the decomposition a round (paper: 7 iterations of MSD)."""
    kappa: float = 0.02
    """Share of the remaining volume that a core must hold (eq. 5; the paper gives no value)."""
    alpha: float = 3.7e-3
    """Price of a part in the objective (eq. 2). At the paper's 1e-3 the last third of the parts buys about
    one point of IoU."""
    optimiser: Optimiser = "newton"
    """"newton": Levenberg-Marquardt on the occupancy residuals with analytic derivatives. "adam": the paper's
    three losses by gradient descent."""
    overlap: float = 0.02
    """Weight of the overlap loss (eq. 8) beside the reconstruction (paper: 1e-2 in a mean that is not
    squared). More of it costs parts and surface rather than buying less overlap."""
    blending: float = 0.02
    """Weight of the union loss (eq. 8), likewise."""
    subtract: bool | None = None
    """Whether parts may also be taken away from what came before them, where too much is covered: from the
    first round on, never, or (None) where that is clearly better."""
    smooth: bool = True
    """Parts blend into each other (eq. 4); otherwise unions are plain."""
    family: Family = "superfrustum"
    """"superfrustum", or less of it: "superprimitive" (no taper, no bulge), "cuboid" (Table 2), or "solid":
    each part one of the named kinds (solid_kinds.py). Parts of a start keep what they have of the rest."""

    # Ours
    merging: bool = True
    """Replace touching pairs of parts by one where it explains as much."""
    attempts: int = 1
    """Times that the shape is grown and mended from the start, each time on others of the samples; the best
    is kept, with groups of parts exchanged for better ones of the others."""
    cycles: int = 1
    """Times that the grown assembly is thinned out, refitted and grown again."""
    firmness: float = 0.6
    """Price in the objective, for each unit length that parts are off, while mending."""
    mends: int = 16
    """Tries to mend parts that stick out of the shape or leave places of it out."""
    looks: int = 24
    """At most so many assemblies are looked at closely while the largest deviations are taken in at last."""
    changes: int = 6
    """Places at most where what is off after that is changed: cut, filled, or its part fitted anew."""
    trials: int = 3
    """Removals that are tried with a refit before the cheapest is taken."""
    patience: int = 2
    """Rounds without progress before growing stops."""
    max_parts: int | None = None
    """At most so many parts (None: as many as pay for themselves)."""
    min_iou: float | None = None
    """Stop removing parts where the IoU would fall below, and keep removing above (None: by alpha)."""
    near: int = 30_000
    """Sample points near the surface."""
    uniform: int = 30_000
    """Sample points in the box."""
    resolution: int = 96
    """Voxels along the longest side of the grid of the decomposition."""
    curve: bool = False
    """Thin out down to one part and keep the assembly of every size on the way."""
    symmetry: bool = True
    """Where the shape has a mirror plane or a rotation, or is alike in several places, parts come as repeats
    (docs/repeats-inside.md)."""

    def __post_init__(self) -> None:
        for name in ("rounds", "regions", "attempts", "trials", "patience", "near", "uniform"):
            check_number(name, getattr(self, name), low=1)
        for name in ("cycles", "mends", "looks", "changes"):
            check_number(name, getattr(self, name), low=0)
        check_number("resolution", self.resolution, low=24, high=512)
        check_number("kappa", self.kappa, low=1e-4, high=1.0)
        for name in ("alpha", "overlap", "blending", "firmness"):
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
    def carving(self) -> bool:
        """Whether mending may subtract parts."""
        return self.subtract is not False and self.optimiser == "newton"

    @property
    def price(self) -> float:
        """What a part must pay while growing: nothing where a target or a whole curve asks for more parts."""
        return _SMALL_PRICE if self.curve or self.min_iou is not None else self.alpha


PRESETS: dict[str, Settings] = {
    "draft": Settings(
        rounds=4,
        regions=14,
        trials=1,
        mends=1,
        looks=0,
        changes=0,
        near=10_000,
        uniform=10_000,
        resolution=64,
    ),
    "normal": Settings(),
    "high": Settings(attempts=4),
}
