"""Settings of fits by learned parts. Defaults that differ from the paper say so."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from partwright.errors import SettingError
from partwright.methods import check_count, check_number

START_SHAPES = ("auto", "encoder", "nearest", "mean")


@dataclass(frozen=True, kw_only=True)
class ReconstructionSettings:
    """How latents and poses are optimised until they decode to a shape (section 4.1)."""

    iterations: int = 200
    """Steps (paper: 800); 0 leaves the start as it is."""
    points: int = 2048
    """Samples a step, half of them inside (paper: 8,000, all that it draws)."""
    rate: float = 5e-3
    """Of Adam, for latents."""
    decay: float = 0.1
    """What the rates fall by at half time, when the whole shape's loss joins in."""
    start: Literal["auto", "encoder", "nearest", "mean"] = "auto"
    """From what the model's encoder sees in points of the surface, from the nearest training shapes, or from
    the mean of all; where poses are unknown only. "auto" tries what the encoder sees, where the model has
    one, as one of the `starts`, beside the nearest training shapes."""
    starts: int = 8
    """So many nearest shapes are tried for a 32nd of the iterations each, the three best for an
    eighth, and the best goes on. Of known parts up to four nearest ones each are, for an eighth."""
    exchange: bool = True
    """Single parts of the best start are exchanged for those of other training shapes where that comes
    closer. Known parts start as those of training shapes that are closest; else at the mean, as the
    paper's."""
    pose_rate: float = 2e-3
    """Of Adam, for poses; at 0 they stay as they are known, as the paper's do where parts are known."""
    pose_delay: float = 0.1
    """Share of the iterations for which poses wait until latents have found the rough form."""

    def __post_init__(self) -> None:
        check_count("iterations", self.iterations, low=0)
        for name in ("points", "starts"):
            check_count(name, getattr(self, name), low=1)
        for name in ("rate", "decay", "pose_rate", "pose_delay"):
            check_number(name, getattr(self, name), low=0.0, high=1.0)
        if self.start not in START_SHAPES:
            raise SettingError(f"start is {self.start!r}; expected one of {', '.join(START_SHAPES)}")


@dataclass(frozen=True)
class Settings(ReconstructionSettings):
    """Which model's parts a shape is made of, and how they are found: `pw.LearnedParts("cars")`."""

    method: ClassVar[str] = "parts"

    model: str
    """A model that ships (cars, chairs, mixers, vehicles), or a file (.safetensors)."""
    resolution: int | None = None
    """Cells along the unit frame of the surface's mesh, a multiple of 8 (None: 128, up to 256 where walls are
    thin)."""
    turn: bool = True
    """Whether the shape may stand otherwise than the family: turns about its up axis are tried, and all up
    axes where that is unknown."""
