"""Convex solids within ones that are not."""

from __future__ import annotations

import pytest
from manifold3d import Manifold, OpType

from partwright.assembly import Part
from partwright.fields import Box, Cylinder
from partwright.meshing.manifolds import surface_of
from partwright.robots.containment import shape_solid
from partwright.robots.inscribed import filled, inscribed
from partwright.robots.inside import largest_together
from partwright.robots.model import Shape
from partwright.robots.shaping import Wishes, shapes_for
from partwright.robots.solids import Target


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


def target(*solids: Manifold) -> Target:
    whole = Manifold.batch_boolean(list(solids), OpType.Add)
    return Target(whole, whole, *surface_of(whole), ())


def native(most: int) -> Wishes:
    return Wishes(0.02, (Box, Cylinder), False, most, 0.08, "within")


def test_four_boxes_of_a_tube_are_as_large_as_can_be() -> None:
    """Of a wall from 2/3 of the radius to the radius the largest box of a quarter has .114."""
    tube = target(
        Manifold.cylinder(2.7, 1.0, circular_segments=32) - Manifold.cylinder(3, 2 / 3, circular_segments=32)
    )
    found = shapes_for("tube", tube, native(4))
    assert len(found) == 4
    union = Manifold.batch_boolean([shape_solid(shape) for shape in found], OpType.Add)
    assert union.volume() > 0.95 * 4 * 0.114 * tube.solid.volume()
    assert (union - tube.solid).volume() < 1e-6 * union.volume()


def test_few_shapes_within_are_the_best_of_many() -> None:
    """A palm with two fingers that are bent inwards: of an L, that is one of few pieces, a box loses most."""
    bars = [((4, 1, 1), (0, 0, 0)), ((0.6, 1, 3), (0, 0, 0)), ((0.6, 1, 3), (3.4, 0, 0))]
    tips = [((1.2, 1, 0.4), (0, 0, 2.6)), ((1.2, 1, 0.4), (2.8, 0, 2.6))]
    grip = target(*(Manifold.cube(size).translate(at) for size, at in bars + tips))
    found = shapes_for("grip", grip, native(3))
    assert len(found) == 3
    union = Manifold.batch_boolean([shape_solid(shape) for shape in found], OpType.Add)
    assert union.volume() > 0.8 * grip.solid.volume()  # all but the tips are .93
    assert (union - grip.solid).volume() < 1e-6 * union.volume()


def test_what_adds_most_to_what_is_taken_comes_next() -> None:
    boxes = [Shape(name, Part(Box(size))) for name, size in (("a", (2, 2, 2)), ("b", (2.2, 1, 1)))]
    boxes += [Shape("c", Part(Box((1, 1, 1)), (5, 0, 0))), Shape("d", Part(Box((2, 2, 1.9)), (0.01, 0, 0)))]
    assert [shape.name for shape in largest_together(boxes, 2)] == ["a", "c"]
    assert [shape.name for shape in largest_together(boxes, 1)] == ["a"]
    assert largest_together(boxes, 4) == boxes
