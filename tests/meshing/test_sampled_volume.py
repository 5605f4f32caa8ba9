"""Volumes by points, against solids whose volume is known."""

from __future__ import annotations

import math

import pytest

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Quadric, Sphere, Tube
from partwright.meshing.sampled_volume import sampled_volume


def test_known_solids() -> None:
    assert sampled_volume(Part(Box((1.0, 2.0, 3.0)))) == pytest.approx(6, rel=1e-6)
    ball = Part(Sphere(0.7), (5.0, -3.0, 2.0))
    assert sampled_volume(ball) == pytest.approx(4 / 3 * math.pi * 0.7**3, rel=5e-4)
    lens = Assembly((ball, Part(Sphere(0.7), (5.0, -3.0, 2.7))), "intersection")
    cap = math.pi * 0.35**2 * (0.7 - 0.35 / 3)
    assert sampled_volume(lens) == pytest.approx(2 * cap, rel=5e-3)


def test_thin_walls_are_counted_though_no_cell_is_as_thin() -> None:
    wall = Part(Tube(1.0, 0.002, 1.0), rotation=(0.9, 0.3, 0.2, 0.1))
    assert sampled_volume(wall) == pytest.approx(math.pi * (1 - 0.998**2), rel=0.03)


def test_what_has_no_end_is_refused() -> None:
    slope = Quadric((0, 0, 0, 1, 0, 0, 0))
    with pytest.raises(ValueError, match="no end"):
        sampled_volume(Part(slope, name="half"))
