"""Simplified solids stay where they are."""

from __future__ import annotations

import numpy as np
import pytest
from manifold3d import Manifold

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder
from partwright.meshing import mesh_csg
from partwright.meshing.manifolds import simplified


class _Lossy:
    """A solid whose own simplification loses half of it where it is asked for more than `most`."""

    def __init__(self, most: float, volume: float = 8.0) -> None:
        self.most, self._volume = most, volume

    def volume(self) -> float:
        return self._volume

    def surface_area(self) -> float:
        return 24.0

    def simplify(self, tolerance: float) -> _Lossy:
        return _Lossy(self.most, 4.0 if tolerance > self.most else 7.999)


def test_what_loses_more_than_its_tolerance_is_tried_with_less_or_left_out() -> None:
    assert simplified(solid := _Lossy(1.0), 0.01) is not solid  # type: ignore[arg-type]
    assert simplified(_Lossy(0.003), 0.01).volume() == 7.999  # type: ignore[arg-type]
    assert simplified(solid := _Lossy(0.0), 0.01) is solid  # type: ignore[arg-type, comparison-overlap]


def test_corners_that_hardly_matter_go() -> None:
    fine = Manifold.sphere(1.0, 200)
    simple = simplified(fine, 0.01)
    assert simple.num_tri() < fine.num_tri() / 4
    assert simple.volume() == pytest.approx(fine.volume(), abs=0.01 * fine.surface_area())


def test_many_levels_do_not_make_a_solid_larger() -> None:
    """Each pair of levels adds a rib and drills it; at last a box touches the plate, but for rounding. What
    no level below needs must not add up."""
    node = Assembly((Part(Box((10, 10, 1))),))
    for k in range(8):
        x = -4.5 + k
        node = Assembly((node, Part(Box((0.5, 9, 1)), (x, 0, 0.9))))
        node = Assembly((node, Part(Cylinder(0.1, 9), (x, 3, 0))), "difference")
    touching = Part(Box((2, 10, 1)), (6 + 1e-9, 0, 0))
    node = Assembly((node, touching))
    whole = 120 + 8 * 0.5 * 9 * 0.9 - 8 * np.pi * 0.01 * 1.9
    mesh = mesh_csg(node)
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(whole, rel=2e-4)
