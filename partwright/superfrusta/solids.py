"""Method "solids": assemblies of boxes, cylinders and other named solids, added and subtracted.

SuperFrusta, section 5, infers programs of canonical solids by the same residual fit. Here unions are plain,
each part is of one kind (`solid_kinds`), and parts may also be subtracted, which the paper leaves to hollow
primitives.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

from partwright.errors import SettingError
from partwright.methods import FitRequest, Fitted
from partwright.superfrusta.families import Family
from partwright.superfrusta.featured import wants_features
from partwright.superfrusta.method import SuperFrusta
from partwright.superfrusta.settings import Settings as CommonSettings
from partwright.superfrusta.threaded import plain_shape, with_threads


@dataclass(frozen=True)
class Settings(CommonSettings):
    """The settings of a SuperFrusta fit with other defaults."""

    method: ClassVar[str] = "solids"

    family: Family = "solid"
    """Named solids, and nothing else."""
    smooth: bool = False
    """They do not blend."""
    subtract: bool = True
    """Holes, slots and pockets are parts of their own."""
    alpha: float = 2e-3
    """Less than for SuperFrusta: a hole is a part and moves R by less than a part of the body does."""

    profiles: bool = True
    """Begins with features read off the surface: extrusions, turned profiles, holes
    (docs/solids-features.md)."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.family != "solid" or self.smooth:
            raise SettingError(
                f'solids are of family "solid" and do not blend, got {self.family!r} and smooth={self.smooth}'
            )

    @classmethod
    def for_quality(cls, quality: str = "normal", **changes: Any) -> Settings:
        """The preset `draft`, `normal` or `high`, with `changes` on top.

        Raises:
            SettingError: the preset or a change is unknown or out of range.
        """
        preset = asdict(CommonSettings.for_quality(quality))
        unknown = set(changes) - set(preset) - {"profiles"}
        if unknown:
            raise SettingError(f"unknown settings: {', '.join(sorted(unknown))}")
        own = ("family", "smooth", "subtract", "alpha")
        return cls(**{name: value for name, value in preset.items() if name not in own} | changes)


class Solids(SuperFrusta):
    """Parts of the start that are no named solid become the nearest one, unless they are locked."""

    name = "solids"

    def settings(self, quality: str = "normal", **changes: Any) -> Settings:
        return Settings.for_quality(quality, **changes)

    def fit(self, request: FitRequest[CommonSettings]) -> Fitted:
        if not wants_features(request):
            return super().fit(request)
        plain, threads = plain_shape(request.shape)
        return with_threads(super().fit(replace(request, shape=plain)), threads)


METHOD = Solids()
