"""Parts are called after what they are for, the base first; the solid stays."""

from __future__ import annotations

import numpy as np

from partwright.approximation.part_roles import with_role_names
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cone, Cylinder, Quadric, Sphere


def test_a_flanged_plate_reads_as_one() -> None:
    hole = Part(
        Cylinder(2, 8), (15, 0, 0), name="quadric_07", instances=(Similarity(translation=(-30, 0, 0)),)
    )
    pocket = Part(Box((8, 8, 3)), (0, 0, 2), name="convex_03")
    plate = Assembly(
        (Part(Box((40, 20, 5)), name="convex_01"), hole, pocket), "difference", name="convex_01_cut"
    )
    boss = Assembly(
        (
            Part(Cylinder(6, 12), (0, 0, 8), name="convex_02"),
            Part(Cylinder(4, 30), (0, 0, 8), name="quadric_08"),
            Part(Cone(5, 3), (0, 0, 13), (0, 1, 0, 0), name="quadric_09"),
        ),
        "difference",
    )
    before = Assembly((Part(Sphere(1), (0, 0, 20), name="convex_04"), boss, plate), unit="mm", name="part")
    after = with_role_names(before)
    names = ["base_plate", "hole", "pocket", "boss", "bore", "countersink", "ball"]
    assert [part.name for part in after.parts] == names
    assert [child.name for child in after.children] == ["base_plate_cut", "boss_cut", "ball"]
    assert (after.unit, after.name) == ("mm", "part")
    points = np.random.default_rng(0).uniform(-25, 25, (5000, 3))
    np.testing.assert_array_equal(after.distance(points) < 0, before.distance(points) < 0)


def test_what_stands_in_a_cut_is_an_island_and_quadrics_keep_their_names() -> None:
    ring = Assembly(
        (Part(Box((10, 10, 4)), (0, 0, 2), name="a"), Part(Cylinder(2, 9), name="b")), "difference"
    )
    lump = Part(Quadric.ellipsoid((1, 2, 3)), (0, 0, 5), name="quadric_40")
    body = Part(Box((20, 20, 6)), name="c")
    after = with_role_names(Assembly((body, ring, lump), "difference"))
    assert [part.name for part in after.parts] == ["base_block", "pocket", "island", "quadric_40"]


def test_a_blind_hole_ends_within() -> None:
    body = Part(Cylinder(10, 30), name="x")
    cuts = (Part(Cylinder(2, 20), (0, 0, 10), name="y"), Part(Cylinder(12, 1), (0, 0, 0), name="z"))
    after = with_role_names(Assembly((body, *cuts), "difference"))
    assert [part.name for part in after.parts][:2] == ["base_cylinder", "blind_hole"]
