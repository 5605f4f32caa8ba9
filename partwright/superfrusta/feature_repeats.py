"""Features that are the same solid twice: one of them, with a copy where the other was.

The search takes a candidate with copies where a symmetry of the whole or another piece of what is missed
leads. The ears of a block whose slit leaves it no symmetry are found one by one, each read from the mesh a
little differently.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part, Similarity
from partwright.assembly.motion import signed_permutations
from partwright.assembly.similarity import rotation_matrix
from partwright.superfrusta.feature_copying import nearest_first
from partwright.superfrusta.feature_groups import same_solid
from partwright.superfrusta.feature_steps import Feature, FeatureTree
from partwright.superfrusta.feature_unions import with_plainest

if TYPE_CHECKING:
    from partwright.superfrusta.feature_search import FeatureSearch

Floats = NDArray[np.float64]

_SAME = 3e-3  # unit lengths: how far solids may differ that were drawn as one
_LOSS = 1e-3  # of R, that copies may cost, all together
_UNTURNED = 1e-9  # of a rotation's entries

_TURNS = [turn for turn in signed_permutations() if np.linalg.det(turn) > 0]


def with_repeats(search: FeatureSearch, tree: FeatureTree) -> FeatureTree:
    """The tree with one feature, and further copies of it, for two that are the same solid elsewhere, where
    that hardly explains the shape worse and is no further off."""
    return with_plainest(search, tree, partial(_repeated, search), _LOSS)


def _repeated(search: FeatureSearch, one: Feature, other: Feature) -> Iterator[Feature]:
    """Each of the two with copies in the places of the other's."""
    for first, second in ((one, other), (other, one)):
        if first.freeform or second.freeform or first.image is not None:
            continue
        copies = [copy for part in second.parts for copy in part.copies]
        ways = [list(_moves(first.part, copy)) for copy in copies]
        if all(ways):
            # What is as well turned over may have its open end on the other side then.
            moves = (nearest_first(search, replace(first.part, instances=()), own, {})[0] for own in ways)
            part = replace(first.part, instances=(*first.part.instances, *moves))
            yield replace(first, part=part)


def _moves(part: Part, copy: Part) -> Iterator[Similarity]:
    """That take the first of a part's copies to a solid, those of the least turn first."""
    if part.field.kind != copy.field.kind:
        return
    part = replace(part, instances=())
    frame, its = rotation_matrix(part.rotation), rotation_matrix(copy.rotation)
    (low, high), (its_low, its_high) = part.field.bounds(), copy.field.bounds()
    middle = part.translation + frame @ (low + high) / 2
    target = copy.translation + its @ (its_low + its_high) / 2
    fitting = (t for t in _TURNS if np.abs(np.abs(t) @ (high - low) - (its_high - its_low)).max() < 2 * _SAME)
    for turn in sorted((its @ t @ frame.T for t in fitting), key=lambda turn: -float(np.trace(turn))):
        move = _about(turn, middle, target)
        if same_solid(part.transformed(move), copy, _SAME):
            yield move


def _about(turn: Floats, start: Floats, end: Floats) -> Similarity:
    """The rigid move of a rotation (3, 3) that takes one point (3,) to another; a shift where it is none."""
    if np.abs(turn - np.eye(3)).max() < _UNTURNED:
        turn = np.eye(3)
    return Similarity.from_linear(turn, end - turn @ start)
