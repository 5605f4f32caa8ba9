"""How a shape's structure persists while its assembly grows smaller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from partwright.assembly import Assembly
from partwright.errors import SettingError
from partwright.metrics.purity import owners

RESOLUTION = 48
FINEST = 1e-3  # of 1 - IoU: what the samples of a fit cannot tell apart


@dataclass(frozen=True)
class Plateau:
    """Tolerances (of 1 - IoU) from `lowest` up to `highest` for which `parts` is the fewest that will do."""

    parts: int
    lowest: float
    highest: float

    @property
    def factor(self) -> float:
        """By how much the tolerance may grow before fewer parts will do."""
        return self.highest / self.lowest


@dataclass(frozen=True)
class Stability:
    """nesting: mean share of volume that keeps to its parent. plateaus: from few parts to many. longest: the
    one of the largest factor, single parts aside: its count is the least a matter of tolerance."""

    nesting: float
    plateaus: tuple[Plateau, ...]
    longest: Plateau


def stability(assemblies: Sequence[Assembly], ious: Sequence[float]) -> Stability:
    """How the structure persists over a curve: a fit's assemblies of different sizes, and their IoUs.

    It stands in for InterPrim (SuperFrusta, section 4), how far apart parts lie in a pretrained network's
    features: parts that mean something apart stay apart over many tolerances. It needs no network. The parts
    of each assembly name their parent in the next smaller one by `metadata["parent"]`, as in `Result.curve`.

    Raises SettingError where the curve is empty, its lengths differ, or a parent does not exist.
    """
    if not assemblies or len(assemblies) != len(ious):
        raise SettingError(
            f"A curve needs an IoU for each assembly; got {len(assemblies)} assemblies and {len(ious)} IoUs."
        )
    order = sorted(range(len(assemblies)), key=lambda i: len(assemblies[i]))
    flat = plateaus([len(assemblies[i]) for i in order], [ious[i] for i in order])
    steps = [(assemblies[a], assemblies[b]) for a, b in pairwise(order)]
    # A single part is everybody's parent: that step says nothing.
    shares = [nesting(larger, smaller) for smaller, larger in steps if len(smaller) > 1]
    structured = [plateau for plateau in flat if plateau.parts > 1] or list(flat)
    longest = max(structured, key=lambda plateau: plateau.factor)
    return Stability(float(np.mean(shares)) if shares else 1.0, flat, longest)


def nesting(larger: Assembly, smaller: Assembly) -> float:
    """Share of the larger assembly's volume whose part in the smaller one is the parent of its own.

    1 where every part of the smaller is a union of parts of the larger. Volume is counted at the centres of
    48 cells along the longest side of the larger's bounds.
    """
    index = {part.name: i for i, part in enumerate(smaller.parts)}
    named = [part.metadata.get("parent") for part in larger.parts]
    unknown = [part.name for part, name in zip(larger.parts, named, strict=True) if name not in index]
    if unknown:
        raise SettingError(f"no parent among {', '.join(index)} for {', '.join(unknown)}; give a fit's curve")
    parent = np.array([index[str(name)] for name in named])
    points = _cells_in(larger)
    if not len(points):
        return 1.0
    return float(np.mean(parent[owners(larger, points)] == owners(smaller, points)))


def plateaus(parts: Sequence[int], ious: Sequence[float]) -> tuple[Plateau, ...]:
    """Which count of parts, rising, is the fewest for which tolerances; counts that never are, are left out.

    Tolerances reach from what the best IoU leaves, at least `FINEST`, to 1.
    """
    result: list[Plateau] = []
    highest = 1.0
    for count, iou in zip(parts, ious, strict=True):
        lowest = max(1.0 - iou, FINEST)
        if lowest < highest:
            result.append(Plateau(count, lowest, highest))
            highest = lowest
    if not result:
        raise SettingError(f"no assembly of the curve has any IoU: {', '.join(f'{iou:g}' for iou in ious)}")
    return tuple(result)


def _cells_in(assembly: Assembly) -> np.ndarray:
    """(N, 3) the centres of the cells that lie inside."""
    low, high = assembly.bounds()
    side = float((high - low).max()) / RESOLUTION
    axes = [start + side * (np.arange(max(1, round((end - start) / side))) + 0.5)
            for start, end in zip(low, high, strict=True)]  # fmt: skip
    cells = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return cells[assembly.distance(cells) < 0]
