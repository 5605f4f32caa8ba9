"""Which candidates a tree may begin with, and which are tried with their copies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from partwright.approximation.sketches.candidate import Candidate
from partwright.approximation.sketches.drafts import leans
from partwright.fields import Revolution
from partwright.superfrusta.feature_steps import FeatureTree

_BASES = 4
_NEARLY_WHOLE = 300.0  # degrees
_OF_A_KIND, _RIVALS = 2, 8


def bases(own: Sequence[Candidate], gains: NDArray[np.float64]) -> list[int]:
    """The most promising, and the best of another kind: a gear may be an outline, or a disc with gaps. Before
    what is turned almost all the way, what is turned all around. In the end what has a draft: as it is seen
    from the side, with the pocket in it, it explains more at first."""
    every = np.argsort(-gains).tolist()
    order = [index for index in every if not own[index].usual] or every
    kinds = {own[index].part.field.kind for index in order[:_BASES]}
    other = next((index for index in order if own[index].part.field.kind not in kinds), None)
    first = order[:_BASES] if other is None else [*order[: _BASES - 1], other]
    first += [index for index in order if leans(own[index].part) and index not in first][:1]
    if not is_nearly_whole(own[first[0]]):
        return first
    whole = [index for index in every if _is_whole(own[index])][:1]
    return [*whole, *(index for index in first if index not in whole)]


def _is_whole(candidate: Candidate) -> bool:
    return isinstance(candidate.part.field, Revolution) and candidate.part.field.full


def is_nearly_whole(candidate: Candidate) -> bool:
    """Whether it is turned almost all the way: a keyway looks like that at first, as a gap in a clip does."""
    field = candidate.part.field
    return isinstance(field, Revolution) and _NEARLY_WHOLE <= field.angle < 360.0


def lacks_drafts(tree: FeatureTree, own: Sequence[Candidate]) -> bool:
    """Whether the whole has walls that lean alike, and a tree none of these: it is drawn from the side."""
    leaning = {candidate.key for candidate in own if leans(candidate.part)}
    return bool(leaning) and not any(step.chosen.key in leaning for step in tree.steps)


def various(rivals: Sequence[tuple[float, Candidate, bool]]) -> list[tuple[float, Candidate, bool]]:
    """The first, few of a kind: what is small, but there more often, is tried beside what is large."""
    kept: list[tuple[float, Candidate, bool]] = []
    counts: dict[tuple[str, int, bool], int] = {}
    for gain, chosen, added in rivals:
        kind = chosen.part.field.kind, chosen.sides, added
        counts[kind] = counts.get(kind, 0) + 1
        if counts[kind] <= _OF_A_KIND and len(kept) < _RIVALS:
            kept.append((gain, chosen, added))
    return kept
