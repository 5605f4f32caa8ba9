"""Parts are called after what they are for, the base first; the solid stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from partwright.approximation.part_roles import with_role_names
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cone, Cylinder, Extrusion, Profile, Quadric, Revolution, Sphere, Tube


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
    names = ["base_plate", "bolt_hole", "pocket", "boss", "bore", "countersink", "ball"]
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
    cuts = (Part(Cylinder(2, 18), (0, 0, 11), name="y"), Part(Cylinder(12, 1), (0, 0, 0), name="z"))
    after = with_role_names(Assembly((body, *cuts), "difference"))
    assert [part.name for part in after.parts][:2] == ["base_cylinder", "blind_hole"]


def test_a_hole_that_ends_in_a_pocket_goes_through_its_floor_and_the_pocket_does_not() -> None:
    """But not one that ends at the pocket's rim, half in it."""
    body = Part(Box((40, 20, 10)))
    pocket = Part(Box((16, 12, 6)), (0, 0, 4))  # down to z = 1
    holes = [Part(Cylinder(2, 8), (x, 0, -2)) for x in (0, 8)]  # up to z = 2
    cuts = (pocket, *holes, Part(Cylinder(7, 2), (-12, 0, 4.5)))
    after = with_role_names(Assembly((body, *cuts), "difference"))
    assert [part.name for part in after.parts] == [
        "base_block",
        "pocket",
        "hole",
        "blind_hole",
        "blind_hole_02",
    ]


def test_holes_are_called_after_how_they_are_made() -> None:
    through = Profile([(0, -5), (2, -5), (2, 3), (4, 3), (4, 8), (0, 8)])
    sunk = Profile([(0, -5), (2, -5), (2, 1), (4, 3), (4, 8), (0, 8)])
    broken = Profile([(0, -5), (2, -5), (2, 2.5), (2.5, 3), (2.5, 8), (0, 8)])
    stepped = Profile([(0, -5), (2, -5), (2, 1), (3, 1), (3, 2.5), (3.5, 3), (3.5, 8), (0, 8)])
    drilled = Profile([(0, 0), (2, 1), (2, 8), (0, 8)])
    slot = Profile([(-3, -1, 0), (3, -1, 1), (3, 1, 0), (-3, 1, 1)])
    ring = Profile([(5, 2), (6, 2), (6, 8), (5, 8)])
    moved = (Similarity(translation=(8, 0, 0)),)
    cuts = (
        Part(Revolution(through), name="a"),
        Part(Revolution(sunk), (10, 0, 0), name="b"),
        Part(Revolution(drilled), (0, 10, 0), name="c"),
        Part(Revolution(broken), (10, -10, 0), name="g"),
        Part(Revolution(stepped), (0, -10, 0), name="h"),
        Part(Extrusion(slot, 20), (10, 10, 0), name="d"),
        Part(Revolution(ring), (-10, -10, 0), name="e"),
        Part(Cylinder(1, 20), (-12, 10, 0), name="f", instances=moved),
    )
    after = with_role_names(Assembly((Part(Box((40, 40, 6)), name="x"), *cuts), "difference"))
    names = ["counterbored_hole", "countersunk_hole", "blind_hole", "chamfered_hole"]
    names += ["counterbored_hole_02", "slot", "groove", "bolt_hole"]
    assert [part.name for part in after.parts] == ["base_plate", *names]


def test_what_is_round_is_called_so_whatever_it_is_drawn_as() -> None:
    """A ring, a shaft with chamfers, a pin with a hole of six sides, a chamfered hole."""
    round_ = [(-4, 0, 1), (4, 0, 1)]
    nut = Profile(round_, [Profile.regular(6, 2).outline])
    added = (
        Part(Box((90, 90, 4)), name="a"),
        Part(Tube(8, 2, 20), (0, 0, 10), name="b"),
        Part(Tube(8, 2, 3), (25, 0, 3), name="c"),
        Part(Extrusion(nut, 10), (-25, 0, 5), name="d"),
        Part(Extrusion(Profile(round_), 30, bottom_chamfer=0.5, top_chamfer=0.5), (0, 25, 15), name="e"),
    )
    hole = Part(Extrusion(Profile(round_), 9, top_chamfer=0.5), (-25, -25, 0), name="f")
    after = with_role_names(Assembly((Assembly(added), hole), "difference"))
    names = {before: now.name for before, now in zip("abecdf", after.parts, strict=True)}
    assert names == {"a": "base_plate", "b": "boss", "c": "disc", "d": "boss_02", "e": "shaft", "f": "hole"}


def test_an_arch_along_an_edge_is_no_hole_until_it_goes_half_around() -> None:
    body = Part(Box((40, 40, 6)), name="x")
    profile = Profile([(0, -5), (2, -5), (2, 1), (4, 1), (4, 8), (0, 8)])
    sunk = Profile([(0, -5), (2, -5), (2, 1), (4, 3), (4, 8), (0, 8)])
    for field in (Cylinder(4, 20), Revolution(profile), Revolution(sunk)):
        near, far = (Part(field, (x, 0, 0), name="y") for x in (18, 22))
        (_, hole), (_, arch) = (with_role_names(Assembly((body, p), "difference")).parts for p in (near, far))
        assert hole.name.endswith("hole")
        assert arch.name == "opening"
    cone = Part(Cone(4, 4), (22, 0, 2), (0, 1, 0, 0), name="z")
    assert with_role_names(Assembly((body, cone), "difference")).parts[1].name == "pocket"


def test_what_stands_around_an_axis_is_teeth_and_holes_in_it_are_not() -> None:
    def ring(part: Part, count: int) -> Part:
        turns = (Similarity.turn((0, 0, 1), 2 * np.pi * k / count) for k in range(1, count))
        return replace(part, instances=tuple(turns))

    wheel = Part(Cylinder(20, 5), name="a")
    cuts = (
        ring(Part(Box((4, 2, 9)), (20, 0, 0), name="b"), 16),
        ring(Part(Cylinder(1, 9), (15, 0, 0), name="c"), 16),
    )
    after = with_role_names(Assembly((wheel, *cuts), "difference"))
    assert [part.name for part in after.parts] == ["base_cylinder", "tooth_gap", "bolt_hole"]
    groove = Part(Cylinder(1, 9), (20, 0, 0), name="d")
    shifts = (Similarity(translation=tuple(m([20, 0, 0]) - [20, 0, 0])) for m in ring(groove, 12).instances)
    after = with_role_names(Assembly((wheel, replace(groove, instances=tuple(shifts))), "difference"))
    assert after.parts[1].name == "tooth_gap"
    blades = ring(Part(Box((20, 1, 3)), (28, 0, 0), name="e"), 8)
    teeth = ring(Part(Box((4, 3, 5)), (20, 0, 0), name="f"), 20)
    after = with_role_names(Assembly((wheel, blades, teeth)))
    assert {part.name for part in after.parts} == {"blade", "tooth", "base_cylinder"}
    inner = ring(Part(Box((4, 2, 9)), (11, 0, 0), name="g"), 16)
    after = with_role_names(Assembly((wheel, inner, Part(Cylinder(10, 9), name="h")), "difference"))
    assert [part.name for part in after.parts] == ["base_cylinder", "tooth_gap", "hole"]
    fan = Assembly((wheel, ring(blades.copies[0], 5), ring(teeth.copies[0], 5)))
    assert {part.name for part in with_role_names(fan).parts} == {"blade", "block", "base_cylinder"}


def test_thin_walls_in_a_row_are_fins() -> None:
    def row(count: int, *step: float) -> Assembly:
        moves = (Similarity(translation=tuple(k * s for s in step)) for k in range(1, count))
        fin = Part(Box((2, 40, 20)), (-20, 0, 12), name="a", instances=tuple(moves))
        return with_role_names(Assembly((Part(Box((60, 60, 6))), fin)))

    names = [row(count, *step).parts[-1].name for count, *step in ((5, 9, 0, 0), (3, 9, 0, 0), (5, 0, 50, 0))]
    assert names == ["fin", "plate", "plate"]


def test_boards_slats_and_washers_in_a_row_are_no_fins() -> None:
    def row(part: Part, *step: float) -> Part:
        moves = (Similarity(translation=tuple(k * s for s in step)) for k in range(1, 6))
        return replace(part, instances=tuple(moves))

    def names(*parts: Part) -> list[str]:
        return sorted(part.name for part in with_role_names(Assembly(parts)).parts)

    sides = Part(Box((4, 30, 180)), name="a", instances=(Similarity(translation=(84, 0, 0)),))
    boards = row(Part(Box((80, 30, 2)), (42, 0, -80), name="b"), 0, 0, 30)
    back = Part(Box((80, 2, 180)), (42, 15, 0), name="c")
    assert names(sides, boards) == ["base_plate", "plate"]
    assert names(sides, boards, back) == ["base_plate", "plate", "plate_02"]
    assert names(boards, back) == ["base_plate", "fin"]  # as of a heat sink that hangs on a wall
    rail = Part(Box((200, 10, 10)), (90, 0, -5.5), name="d")
    assert names(rail, row(Part(Box((20, 80, 2)), name="e"), 30, 0, 0)) == ["base_bar", "plate"]
    ring = Profile([(-8, 0, 1), (8, 0, 1)], [[(-3, 0, 1), (3, 0, 1)]])
    washers = row(Part(Extrusion(ring, 2), name="f"), 0, 0, 4)
    assert names(washers, Part(Cylinder(3.01, 60), name="g")) == ["base_cylinder", "disc"]
    assert names(washers, Part(Box((6, 16, 60)), (10, 0, 0), name="h")) == ["base_bar", "disc"]
    bulkiest = row(Part(Box((80, 100, 8)), (42, -35, -80), name="b"), 0, 0, 30)
    assert names(bulkiest, back) == ["base_plate", "plate"]
