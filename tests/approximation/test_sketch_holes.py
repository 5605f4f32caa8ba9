"""Holes come apart from what they are in, and those that belong together are one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from partwright.approximation.sketches.holes import holes_apart, is_empty, merged_holes
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Tube
from partwright.fields.profile import Profile, circle


def test_round_holes_come_apart_by_size() -> None:
    holes = [
        circle(0.1, (-0.5, 0)),
        circle(0.1, (0.5, 0)),
        circle(0.2),
        Profile.regular(6, 0.1).moved((0, 0.3)).outline,
    ]
    profile = Profile(Profile.rectangle(1.6, 1.0).outline, tuple(holes))
    turned = Similarity(rotation=(math.cos(0.3), 0.0, math.sin(0.3), 0.0), translation=(0.1, 0.2, 0.3))
    plate = Part(Extrusion(profile, 0.2), name="plate").transformed(turned)
    body, cuts = holes_apart(plate)
    assert isinstance(body.field, Extrusion)
    assert len(body.field.profile.holes) == 1
    assert sorted((round(cut.field.radius, 9), len(cut.copies)) for cut in cuts) == [(0.1, 2), (0.2, 1)]
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    inside = body.distance(points) < 0
    for cut in cuts:
        inside &= cut.distance(points) > 0
    assert (inside == (plate.distance(points) < 0)).all()


def test_holes_of_one_form_are_drawn_once() -> None:
    slot = Profile([(-0.2, -0.05, 0), (0.2, -0.05, 1), (0.2, 0.05, 0), (-0.2, 0.05, 1)])
    odd = Profile([(-0.1, 0.3), (0.1, 0.3), (0, 0.4)])
    rolled = Profile((*slot.outline[2:], *slot.outline[:2])).moved((0, -0.2))
    holes = (slot.outline, slot.moved((0.1, 0.15)).outline, rolled.outline, odd.outline)
    plate = Part(Extrusion(Profile(Profile.rectangle(1.6, 1.0).outline, holes), 0.2), (0.1, 0, 0))
    body, (cut,) = holes_apart(plate)
    assert [len(loop) for loop in body.field.profile.loops] == [4, 3]
    assert len(cut.copies) == 3
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    inside = (body.distance(points) < 0) & (cut.distance(points) > 0)
    assert (inside == (plate.distance(points) < 0)).all()


def test_a_plate_with_one_round_hole_is_a_box() -> None:
    body, (hole,) = holes_apart(
        Part(Extrusion(Profile(Profile.rectangle(1.0, 0.6).outline, (circle(0.1),)), 0.2))
    )
    assert body.field == Box((1.0, 0.6, 0.2))
    assert hole.field.radius == pytest.approx(0.1)


def test_a_bore_through_two_walls_is_one_and_bolt_holes_are_copies() -> None:
    walls = Part(Box((0.1, 1.0, 1.0)), (-0.4, 0, 0), instances=(Similarity(translation=(0.8, 0, 0)),))
    across = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    bores = [Part(Cylinder(0.2, 0.1), (x, 0, 0), across) for x in (-0.4, 0.4)]
    bolts = [Part(Cylinder(0.05, 0.1), (-0.4, y, 0.3), across) for y in (-0.3, 0.3)]
    tree = Assembly((walls, *bores, *bolts), "difference")
    assert all(is_empty(hole, tree.distance) for hole in (*bores, *bolts))
    assert not is_empty(bores[0], walls.distance)
    bore, bolt = merged_holes([*bores, *bolts], tree.distance)
    assert bore.field.height == pytest.approx(0.9)
    assert bore.translation == pytest.approx((0, 0, 0))
    assert len(bolt.copies) == 2
    assert bolt.field.height == pytest.approx(0.1)
    blocked = (tree | Part(Box((0.1, 1.0, 1.0)))).distance
    assert [len(hole.copies) for hole in merged_holes(bores, blocked)] == [2]
    pairs = [Part(Cylinder(0.05, 0.1), (x, y, 0.3), across) for x in (-0.4, 0.4) for y in (-0.3, 0.3)]
    bolted = Assembly((walls, *pairs), "difference")
    in_the_way = bolted | Part(Box((0.1, 0.5, 1.0)), (0, 0.25, 0))  # of one pair
    assert [len(hole.copies) for hole in merged_holes(pairs, bolted.distance)] == [2]
    assert [len(hole.copies) for hole in merged_holes(pairs, in_the_way.distance)] == [4]


def test_small_holes_of_one_size_are_copies_though_their_chords_differ() -> None:
    """Radii .25 % apart are one where that is less than numbers become plain by, as of small ones."""
    rows = [Part(Cylinder(radius, 0.1), (0, y, 0)) for radius, y in ((0.02370, -0.3), (0.02376, 0.3))]
    (both,) = merged_holes(rows, lambda points: np.ones(len(points)))
    assert len(both.copies) == 2
    wide = [Part(Cylinder(radius, 0.1), (0, y, 0)) for radius, y in ((0.2370, -0.3), (0.2376, 0.3))]
    assert len(merged_holes(wide, lambda points: np.ones(len(points)))) == 2
    holes = (circle(0.02370, (-0.3, 0)), circle(0.02376, (0.3, 0)))
    _, cuts = holes_apart(Part(Extrusion(Profile(Profile.rectangle(1.6, 1.0).outline, holes), 0.2)))
    assert [len(cut.copies) for cut in cuts] == [2]


def test_holes_that_were_turned_copies_of_one_are_one() -> None:
    """Three set screws in a round wall point three ways; four are two bores through it."""
    wall = Part(Tube(0.6, 0.1, 1.0))
    across = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    for count, bores, height in ((3, 3, 0.2), (4, 2, 1.3)):
        turns = tuple(Similarity.turn((0, 0, 1), 2 * math.pi * k / count) for k in range(1, count))
        screw = Part(Cylinder(0.05, 0.2), (0.55, 0.0, 0.1), across, instances=turns)
        (hole,) = merged_holes([screw], Assembly((wall, screw), "difference").distance)
        assert len(hole.copies) == bores
        assert hole.field.height == pytest.approx(height)
        assert {move.rotation for move in hole.instances} <= {move.rotation for move in turns}
