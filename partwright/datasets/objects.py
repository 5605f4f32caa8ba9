"""Everyday objects that the project makes itself: closed surfaces in centimetres with Z up, front at -y.

`python -m partwright.datasets.objects FOLDER` writes them. They are cut and joined exactly, and come out the
same every time.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from partwright.datasets.making import ball, bar, limb, pebble, plate, ring, rod, to_mesh, write_ply

if TYPE_CHECKING:
    import trimesh
    from manifold3d import Manifold


def table_lamp() -> trimesh.Trimesh:
    """36 cm high: a stem with two beads on a round foot, and an open conical shade on three spokes."""
    foot = rod(1.6, 7.5, 6.9) + rod(1.4, 6.9, 1.6).translate((0, 0, 1.6))
    stem = rod(30, 0.9)
    beads = ball(2.3).translate((0, 0, 6.4)) + ball(1.6).translate((0, 0, 11.4))
    bulb = ball(2.8).translate((0, 0, 26))
    shade = (rod(14, 11, 6.5) - rod(14.02, 10, 5.5).translate((0, 0, -0.01))).translate((0, 0, 21.5))
    spoke = bar(7.9, 0.9, 0.9).translate((3.95, 0, 29.5))
    spokes = spoke + spoke.rotate((0, 0, 120)) + spoke.rotate((0, 0, 240))
    return to_mesh(foot + stem + beads + bulb + shade + spokes)


def chair() -> trimesh.Trimesh:
    """88 cm high: four splayed tapered legs, a soft seat, and a leaning ladder back."""
    leg = rod(47, 1.5, 2.6).translate((0, 0, -47)).rotate((-6, 6, 0)).translate((17, 17, 45))
    leg = leg.trim_by_plane((0, 0, 1), 0)
    side = leg + leg.mirror((0, 1, 0))
    seat = pebble(46, 46, 5, 2.2).translate((0, 0, 46))
    post = rod(40, 1.9, 1.5).translate((17.5, 0, 0))
    slat = bar(36, 2, 4)
    rail = pebble(42, 3.4, 9, 1.6).translate((0, 0, 38))
    back = post + post.mirror((1, 0, 0)) + slat.translate((0, 0, 12)) + slat.translate((0, 0, 24)) + rail
    return to_mesh(side + side.mirror((1, 0, 0)) + seat + back.rotate((-10, 0, 0)).translate((0, 18, 46)))


def mug() -> trimesh.Trimesh:
    """A mug of 0.3 l, hollow, with a rolled rim and a round handle on the right."""
    body = (
        rod(9.5, 3.9, 4.3) + ring(4.12, 0.36).translate((0, 0, 9.5)) + ring(3.75, 0.4).translate((0, 0, 0.4))
    )
    cavity = rod(9.6, 3.45, 3.85).translate((0, 0, 0.6))
    handle = ring(2.6, 0.62).rotate((90, 0, 0)).scale((1, 1, 1.18)).translate((4.7, 0, 4.9))
    return to_mesh((body + handle) - cavity)


def toy_robot() -> trimesh.Trimesh:
    """21 cm high: a soft body with a dial, round eyes, an aerial, bent arms with claws, and block feet."""
    body = pebble(8, 6, 8, 1.0).translate((0, 0, 8.6))
    dial = _forward(rod(0.9, 1.9)).translate((0, -2.8, 9.2)) - _forward(rod(2, 1.2)).translate((0, -3.3, 9.2))
    neck = rod(1.6, 1.3).translate((0, 0, 12.2))
    head = pebble(6.4, 5.2, 4.6, 0.9).translate((0, 0, 15.6))
    eye = _forward(rod(0.8, 0.95)).translate((1.5, -2.4, 16.2))
    ear = rod(0.9, 1.1).rotate((0, 90, 0)).translate((3, 0, 15.6))
    aerial = rod(2.2, 0.3).translate((0, 0, 17.6)) + ball(0.75).translate((0, 0, 20.2))
    shoulder, elbow, wrist = (4.6, 0.0, 11.2), (6.3, 0.2, 8.2), (6.1, -3.4, 7.4)
    arm = ball(1.35).translate(shoulder) + limb(shoulder, elbow, 0.8) + limb(elbow, wrist, 0.8)
    claw = rod(1.5, 1.5) - rod(2, 0.8).translate((0, 0, -0.2)) - bar(1.3, 3, 4).translate((0, -1.5, 0))
    hand = claw.translate((6.1, -4.9, 6.65))
    leg = rod(3, 1.1).translate((2.2, 0, 2.2))
    foot = pebble(3.4, 5.2, 2.4, 0.7).translate((2.2, -0.7, 1.2))
    right = eye + ear + arm + hand + leg + foot
    return to_mesh(body + dial + neck + head + aerial + right + right.mirror((1, 0, 0)))


def bracket() -> trimesh.Trimesh:
    """A shaft bracket 14 cm wide: a base with an eye at either end, a bored boss on a wall, and two ribs."""
    base = plate(8.5, 5.4, 1.2, 0.6)
    eye = rod(1.6, 1.9).translate((5.2, 0, 0))
    hole = rod(9, 0.85).translate((5.2, 0, -1))
    wall = bar(5.2, 1.6, 6).translate((0, 0, 4)) + _forward(rod(1.6, 2.6)).translate((0, 0.8, 7))
    boss = _forward(rod(4.4, 1.9)).translate((0, 2.2, 7))
    bore = _forward(rod(8, 1.15)).translate((0, 4, 7))
    rib = (bar(0.9, 4, 4).rotate((45, 0, 0)) ^ bar(1, 5, 3).translate((0, 0, 1.5))).translate((0, 0, 1.2))
    ribs = rib.translate((1.8, 0, 0)) + rib.translate((-1.8, 0, 0))
    return to_mesh(
        base + eye + eye.mirror((1, 0, 0)) + wall + boss + ribs - hole - hole.mirror((1, 0, 0)) - bore
    )


def _forward(solid: Manifold) -> Manifold:
    """What points up points to the front."""
    return solid.rotate((90, 0, 0))


OBJECTS: dict[str, Callable[[], trimesh.Trimesh]] = {
    "table_lamp": table_lamp,
    "chair": chair,
    "mug": mug,
    "toy_robot": toy_robot,
    "bracket": bracket,
}


def write(folder: str | Path) -> None:
    """Write every object as binary PLY, FOLDER/NAME.ply."""
    for name, make in OBJECTS.items():
        write_ply(make(), Path(folder) / f"{name}.ply")


if __name__ == "__main__":
    write(sys.argv[1])
