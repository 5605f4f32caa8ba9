"""Wheels that turn: speeds of the surface, and of the wall of a case that is meshed."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import SettingError, SimulationError
from partwright.fields import Box, Cylinder
from partwright.goals.flow import Air
from partwright.goals.flow.case import write_case
from partwright.goals.flow.dataset import simulate_all
from partwright.goals.flow.wheels import body_faces, surface_speeds, turn_wall
from partwright.goals.surface import surface_of

LYING = (np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0)  # a cylinder's axis along y
CART = Assembly(
    (
        Part(Box((2.0, 0.6, 0.4)), (0.0, 0.0, 0.6), name="body"),
        Part(Cylinder(0.3, 0.3), (0.6, 0.5, 0.3), LYING, name="wheel_front"),
        Part(Cylinder(0.3, 0.3), (-0.6, 0.5, 0.3), LYING, name="wheel_rear"),
    )
)
AIR = Air.of("x,ground,speed=10,turning=wheel_*", "z")
MESH = """
patch
{{
    body {{ type wall; nFaces 2; startFace 1; }}
}}
"""


def test_wheels_roll_on_the_ground() -> None:
    """Nothing of the body moves; rims go at the speed of the air, below with the ground, above against it."""
    surface = surface_of(CART, 48)
    speeds = surface_speeds(CART, surface, AIR, 1.0)
    x, y, z = surface.triangles_center.T
    assert not speeds[(z > 0.7) | (y < 0.2)].any()
    rim = (np.abs(np.hypot(np.abs(x) - 0.6, z - 0.3) - 0.3) < 0.01) & (y > 0.45)
    assert np.linalg.norm(speeds[rim], axis=1) == pytest.approx(10.0, rel=0.03)
    assert speeds[rim & (z < 0.02)].mean(axis=0) == pytest.approx([10, 0, 0], abs=0.3)
    assert speeds[rim & (z > 0.55)].mean(axis=0)[0] < -9
    normals = surface.face_normals
    assert np.abs((speeds * normals).sum(axis=1)[rim]).max() < 1.0  # along the rim, to its facets


def test_copies_of_a_wheel_turn_about_axles_of_their_own() -> None:
    rear = Similarity(translation=(-1.2, 0.0, 0.0))
    copied = Assembly((CART.parts[0], replace(CART["wheel_front"], instances=(rear,))))
    surface = surface_of(copied, 48)
    speeds = surface_speeds(copied, surface, AIR, 1.0)
    np.testing.assert_allclose(speeds, surface_speeds(CART, surface, AIR, 1.0), atol=1e-9)
    assert np.linalg.norm(speeds, axis=1).max() < 10.5


def test_the_length_of_the_unit_plays_no_part() -> None:
    small = CART.scaled(0.001)
    surface = surface_of(small, 32)
    speeds = surface_speeds(small, surface, AIR, 1000.0)
    assert np.linalg.norm(speeds, axis=1).max() == pytest.approx(10.0, rel=0.1)


def test_a_wall_gets_the_speed_of_the_nearest_face(tmp_path: Path) -> None:
    surface = surface_of(CART, 24)
    speeds = surface_speeds(CART, surface, AIR, 1.0)
    write_case(surface, tmp_path, AIR, 1.0)
    mesh = tmp_path / "constant" / "polyMesh"
    with pytest.raises(SimulationError, match="cannot be read"):
        body_faces(tmp_path)
    mesh.mkdir()
    (mesh / "boundary").write_text(MESH.format())
    (mesh / "faces").write_text("FoamFile { object faces; }\n3\n(\n3(0 1 2)\n3(0 1 2)\n3(3 4 5)\n)\n")
    points = [(0.0, 0.0, 0.81), (0.1, 0.0, 0.81), (0.0, 0.1, 0.81)]
    points += [(0.55, 0.5, 0.0), (0.65, 0.45, 0.0), (0.6, 0.55, 0.0)]
    rows = "\n".join("({} {} {})".format(*point) for point in points)
    (mesh / "points").write_text(f"FoamFile {{ object points; }}\n6\n(\n{rows}\n)\n")
    turn_wall(tmp_path, surface, speeds, 1.0)
    text = (tmp_path / "0" / "U").read_text()
    listed = re.search(r"List<vector>\n2\n\(\n\((.*)\)\n\((.*)\)\n\);", text)
    assert listed is not None
    top, under = (np.array(row.split(), float) for row in listed.groups())
    assert not top.any()
    assert under == pytest.approx([10, 0, 0], abs=1.0)
    with pytest.raises(SimulationError, match=r"stands still.*none to turn"):
        turn_wall(tmp_path, surface, speeds, 1.0)
    (mesh / "boundary").write_text("patch { }")
    with pytest.raises(SimulationError, match="nothing of the body"):
        body_faces(tmp_path)


def test_what_cannot_turn(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="ground to roll on"):
        Air.of("x,turning=wheel_*")
    with pytest.raises(SettingError, match=r"no part is called 'tyre'.*wheel_front"):
        surface_speeds(CART, surface_of(CART, 16), Air.of("x,ground,turning=tyre"), 1.0)
    sunk = Assembly((Part(Box((1.0, 1.0, 1.0)), (0, 0, 5.0)), Part(Box((1.0, 1.0, 1.0)), name="low")))
    surface = surface_of(Assembly((sunk.parts[0],)), 16)
    with pytest.raises(SettingError, match="low is not above the ground"):
        surface_speeds(sunk, surface, Air.of("x,ground,turning=low"), 1.0)
    with pytest.raises(SettingError, match="as one"):
        simulate_all([], tmp_path, AIR)
