"""The shapes that ship are what the script makes, small, closed, and have the nodes that the docs name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.datasets.shipped import truck, write
from partwright.robots import open_robot

SHIPPED = Path(__file__).parents[2] / "examples" / "shapes"
NAMES = ("watering_can.ply", "mug.ply", "bracket.stl", "truck.glb")


def test_the_files_are_what_the_script_makes(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder)
    assert sorted(path.name for path in SHIPPED.iterdir()) == sorted((*NAMES, "hinge.urdf"))
    for name in NAMES:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
        shipped, made = (trimesh.load_scene(folder / name).to_mesh() for folder in (SHIPPED, tmp_path / "a"))
        assert np.allclose(shipped.bounds, made.bounds)
        assert shipped.volume == pytest.approx(made.volume, rel=1e-6)
        assert (SHIPPED / name).stat().st_size < 300_000


def test_the_robot_is_two_brackets_on_a_hinge() -> None:
    robot = open_robot(SHIPPED / "hinge.urdf")
    assert [link.name for link in robot.links] == ["base", "arm"]
    assert [len(link.collisions) for link in robot.links] == [1, 1]


def test_the_truck_stands_on_four_wheels_in_metres_with_y_up() -> None:
    scene = truck()
    assert {name for name in scene.graph.nodes_geometry if name.startswith("wheel")} == {
        f"wheel_{end}_{side}" for end in ("front", "rear") for side in ("left", "right")
    }
    assert all(geometry.is_watertight and geometry.volume > 0 for geometry in scene.geometry.values())
    assert 0.2 < scene.extents[0] < 0.3
    assert scene.bounds[0][1] == pytest.approx(0.0, abs=1e-9)
