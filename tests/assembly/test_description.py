"""The printed tree names every leaf, with the numbers that make it."""

from __future__ import annotations

from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Cylinder, Quadric


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
            "└─ - pin: cylinder radius 0.3333, height 2 at (0, 1, 0), 2 copies",
        ]
    )
