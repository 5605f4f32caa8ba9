"""What a file or an object in memory holds, before any repair: the form that every reader returns."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Piece:
    """One named mesh of a file in world coordinates: vertices (V, 3) float64, faces (F, 3) int64."""

    name: str
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]


@dataclass(frozen=True)
class Source:
    """Named pieces, and what the file says of units.

    `repairs` and `confidence`: how the surface was made where the file holds none, and how sure it is. file:
    the file's name with its suffix, None for what was in memory. points: (N, 3) that the surface was laid
    through, where it was. ground: its height along the up axis, own units; None: as low as anything lies.
    thickness: of its sheets, own units, if they are to have one. sealing: whether what is open in many
    places is sealed, where a solid is seen in it.
    """

    name: str
    pieces: tuple[Piece, ...]
    unit: str | None = None
    up: str | None = None
    repairs: tuple[str, ...] = ()
    confidence: float = 1.0
    file: str | None = None
    points: NDArray[np.float64] | None = None
    ground: float | None = None
    thickness: float | None = None
    sealing: bool = True


def in_utf8(name: str) -> str:
    """The name, where bytes that are no UTF-8 (file systems take any) are written as underscores."""
    return "".join("_" if "\ud800" <= c <= "\udfff" else c for c in name)


def unique_names(pieces: Iterator[Piece]) -> Iterator[Piece]:
    """A name that comes again gets a number: wheel, wheel_2, wheel_3."""
    taken: set[str] = set()
    counts: dict[str, int] = {}
    for piece in pieces:
        stem = piece.name or "node"
        name = stem
        while name in taken:
            counts[stem] = counts.get(stem, 1) + 1
            name = f"{stem}_{counts[stem]}"
        taken.add(name)
        yield Piece(name, piece.vertices, piece.faces)
