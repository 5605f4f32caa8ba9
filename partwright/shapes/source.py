"""What a file or an object in memory holds, before any repair: the form that every reader returns."""

from __future__ import annotations

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
    the file's name with its suffix, None for what was in memory.
    """

    name: str
    pieces: tuple[Piece, ...]
    unit: str | None = None
    up: str | None = None
    repairs: tuple[str, ...] = ()
    confidence: float = 1.0
    file: str | None = None
