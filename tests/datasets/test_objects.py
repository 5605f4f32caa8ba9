"""The objects are closed, of the topology that their description implies, and the same every time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.datasets.making import ball, bar, limb, pebble, plate, ring, rod, to_mesh
from partwright.datasets.objects import OBJECTS, write

# name -> holes through it, height, volume
KNOWN = {
    "table_lamp": (3, 35.5, 1285.9),  # the shade, and two loops of three spokes
    "chair": (3, 87.9, 14804.9),  # above the seat and between the slats
    "mug": (1, 9.86, 154.30),
    "toy_robot": (0, 20.95, 675.0),
    "bracket": (3, 9.6, 164.26),  # two eyes and the bore
}


@pytest.mark.parametrize("name", OBJECTS)
def test_each_is_one_closed_surface(name: str) -> None:
    holes, height, volume = KNOWN[name]
    made = OBJECTS[name]()
    assert made.is_watertight
    assert made.body_count == 1
    assert made.euler_number == 2 - 2 * holes
    assert made.extents[2] == pytest.approx(height, rel=1e-3)
    assert made.volume == pytest.approx(volume, rel=1e-3)
    assert made.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)  # they stand on the ground


def test_mirrored_objects_are_symmetric() -> None:
    for name in ("chair", "toy_robot", "bracket"):
        made = OBJECTS[name]()
        np.testing.assert_allclose(made.bounds[0, 0], -made.bounds[1, 0], atol=1e-6)
        assert made.center_mass[0] == pytest.approx(0.0, abs=1e-5)


def test_the_files_are_the_same_every_time(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder)
    for name in OBJECTS:
        first, second = (tmp_path / folder / f"{name}.ply" for folder in "ab")
        assert first.read_bytes() == second.read_bytes()
        assert trimesh.load_mesh(first).is_watertight


def test_building_blocks_have_the_volumes_of_their_formulas() -> None:
    """Circles of n corners hold a little less than round ones."""
    pi = np.pi
    expected = {
        rod(3, 2): pi * 4 * 3,
        rod(3, 2, 1): pi * (4 + 2 + 1),
        ring(5, 1): 2 * pi * 5 * pi,
        ring(5, 1, 90): 2 * pi * 5 * pi / 4,
        ball(2): 4 / 3 * pi * 8,
        bar(1, 2, 3): 6,
        plate(4, 3, 2, 1): 2 * (12 - 4 + pi),
        limb((0, 0, 0), (0, 0, 4), 1): 4 * pi + 4 / 3 * pi,
        pebble(4, 3, 2, 1): 2 * 1 * 2 + pi * 3 + 4 / 3 * pi,
    }
    for solid, volume in expected.items():
        made = to_mesh(solid)
        assert made.is_watertight
        assert 0.96 * volume < made.volume < volume * (1 + 1e-6)
