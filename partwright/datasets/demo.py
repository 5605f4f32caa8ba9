"""The shape that ships with the project: a watering can, hollow, tapered and bent, in centimetres with Z up.

`python -m partwright.datasets.demo FILE.ply` writes it. It is one closed surface, cut and joined exactly.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from partwright.datasets.making import AROUND, ring, to_mesh, write_ply

if TYPE_CHECKING:
    import manifold3d
    import trimesh

_WALL = 0.7


def watering_can() -> trimesh.Trimesh:
    """A can 17 cm high: tapered hollow body with a rolled rim, half a lid, a spout with a rose, a handle."""
    return to_mesh(_can())


def write(path: str | Path) -> None:
    """Write the watering can as binary PLY."""
    write_ply(watering_can(), path)


def _can() -> manifold3d.Manifold:
    from manifold3d import Manifold

    height, bottom, top = 16.0, 8.5, 6.5
    body = Manifold.cylinder(height, bottom, top, AROUND)
    cavity = Manifold.cylinder(height + 1, bottom - _WALL, top - _WALL, AROUND).translate((0, 0, _WALL))
    rim = ring(top, 0.6, 360).translate((0, 0, height))
    foot = ring(bottom, 0.5, 360).translate((0, 0, 0.5))
    lid = Manifold.cylinder(_WALL, top, top, AROUND).translate((0, 0, height - _WALL))
    half_lid = lid.trim_by_plane((1.0, 0.0, 0.0), 0.5)

    start, angle, length = (6.2, 0.0, 4.0), 44.0, 16.5
    spout = _leaning(Manifold.cylinder(length, 2.1, 1.1, AROUND), angle, start)
    bore = _leaning(Manifold.cylinder(length + 4, 1.4, 0.55, AROUND).translate((0, 0, -1.2)), angle, start)
    rose = _leaning(Manifold.cylinder(2.2, 1.1, 2.9, AROUND).translate((0, 0, length - 0.3)), angle, start)

    arc = ring(5.6, 0.85, 230).rotate((90, 0, 0)).rotate((0, -40, 0))
    handle = arc.scale((1.0, 1.0, 1.05)).translate((-8.2, 0, 9.0)) - Manifold.cylinder(30, 7.4, 6.2, AROUND)

    outside = body + rim + foot + spout + rose + handle
    return (outside - cavity - bore) + half_lid


def _leaning(
    solid: manifold3d.Manifold, angle: float, place: tuple[float, float, float]
) -> manifold3d.Manifold:
    """Turned from z towards x by `angle` degrees, then moved."""
    return solid.rotate((0, angle, 0)).translate(place)


if __name__ == "__main__":
    write(sys.argv[1])
