"""Convex pieces of differences and intersections."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.approximation.decomposition import convex_pieces, separated
from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.errors import NoSurfaceError
from partwright.export import export
from partwright.fields import Box, Cylinder, Quadric, Sphere, SuperFrustum, Tube
from tests.export.robotics import FLOOR, with_others

BLOCK = Part(Box((1, 1, 0.5)), name="block")


def minus(*nodes: Node) -> Assembly:
    return Assembly(nodes, "difference")


def checked(node: Node, allowed: float = 0.05) -> float:
    """Volume of the pieces over the node's, each of them convex, and none of them reaching into a hole by
    more than the chords of curved faces."""
    from partwright.meshing import mesh_assembly

    pieces = convex_pieces(node, allowed)
    for piece in pieces:
        assert piece.is_watertight
        assert piece.volume == pytest.approx(piece.convex_hull.volume, rel=1e-6)
        inner = 0.98 * (piece.vertices - piece.center_mass) + piece.center_mass
        assert node.distance(inner).max() < 0.1 * allowed
    whole = node if isinstance(node, Assembly) else Assembly((node,))
    return sum(piece.volume for piece in pieces) / mesh_assembly(whole, 96).volume


def test_a_drilled_block_keeps_its_hole() -> None:
    node = minus(BLOCK, Part(Cylinder(0.3, 1)))
    assert 0.9 < checked(node) < 1.001
    assert 4 <= len(convex_pieces(node, 0.05)) <= 10
    assert 0.98 < checked(node, allowed=0.005) < 1.001


def test_square_holes_are_exact() -> None:
    node = minus(BLOCK, Part(Box((0.4, 0.4, 2)), (0.1, 0, 0)), Part(Box((2, 0.2, 0.3)), (0, 0, 0.25)))
    assert checked(node) == pytest.approx(1, abs=1e-5)


@settings(max_examples=20)
@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(0.12, 0.3), st.floats(0.0, 1.5))
def test_any_hole(x: float, y: float, radius: float, turn: float) -> None:
    hole = Part(Cylinder(radius, 3), (x, y, 0), (np.cos(turn / 2), np.sin(turn / 2), 0, 0))
    assert 0.85 < checked(minus(BLOCK, hole), 0.02) < 1.001


def test_small_holes_are_filled_and_wide_ones_are_not() -> None:
    node = minus(BLOCK, Part(Cylinder(0.02, 1)))
    assert len(convex_pieces(node, 0.05)) == 1
    assert len(convex_pieces(node, 0.03)) > 1


def test_a_hollow_cutter_and_copies() -> None:
    """A ring groove leaves the core that it runs around; copies of a hole are holes."""
    groove = Part(Tube(0.3, 0.1, 0.3), (0, 0, 0.25))
    assert 0.9 < checked(minus(BLOCK, groove), 0.02) < 1.02
    holes = Part(Box((0.2, 0.2, 2)), (-0.3, 0, 0), instances=(Similarity(translation=(0.6, 0, 0)),))
    assert checked(minus(BLOCK, holes), 0.02) == pytest.approx(1, abs=1e-5)


def test_endless_quadrics() -> None:
    """The outside of a convex quadric, in an intersection or subtracted."""
    ball = Part(Quadric((1, 1, 1, 0, 0, 0, -0.25, 0, 0, 0)))
    slab = [Part(Quadric((0, 0, 0, 0, 0, sign, -0.1, 0, 0, 0))) for sign in (1.0, -1.0)]
    outside = Part(Quadric((-1, -1, 0, 0, 0, 0, 0.04, 0, 0, 0)))
    assert 0.85 < checked(Assembly((ball, *slab, outside), "intersection"), 0.03) < 1.001
    inside = Part(Quadric((1, 1, 0, 0, 0, 0, -0.04, 0, 0, 0)))
    assert 0.85 < checked(minus(Assembly((ball, *slab), "intersection"), inside), 0.03) < 1.001
    far = Part(Sphere(50.0))
    trimmed = minus(Assembly((far, *slab), "intersection"), Part(Quadric((0, 0, 0, 1, 0, 0, -49.0, 0, 0, 0))))
    assert 0.95 < checked(trimmed, 0.03) < 1.05  # a crescent, small beside what it is cut from


def test_bodies_without_an_exact_mesh() -> None:
    node = minus(Part(SuperFrustum((1, 1, 1), 0.5)), Part(SuperFrustum((0.5, 0.5, 2), 0.0)))
    assert 0.9 < checked(node) < 1.05


def test_what_no_cutter_reaches_is_left_alone() -> None:
    ball = Part(Sphere(0.2), (2, 0, 0), name="ball")
    node = minus(Assembly((BLOCK, ball)), Part(Cylinder(0.3, 1), name="hole"))
    found = list(separated(node))
    assert [one.name for one in found] == ["block", "ball"]
    assert found[1] == ball
    assert isinstance(found[0], Assembly)
    assert [one.name for one in found[0].parts] == ["block", "hole"]


def test_nothing_left() -> None:
    with pytest.raises(NoSurfaceError):
        convex_pieces(minus(BLOCK, Part(Box((2, 2, 2)))), 0.05)


def test_a_ball_falls_through_a_drilled_plate_but_not_beside(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    plate = minus(Part(Box((1, 1, 0.1)), (0, 0, 0.5)), Part(Cylinder(0.2, 1), (0, 0, 0.5)))
    path = tmp_path / "a.mjcf"
    export(Assembly((plate,), unit="m", up="z"), path)
    balls = "".join(
        f'<body pos="{x} 0 0.8"><freejoint/><geom type="sphere" size="0.15"/></body>' for x in (0, 0.36)
    )
    loaded = with_others(path, FLOOR + balls)
    data = mujoco.MjData(loaded)
    for _ in range(300):
        mujoco.mj_step(loaded, data)
    assert data.qpos[2] < 0.2
    assert data.qpos[9] > 0.2
