"""Bounds hold all of the inside, exactly where that is known, and are not wasteful."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest
from hypothesis import given, settings

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.bounding_box import bounding_box, moved_boxes
from partwright.fields import Box, Cone, Cylinder, Sphere, SuperFrustum, Torus
from tests.assembly.strategies import ASSEMBLIES, PARTS, SWEPT

TURN = (0.8, 0.2, 0.5, -0.3)


@pytest.mark.parametrize(
    ("field", "half"),
    [
        (Box((1, 2, 3)), (0.5, 1, 1.5)),
        (Cylinder(0.5, 2), (0.5, 0.5, 1)),
        (Cone(0.5, 2), (0.5, 0.5, 1)),
        (Torus(1, 0.25), (1.25, 1.25, 0.25)),
    ],
)
def test_canonical_solids_are_exact(field: object, half: tuple[float, float, float]) -> None:
    bounds = Part(field, (1, 2, 3)).bounds()
    assert np.allclose(bounds, np.array([1, 2, 3]) + np.array([[-1], [1]]) * half, atol=0.005 * 0.25)


def test_a_turned_sphere_and_cylinder_stay_tight() -> None:
    assert np.allclose(Part(Sphere(2.0), rotation=TURN).bounds(), [[-2] * 3, [2] * 3], atol=0.005 * 2)
    quarter = Part(Cylinder(0.5, 2), rotation=(1, 1, 0, 0)).bounds()
    assert np.allclose(quarter, [[-0.5, -1, -0.5], [0.5, 1, 0.5]])
    about_axis = Part(Cylinder(0.5, 2), rotation=(2, 0, 0, 1)).bounds()
    assert np.allclose(about_axis, [[-0.5, -0.5, -1], [0.5, 0.5, 1]])


def test_copies_are_bounded_as_parts_of_their_own() -> None:
    """Also where blends let a union grow with every part that melts into it."""
    turned = Similarity(1.0, TURN, (3.0, 0.5, -1.0))
    leg = Part(Cylinder(0.2, 2), (1, 0, 0), TURN, blend=0.3, instances=(turned, turned @ turned))
    for assembly in (Assembly((leg,)), Assembly((Part(Box((1, 1, 1))), leg)), Assembly((leg, leg))):
        apart = Assembly(tuple(copy for part in assembly.parts for copy in part.copies))
        assert np.allclose(assembly.bounds(), apart.bounds(), atol=1e-12)
    assert np.allclose(leg.bounds(), Assembly(leg.copies).bounds(), atol=1e-12)


def test_boxes_after_moves_are_those_of_the_moved_part() -> None:
    part = Part(SuperFrustum((3, 2, 4), 0.3, 0.1, taper=0.6), (1, 2, 3), (0.9, 0.1, -0.3, 0.2))
    moves = [Similarity(1.0, (1, 0, 0.5 * i, i), (i, -2 * i, 0.5)) for i in range(4)]
    wanted = [part.transformed(move).bounds() for move in moves]
    np.testing.assert_allclose(moved_boxes(part, moves), wanted, atol=1e-12)


def test_a_hundred_thousand_copies_are_bounded_at_once() -> None:
    row = Part(Sphere(0.4), instances=tuple(Similarity(translation=(i, 0, 0)) for i in range(1, 99_000)))
    start = time.process_time()
    assert np.allclose(row.bounds(), [[-0.4] * 3, [98_999.4, 0.4, 0.4]], atol=0.005)
    assert time.process_time() - start < 5.0  # one by one they took half a minute


def test_groups_in_groups_are_bounded_at_once() -> None:
    """Pairs of groups would take pairs of their members, and so on down."""
    rng = np.random.default_rng(0)

    def group(depth: int) -> Part | Assembly:
        if depth == 0:
            field = SuperFrustum(tuple(rng.uniform(0.1, 0.4, 3)), 0.5, 0.05, 0.9, 0.3)
            return Part(field, tuple(rng.uniform(-1, 1, 3)), tuple(rng.normal(size=4)), blend=0.2)
        return Assembly(tuple(group(depth - 1) for _ in range(3)), blend=0.2)

    start = time.process_time()
    assert np.isfinite(group(4).bounds()).all()
    assert time.process_time() - start < 3.0


def test_nothing_lies_outside_of_many_that_melt_together() -> None:
    """Two at one place reach a quarter of their blend farther than either."""
    rng = np.random.default_rng(3)
    for count in (12, 40):
        places = np.repeat(0.5 * rng.normal(size=(count, 3)), 2, axis=0)
        parts = tuple(Part(Sphere(0.2), tuple(place), blend=0.4) for place in places)
        lower, upper = Assembly(parts).bounds()
        points = rng.uniform(lower - 0.3, upper + 0.3, (200_000, 3))
        outside = ((points < lower) | (points > upper)).any(axis=1)
        distance = Assembly(parts).distance(points)
        assert distance[outside].min() > -1e-6
        alone = np.concatenate([part.bounds() for part in parts])
        melted = points[distance < 0]
        assert (melted.min(axis=0) < alone.min(axis=0) - 0.05).all()


def test_half_ring() -> None:
    """bulge 1: an arc of a half circle around (0, 0, 0) with radius sz/2, towards -x."""
    bounds = Part(SuperFrustum((0.2, 0.2, 2.0), roundness=1.0, bulge=1.0)).bounds()
    assert np.allclose(bounds, [[-1.1, -0.1, -1.1], [0.0, 0.1, 1.1]], atol=2e-3)


@settings(max_examples=80)
@given(PARTS | ASSEMBLIES | SWEPT)
def test_nothing_lies_outside(node: Part | Assembly) -> None:
    lower, upper = node.bounds()
    margin = 0.5 * (upper - lower).max() + 0.1
    points = np.random.default_rng(1).uniform(lower - margin, upper + margin, (4000, 3))
    outside = ((points < lower) | (points > upper)).any(axis=1)
    assert node.distance(points[outside]).min() > -1e-4


@settings(max_examples=40)
@given(PARTS)
def test_every_side_is_reached(part: Part) -> None:
    """No face of the box stands further off than a tenth of its longest side.

    Not asked of what holds less than its swept section: hollow parts, and bends tighter than half the width.
    """
    field = part.field.superfrustum()
    if field.onion > 0 or field.size[0] * math.sin(field.bulge * math.pi / 2) > field.size[2]:
        return
    lower, upper = part.bounds()
    points = np.random.default_rng(2).uniform(lower, upper, (20000, 3))
    inside = points[part.distance(points) < 0.02]
    slack = 0.1 * (upper - lower).max() + 0.05
    assert (inside.min(axis=0) - lower < slack).all()
    assert (upper - inside.max(axis=0) < slack).all()


def test_blends_reach_no_further_than_two_parts_that_meet() -> None:
    """Twenty balls that melt into a bar in its middle leave its ends where they are."""
    bar = Part(Box((4, 1, 1)))
    balls = tuple(Part(Sphere(0.4), (0.1 * i - 1.0, 0, 0), blend=0.5) for i in range(20))
    moves = tuple(Similarity(translation=(0.1 * i, 0, 0)) for i in range(1, 20))
    copied = Part(Sphere(0.4), (-1.0, 0, 0), blend=0.5, instances=moves)
    assert np.allclose(Assembly((bar, copied)).bounds()[:, 0], [-2, 2], atol=1e-9)
    assert np.allclose(Assembly((bar, *balls)).bounds()[:, 0], [-2, 2], atol=1e-9)


def test_a_group_far_off_widens_no_blend() -> None:
    bar, ball = Part(Box((4, 1, 1))), Part(Sphere(0.4), blend=0.5)
    holed = Assembly((Part(Box((1, 1, 1))), Part(Cylinder(0.2, 2))), "difference").translated((9, 0, 0))
    lower, upper = Assembly((bar, ball)).bounds()
    assert np.allclose(lower, [-2, *lower[1:]])
    assert np.allclose(Assembly((bar, ball, holed)).bounds(), [lower, [9.5, *upper[1:]]], atol=1e-9)


@settings(max_examples=40)
@given(ASSEMBLIES)
def test_no_wider_than_every_member_by_its_own_blend(node: Assembly) -> None:
    """What twenty members add up to is no reason for a box that is wider than any pair of them can make."""
    if node.operation != "union" or not np.isfinite(node.bounds()).all():
        return
    most = max(child.blend for child in node.children)
    boxes = np.array([bounding_box(child, most) for child in node.children])
    lower, upper = node.bounds()
    assert (lower >= boxes[:, 0].min(axis=0) - 1e-9).all()
    assert (upper <= boxes[:, 1].max(axis=0) + 1e-9).all()
