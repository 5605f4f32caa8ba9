"""Settings of a CAPRI fit. Defaults that differ from the paper say so and why."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Literal

from partwright.capri.quadric_kinds import KINDS
from partwright.errors import SettingError
from partwright.methods import check_number, preset

Schedule = Literal["search", "paper"]
Start = Literal["seeds", "weights", "auto"]


CHOICES = {
    "schedule": ("search", "paper"),
    "start": ("seeds", "weights", "auto"),
    "supervision": ("voxels", "points", "samples"),
}


@dataclass(frozen=True)
class Settings:
    """How a shape becomes a CSG tree of quadrics. Lengths are in the unit frame (longest side 1.8)."""

    method: ClassVar[str] = "capri"

    schedule: Schedule = "search"
    """"search", ours: quadrics detected on the surface, the tree by discrete search; seconds, not hours.
    "paper": the network of sections 3.1-3.3, fine-tuned by gradient descent in three stages."""
    start: Start = "seeds"
    """Where the quadrics come from. "seeds": surfaces detected on the shape; in the paper's schedule, the
    tree that a search among them finds. "weights": the pre-trained network. "auto": both, and the cheaper
    tree is kept; the report says which."""

    # The tree (section 3.2)
    kinds: tuple[str, ...] = KINDS
    """Quadrics that are looked for; the paper's abc >= 0 leaves out cones."""
    oriented: bool = True
    """Quadrics may have cross terms, so that a tilted cylinder is one primitive (ours)."""
    subtract: bool = True
    """A second union is subtracted (eq. 5)."""
    nested: bool = True
    """A convex may have convex quadrics subtracted within it, where that shortens the tree; each counts as a
    convex of its own."""
    price: float = 6e-4
    """What a primitive costs, as a share of the shape's volume on the wrong side (the description length; the
    paper has none)."""
    convex_price: float = 3e-3
    """What a convex costs, likewise."""
    max_parts: int | None = None
    """At most so many primitives."""
    min_iou: float | None = None
    """The cheapest tree that reaches this IoU."""

    # Ours
    surface: int = 20_000
    """Points on which quadrics are detected."""
    least: int = 25
    """How many of them make a quadric."""
    near: int = 30_000
    """Samples near the surface (the paper: 32,768 voxel centres in all)."""
    uniform: int = 20_000
    """Samples in the box."""
    tries: int = 20
    """Convexes are taken out and replaced so many times."""

    # Schedule "paper" (section 4.1 and the supplement; stages and thresholds: `partwright.capri.stages`)
    iterations: int = 12_000
    """Of each of the three stages (paper: 12,000)."""
    supervision: str = "samples"
    """"voxels" or "points", as in the paper, or "samples" of the surface itself, whose detail is not lost
    between voxels."""
    weights: str | None = None
    """File of a pre-trained network (`python -m partwright.capri`), in place of the one that ships."""
    symmetry: bool = True
    """Holes of one size and direction become one leaf with copies, and convexes alike copies of one."""
    named: bool = True
    """Convexes that are boxes, cylinders, cones, frusta, spheres, prisms or turned profiles become these
    solids, called after what they are for (base_plate, hole, pocket); the others stay intersections of
    quadrics, as all are without it."""

    def __post_init__(self) -> None:
        for name in ("surface", "near", "uniform"):
            check_number(name, getattr(self, name), low=1000)
        for name in ("least", "iterations"):
            check_number(name, getattr(self, name), low=1)
        check_number("tries", self.tries, low=0)
        for name in ("price", "convex_price"):
            check_number(name, getattr(self, name), low=1e-6, high=1.0)
        if self.max_parts is not None:
            check_number("max_parts", self.max_parts, low=1)
        if self.min_iou is not None:
            check_number("min_iou", self.min_iou, low=0.0, high=1.0)
        for name, known in CHOICES.items():
            if getattr(self, name) not in known:
                expected = " or ".join(f'"{one}"' for one in known)
                raise SettingError(f"{name}: expected {expected}, got {getattr(self, name)!r}")
        if self.schedule == "paper" and (self.max_parts is not None or self.min_iou is not None):
            raise SettingError("the paper's schedule knows no max_parts and no min_iou; use schedule search")
        unknown = set(self.kinds) - set(KINDS)
        if unknown or "plane" not in self.kinds:
            raise SettingError(f"kinds: expected plane and any of {', '.join(KINDS[1:])}, got {self.kinds}")
        if self.weights is not None and not Path(self.weights).is_file():
            raise SettingError(f"weights: there is no file {self.weights}")

    def of_schedule(self) -> Settings:
        """These settings; for the paper's schedule without what eq. 1 and 5 cannot hold: cones, cross terms,
        nesting."""
        if self.schedule == "search":
            return self
        kinds = tuple(kind for kind in self.kinds if kind != "cone")
        return replace(self, kinds=kinds, oriented=False, nested=False)

    @classmethod
    def for_quality(cls, quality: str = "normal", **changes: Any) -> Settings:
        """The preset `draft`, `normal` or `high`, with `changes` on top.

        Raises:
            SettingError: the preset or a change is unknown or out of range.
        """
        return preset(PRESETS, quality, changes)


PRESETS: dict[str, Settings] = {
    "draft": Settings(tries=0, near=15_000, uniform=10_000, iterations=1_200),
    "normal": Settings(),
    "high": Settings(tries=100, surface=40_000, least=30, near=60_000, uniform=40_000),
}
