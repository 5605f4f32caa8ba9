"""Planes between pieces of a solid, moved: as many pieces of all of it, whose hulls add less."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from partwright.approximation.convex_piece import Piece
from partwright.approximation.piece_boundaries import with_moved_boundaries

RING = Manifold.cylinder(1, 1, 1, 96) - Manifold.cylinder(1, 0.7, 0.7, 96)


def wedges(*angles: float) -> list[Piece]:
    """The ring cut by half planes through its axis, at angles in degrees."""
    found = []
    for start, stop in zip(angles, [*angles[1:], angles[0] + 360], strict=True):
        sides = np.radians([start, stop])
        middle = np.radians((start + stop) / 2)
        normals = np.column_stack([np.sin(sides), -np.cos(sides)]) * (1, 1)
        wedge = RING
        for normal in normals:
            inward = normal if normal @ (np.cos(middle), np.sin(middle)) > 0 else -normal
            wedge = wedge.trim_by_plane((*inward.tolist(), 0.0), 0.0)
        found.append(Piece(wedge))
    return found


def added(pieces: list[Piece]) -> float:
    return sum(piece.extra for piece in pieces)


def test_wedges_of_a_ring_become_alike() -> None:
    """What a wedge adds grows with the third power of its angle."""
    uneven, even = wedges(0, 20, 75, 100, 170, 200, 265, 310), wedges(*range(0, 360, 45))
    moved = with_moved_boundaries(uneven, RING.volume())
    assert len(moved) == len(uneven)
    assert added(moved) < 1.15 * added(even) < 0.85 * added(uneven)
    together = Manifold.batch_boolean([piece.solid for piece in moved], OpType.Add)
    assert together.volume() == pytest.approx(RING.volume(), rel=1e-9)
    assert sum(piece.solid.volume() for piece in moved) == pytest.approx(RING.volume(), rel=1e-9)


def test_pieces_that_add_nothing_or_do_not_touch_stay() -> None:
    boxes = [Piece(Manifold.cube((1, 1, 1)).translate((x, 0, 0))) for x in (0, 1, 3)]
    assert with_moved_boundaries(boxes, 3.0) == boxes
    apart = [wedges(0, 90, 180, 270)[i] for i in (0, 2)]
    assert with_moved_boundaries(apart, RING.volume()) == apart
