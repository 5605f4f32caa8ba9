"""The printed tree names every leaf, with the numbers that make it."""

from __future__ import annotations

import dataclasses

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.instance_patterns import Circle, Grid, with_pattern
from partwright.fields import Cylinder, Pipe, Profile, Quadric, Revolution


def test_the_tree_is_readable() -> None:
    convex = Assembly(
        (
            Part(Quadric.plane((0, 0, 1), 2), name="top"),
            Part(Quadric.cylinder(0.5, point=(1, 0, 0)).complement(), name="bore"),
            Part(Quadric.cone(0.25), (0, 0, 3), name="taper"),
        ),
        "intersection",
        name="convex",
    )
    pin = Part(Cylinder(1 / 3, 2), (0, 1, 0), name="pin", instances=(Similarity(translation=(1, 0, 0)),))
    assert (convex - pin).describe() == "\n".join(
        [
            "difference",
            "├─ intersection convex",
            "│  ├─ top: plane (0, 0, 1) . p <= 2",
            "│  ├─ bore: outside of cylinder radius 0.5, centre (1, 0, 0), axis (0, 0, 1)",
            "│  └─ taper: cone slope 0.25, centre (0, 0, 3), axis (0, 0, 1)",
            "└─ - pin: cylinder radius 0.3333, height 2 at (0, 1, 0), 2 copies, 1 apart",
        ]
    )


def test_copies_are_described_by_the_numbers_of_their_pattern() -> None:
    hole = with_pattern(Part(Cylinder(1, 2), name="hole"), Circle(6, 34, 30, (0, 0, 5)))
    assert hole.describe().endswith(", 6 copies on a circle of 34 about (0, 0, 5)")
    post = with_pattern(Part(Cylinder(1, 2), name="post"), Grid((3, 2, 1), (20, 36, 0), (0, 0, 0)))
    assert post.describe().endswith(", 3 x 2 copies, 20 x 36 apart")
    assert dataclasses.replace(post, instances=post.instances[:-1]).describe().endswith(", 5 copies")


def test_profiles_are_described_by_the_numbers_that_can_be_set() -> None:
    outline = [(5, 0), (30, 0), (30, 8), (9, 8), (9, 20), (5, 20)]
    hub = Part(Revolution(Profile.polygon(outline)), name="hub")
    assert "lines and 0 arcs, profile.diameter (10, 18, 60), profile.y (0, 8, 20), angle" in hub.describe()
    comb = [(x, y) for x in range(1, 9) for y in ((0, x), (x, 0))[x % 2]]
    many = Part(Revolution(Profile.polygon([(0, -1), (9, -1), *comb[::-1], (0, 0)])), name="many")
    assert "profile.diameter of 9 numbers, " in many.describe()


def test_a_pipe_is_described_by_its_corners_and_bends() -> None:
    pipe = Pipe(((0, 0, 0), (30, 0, 0, 10), (30, 20, 0, 8), (30, 20, 30)), 3)
    text = Assembly((Part(pipe, name="pipe"),)).describe()
    assert "path (0, 0, 0) to (30, 0, 0) bend 10 to (30, 20, 0) bend 8 to (30, 20, 30), radius 3" in text
    long = Pipe(tuple((10.0 * k, 0, 0) for k in range(20)), 1)
    assert "path of 20 corners" in Assembly((Part(long),)).describe()
