"""A part that a body may be made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from manifold3d import Manifold

from partwright.assembly import Part
from partwright.fields.rims import Rim

_T = TypeVar("_T")
_CHORDS = 4e-3  # unit lengths


@dataclass(frozen=True)
class Candidate:
    """A part, and what makes the same body with the mesh's own walls, chords and all.

    make: the body, further out by a length where its walls are not the mesh's own. sides: of its profile, as
    that is drawn (`drawn_corners`). volume, rims: tell candidates apart. cuts: parts that are cut from it and
    belong to it, holes with sharp edges in a body with round ones; all else of a tree comes after them.
    usual: whether it is turned from what most half sections have in common, and not all, nor any.
    beyond: whether it goes further than what it is a candidate of: it can be cut where that lies open.
    """

    part: Part
    make: Callable[[float], Manifold]
    sides: int
    volume: float
    rims: tuple[Rim, ...] = ()
    cuts: tuple[Part, ...] = ()
    usual: bool = False
    beyond: bool = False

    @cached_property
    def bodies(self) -> tuple[Manifold, Manifold]:
        """Within the part's surface and around it, by as little as chords are off it."""
        return self.make(-_CHORDS), self.make(_CHORDS)

    @cached_property
    def key(self) -> tuple[float, ...]:
        """The same for candidates that are the same."""
        depths = [rim.depth for rim in self.rims]
        return tuple(
            np.round([*self.part.bounds().ravel(), self.volume, *depths, len(self.cuts)], 3).tolist()
        )


class AskedOnce(Generic[_T]):
    """A question to candidates, which each is asked but once."""

    def __init__(self, question: Callable[[Candidate], _T]) -> None:
        self._question = question
        self._answers: dict[int, tuple[Candidate, _T]] = {}  # kept with them, or another might get its number

    def __call__(self, candidate: Candidate) -> _T:
        known = self._answers.get(id(candidate))
        if known is None:
            known = self._answers[id(candidate)] = candidate, self._question(candidate)
        return known[1]


def posed(body: Manifold, frame: np.ndarray) -> Manifold:
    """A body of a view, where it belongs."""
    return body.transform(np.column_stack([frame, np.zeros(3)]))
