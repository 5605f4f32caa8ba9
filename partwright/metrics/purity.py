"""How well parts agree with the labels that people gave to a shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import SettingError

if TYPE_CHECKING:
    from partwright.assembly import Assembly

COUNT = 20_000


@dataclass(frozen=True)
class Purity:
    """Parts against labels.

    purity: share of the samples whose label is the most frequent one of their part. floor: the purity of a
    single part, which is the share of the largest label. completeness: share of the samples whose part is the
    most frequent one of their label. parts_per_label: the effective number of parts that share a label, from
    1. found: share of the labels that are the most frequent one of some part.
    """

    purity: float
    floor: float
    completeness: float
    parts_per_label: float
    found: float


def owners(assembly: Assembly, points: np.ndarray) -> np.ndarray:
    """(N,) index into assembly.parts of the part that each point (N, 3) lies deepest in, or nearest to."""
    return assembly.nearest_parts(points)


def purity(owner: np.ndarray, label: np.ndarray, weight: np.ndarray | None = None) -> Purity:
    """Purity and completeness of parts against true labels.

    It stands in for IntraPrim (SuperFrusta, section 4), the variance of a pretrained network's features
    within each part: both ask whether a part holds one meaning. It needs labels instead of a network. Purity
    alone rises with any split and completeness with any merger: read them together, beside the part count.

    owner, label: (N,) index of the part and of the label at each sample. weight: (N,) of the samples; equal
    if None, as for points spread evenly over the surface or the volume.

    Raises SettingError where there are no samples or the arrays differ in length.
    """
    weight = np.ones(len(owner)) if weight is None else np.asarray(weight, dtype=np.float64)
    if not len(owner) or not len(owner) == len(label) == len(weight):
        raise SettingError(
            "Purity needs one part, label and weight a sample; "
            f"got {len(owner)}, {len(label)} and {len(weight)}."
        )
    row, column = np.unique(owner, return_inverse=True)[1], np.unique(label, return_inverse=True)[1]
    shared = np.zeros((row.max() + 1, column.max() + 1))
    np.add.at(shared, (row, column), weight / weight.sum())
    of_label = shared.sum(axis=0)
    spread = of_label**2 / (shared**2).sum(axis=0)  # inverse Simpson index: n for n equal shares
    return Purity(
        purity=float(shared.max(axis=1).sum()),
        floor=float(of_label.max()),
        completeness=float(shared.max(axis=0).sum()),
        parts_per_label=float(spread.mean()),
        found=len(np.unique(shared.argmax(axis=1))) / len(of_label),
    )
