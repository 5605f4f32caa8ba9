"""What collides in an assembly's stead: pieces of hollow parts, differences and intersections."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.approximation.collision import geometries
from partwright.approximation.separation import _Meetings, separated
from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.export import export
from partwright.export.mjcf import GEOMS
from partwright.fields import Box, Cylinder, HollowBox, Quadric, Sphere, SuperFrustum, Tube
from tests.export.robotics import FLOOR, with_others

BLOCK = Part(Box((1, 1, 0.5)), name="block")


def minus(*nodes: Node) -> Assembly:
    return Assembly(nodes, "difference")


def checked(node: Node, allowed: float = 0.05) -> tuple[int, float]:
    """Pieces that stand for a node, and the volume in one of the two only, over the node's; each of the
    pieces is convex and reaches nowhere further beyond the node than allowed, a share of the longest
    side."""
    from partwright.meshing import mesh_assembly, mesh_part

    whole = node if isinstance(node, Assembly) else Assembly((node,))
    found, changes = geometries(whole, GEOMS, allowed, 24, convex=True)
    length = allowed * float(np.ptp(whole.bounds(), axis=0).max())
    for one in found:
        mesh = one.mesh if one.mesh is not None else mesh_part(one.part, 32)
        assert mesh.volume == pytest.approx(mesh.convex_hull.volume, rel=1e-2)  # facets of round solids
        assert node.distance(mesh.vertices).max() < 1.3 * length
    own = mesh_assembly(whole, 96).volume
    assert sum(one.mesh.volume for one in found if one.mesh is not None) < 1.2 * own
    return len(found), sum(change.volume_error_ratio or 0.0 for change in changes)


def test_a_drilled_block_keeps_its_hole() -> None:
    """A hole of 0.6 in a block of 1: coarse pieces are few, fine ones follow it."""
    node = minus(BLOCK, Part(Cylinder(0.3, 1)))
    few, coarse = checked(node)
    many, fine = checked(node, 0.01)
    assert few <= 8
    assert coarse < 0.08
    assert few < many <= 20
    assert fine < 0.04


def test_a_square_hole_takes_four_pieces() -> None:
    node = minus(BLOCK, Part(Box((0.4, 0.4, 2)), (0.1, 0, 0)))
    found, changes = geometries(Assembly((node,)), GEOMS, 0.05, 24, convex=True)
    assert len(found) == 4
    assert changes[0].volume_error_ratio < 0.02


def test_a_hollow_box_is_four_boxes() -> None:
    part = Part(HollowBox((1, 0.8, 0.5), 0.1), (1, 2, 3), (0.8, 0.2, 0.4, 0.4), name="tray")
    found, changes = geometries(Assembly((part,)), GEOMS, 0.05, 24, convex=True)
    assert [one.part.field.kind for one in found] == ["box"] * 4
    assert changes[0].volume_error_ratio == pytest.approx(0, abs=1e-3)


def test_a_tube_is_as_few_pieces_as_its_wall_asks_for() -> None:
    count, error = checked(Part(Tube(0.5, 0.1, 0.4)))
    assert count <= 12
    assert error < 0.1


def test_a_solid_is_taken_where_its_hull_is_no_nearer() -> None:
    """A rounded box is a box within the tolerance, but its hull is exact."""
    rounded = Part(SuperFrustum((0.7, 0.7, 0.7), 0.5, 0.12))
    found, _ = geometries(Assembly((rounded,)), GEOMS, 0.2, 24, convex=True)
    assert found[0].mesh is not None
    assert len(found) == 1


@settings(max_examples=5, deadline=None)
@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4), st.floats(0.12, 0.3), st.floats(0.0, 1.5))
def test_any_hole(x: float, y: float, radius: float, turn: float) -> None:
    hole = Part(Cylinder(radius, 3), (x, y, 0), (np.cos(turn / 2), np.sin(turn / 2), 0, 0))
    assert checked(minus(BLOCK, hole), 0.03)[1] < 0.2


def test_small_holes_are_filled_and_wide_ones_are_not() -> None:
    assert checked(minus(BLOCK, Part(Cylinder(0.02, 1))))[0] == 1
    assert checked(minus(BLOCK, Part(Cylinder(0.2, 1))))[0] > 1


def test_a_hollow_cutter_and_copies() -> None:
    """A ring groove leaves the core that it runs around; copies of a hole are holes."""
    groove = Part(Tube(0.3, 0.1, 0.3), (0, 0, 0.25))
    assert checked(minus(BLOCK, groove), 0.03)[1] < 0.1
    holes = Part(Box((0.2, 0.2, 2)), (-0.3, 0, 0), instances=(Similarity(translation=(0.6, 0, 0)),))
    count, error = checked(minus(BLOCK, holes), 0.03)
    assert count <= 7
    assert error < 0.05


def test_endless_quadrics() -> None:
    """The outside of a convex quadric, in an intersection or subtracted."""
    ball = Part(Quadric((1, 1, 1, 0, 0, 0, -0.25, 0, 0, 0)))
    slab = [Part(Quadric((0, 0, 0, 0, 0, sign, -0.1, 0, 0, 0))) for sign in (1.0, -1.0)]
    outside = Part(Quadric((-1, -1, 0, 0, 0, 0, 0.04, 0, 0, 0)))
    assert checked(Assembly((ball, *slab, outside), "intersection"), 0.05)[1] < 0.15
    inside = Part(Quadric((1, 1, 0, 0, 0, 0, -0.04, 0, 0, 0)))
    assert checked(minus(Assembly((ball, *slab), "intersection"), inside), 0.05)[1] < 0.15


def test_bodies_without_an_exact_mesh() -> None:
    node = minus(Part(SuperFrustum((1, 1, 1), 0.5)), Part(SuperFrustum((0.5, 0.5, 2), 0.0)))
    assert checked(node)[1] < 0.1


def test_what_no_cutter_reaches_is_left_alone() -> None:
    ball = Part(Sphere(0.2), (2, 0, 0), name="ball")
    node = minus(Assembly((BLOCK, ball)), Part(Cylinder(0.3, 1), name="hole"))
    found = list(separated(node))
    assert [one.name for one in found] == ["block", "ball"]
    assert found[1] == ball
    assert isinstance(found[0], Assembly)
    assert [one.name for one in found[0].parts] == ["block", "hole"]


@pytest.mark.parametrize("apart", [0.3, 0.9, 1.0, 1.1, 1.3])
def test_what_meets_by_distance_meets_as_solids(apart: float) -> None:
    """Or is left to the solids, where they are near to each other."""
    rng = np.random.default_rng(0)
    for turn, way in rng.normal(size=(6, 2, 4)):
        rotation = tuple((turn / np.linalg.norm(turn)).tolist())
        place = tuple((apart * way[:3] / np.linalg.norm(way[:3])).tolist())
        one = Part(SuperFrustum((1, 0.8, 1.2), 0.4, taper=0.7), rotation=rotation)
        other = Part(SuperFrustum((0.9, 0.9, 0.9), 0.9, bulge=0.3), place)
        meetings = _Meetings()
        first, second = meetings.solid(one), meetings.solid(other)
        assert first is not None
        assert second is not None
        assert meetings.of(one, other) == ((first ^ second).volume() > 0)
        quick = _Meetings()
        quick.of(one, other)
        assert bool(quick.known) <= (apart > 0.3)  # deep within each other, neither is meshed


def test_nothing_left() -> None:
    whole = Assembly((minus(BLOCK, Part(Box((2, 2, 2)))), Part(Sphere(0.1), (3, 0, 0), name="ball")))
    found, changes = geometries(whole, GEOMS, 0.05, 24, convex=True)
    assert [one.name for one in found] == ["ball"]
    assert changes[0].to == "nothing"


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
