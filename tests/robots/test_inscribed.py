"""Convex solids within ones that are not."""

from __future__ import annotations

import pytest
from manifold3d import Manifold, OpType

from partwright.robots.inscribed import filled, inscribed


def test_a_convex_solid_is_its_own() -> None:
    box = Manifold.cube((3, 2, 1), True)
    assert inscribed(box.hull(), box).volume() == pytest.approx(6.0)


def test_a_plate_with_a_bite_loses_little_more_than_the_bite() -> None:
    """Of a plate of 4 x 2, with a bite of 1 x 1 out of a long side, 4 x 1 is left at best."""
    plate = Manifold.cube((4, 2, 0.2)) - Manifold.cube((1, 1, 1)).translate((1.5, 1.0, -0.5))
    inner = inscribed(plate.hull(), plate)
    assert (inner - plate).volume() < 1e-3 * inner.volume()
    assert inner.volume() > 0.9 * 4 * 1 * 0.2


def test_a_plate_with_a_hole_keeps_one_side_of_it() -> None:
    hole = Manifold.cylinder(1, 0.3, circular_segments=48).translate((3, 1, -0.5))
    ring = Manifold.cube((4, 2, 0.2)) - hole
    inner = inscribed(ring.hull(), ring)
    assert (inner - ring).volume() < 0.01 * inner.volume()
    assert inner.volume() > 0.6 * ring.volume()


def test_what_one_convex_solid_leaves_is_filled_by_more() -> None:
    """Three bars in a U: one hull within has one of them; together all of it, and nothing outside."""
    bars = [((3, 1, 1), (0, 0, 0)), ((1, 3, 1), (0, 0, 0)), ((1, 3, 1), (2, 0, 0))]
    whole = Manifold.batch_boolean([Manifold.cube(size).translate(at) for size, at in bars], OpType.Add)
    first = inscribed(whole.hull(), whole)
    found = filled([first], whole, 16, 0.05)
    union = Manifold.batch_boolean(found, OpType.Add)
    assert first.volume() < 0.6 * whole.volume()
    assert union.volume() > 0.97 * whole.volume()
    assert (union - whole).volume() < 1e-3 * whole.volume()
    assert len(found) <= 8
    assert len(filled([first], whole, 2, 0.01)) == 2
    assert len(filled([first], whole, 8, whole.volume())) == 1
