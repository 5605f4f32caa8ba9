"""Round holes of a mesh are found by their walls, and nothing else is taken for one."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold

from partwright.approximation.sketches.round_holes import RoundHole, round_holes
from partwright.meshing.manifolds import surface_of

PLATE = Manifold.cube((1.6, 1.0, 0.1), center=True)


def hole(radius: float, sides: int = 24) -> Manifold:
    return Manifold.cylinder(0.4, radius, radius, sides, center=True)


def found(body: Manifold) -> list[RoundHole]:
    return round_holes(*surface_of(body))


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (20.0, 35.0, 10.0)])
def test_each_size_and_place_is_found_however_small(turn: tuple[float, float, float]) -> None:
    body = PLATE - hole(0.2) - hole(0.01, 12).translate((0.5, 0.3, 0))
    wide, small = found(body.rotate(turn))
    assert wide.radius == pytest.approx(0.2, rel=1e-5)
    assert small.radius == pytest.approx(0.01, rel=1e-4)
    (place,) = np.asarray(
        surface_of(Manifold.cube((1e-3,) * 3, True).translate((0.5, 0.3, 0)).rotate(turn))[0]
    ).mean(axis=0, keepdims=True)
    assert small.middle == pytest.approx(place, abs=1e-6)
    assert np.linalg.norm(small.end - small.start) == pytest.approx(0.1, rel=1e-5)
    solid = small.part()
    assert float(solid.distance(small.middle[None])[0]) == pytest.approx(-0.01, rel=1e-4)


def test_a_blind_hole_with_a_tip_and_a_counterbore_are_as_deep_as_their_walls() -> None:
    block = Manifold.cube((1, 1, 1), center=True)
    drill = Manifold.cylinder(0.4, 0.1, 0.1, 24) + Manifold.cylinder(0.06, 0.0, 0.1, 24).translate(
        (0, 0, -0.06)
    )
    wide = Manifold.cylinder(0.2, 0.2, 0.2, 32).translate((0, 0, 0.3))
    depths = {
        round(h.radius, 3): np.ptp([h.start[2], h.end[2]])
        for h in found(block - drill.translate((0, 0, 0.1)) - wide)
    }
    assert depths == pytest.approx({0.2: 0.2, 0.1: 0.2}, rel=1e-4)


def test_posts_polygons_and_open_walls_are_none() -> None:
    post = Manifold.cylinder(0.5, 0.2, 0.2, 32)
    assert not found(PLATE + post)
    assert not found(PLATE - hole(0.2, 8))  # an octagon is an octagon
    slot = (
        hole(0.1)
        + hole(0.1).translate((0.3, 0, 0))
        + Manifold.cube((0.3, 0.2, 0.4), True).translate((0.15, 0, 0))
    )
    assert not found(PLATE - slot)
    assert not found(PLATE - hole(0.2).translate((0, 0.5, 0)))  # half of it lies in the open


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (20.0, 35.0, 10.0)])
def test_a_cone_at_a_holes_end_is_its_mouth(turn: tuple[float, float, float]) -> None:
    """A countersink of 90 degrees above and a steep one below; none of a drill's tip."""
    sink = Manifold.cylinder(0.03, 0.05, 0.08, 24).translate((0, 0, 0.02))
    steep = Manifold.cylinder(0.02, 0.06, 0.05, 24).translate((0, 0, -0.05))
    tip = Manifold.cylinder(0.03, 0.0, 0.04, 24) + Manifold.cylinder(0.1, 0.04, 0.04, 24).translate(
        (0, 0, 0.03)
    )
    body = PLATE - hole(0.05) - sink - steep - tip.translate((0.5, 0, -0.03))
    both, blind = found(body.rotate(turn))
    assert blind.mouths == (None, None)
    depths = [mouth and (mouth.radius, mouth.depth) for mouth in both.mouths]
    assert sorted(depths) == [pytest.approx((0.06, 0.02), rel=1e-3), pytest.approx((0.08, 0.03), rel=1e-3)]
