"""The shape that ships: what it is, and that the file is what the script makes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from partwright.datasets.demo import watering_can, write

SHIPPED = Path(__file__).parents[2] / "examples" / "shapes" / "watering_can.ply"


def test_it_is_one_closed_surface_with_a_handle_and_an_open_spout() -> None:
    can = watering_can()
    assert can.is_watertight
    assert can.body_count == 1
    assert can.euler_number == 2 - 2 * 2  # genus 2: one hole in the handle, one through the spout
    assert can.volume < 0.25 * can.convex_hull.volume  # hollow


def test_the_shipped_file_is_what_the_script_makes(tmp_path: Path) -> None:
    write(tmp_path / "a.ply")
    write(tmp_path / "b.ply")
    assert (tmp_path / "a.ply").read_bytes() == (tmp_path / "b.ply").read_bytes()
    shipped, made = trimesh.load_mesh(SHIPPED), trimesh.load_mesh(tmp_path / "a.ply")
    assert SHIPPED.stat().st_size < 300_000
    assert np.allclose(shipped.bounds, made.bounds)
    assert shipped.volume == pytest.approx(made.volume, rel=1e-6)
    assert shipped.euler_number == made.euler_number
