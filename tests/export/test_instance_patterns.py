"""Repeated parts in the sources of CAD programs: loops that build the same solid."""

from __future__ import annotations

import math
import runpy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.export import export
from partwright.export.instance_patterns import Poses, Ring, Row, pattern
from partwright.fields import Box, Cylinder, HollowBox, HollowFrustum
from tests.export.test_openscad import rendered


def about(axis: int, degrees: float, centre: tuple[float, ...] = (0, 0, 0)) -> Similarity:
    """A turn about a line through a centre."""
    half = math.radians(degrees) / 2
    turn = Similarity(rotation=(math.cos(half), *(np.eye(3)[axis] * math.sin(half)).tolist()))
    x, y, z = (np.array(centre) - rotation_matrix(turn.rotation) @ centre).tolist()
    return Similarity(rotation=turn.rotation, translation=(x, y, z))


def machine() -> Assembly:
    """A plate drilled around a circle and at its corners, with feet that are mirror images: 23 copies."""
    ring = tuple(about(2, 72 * k, (10, 0, 0)) for k in range(1, 5))
    corners = tuple(Similarity(translation=move) for move in ((-80, 0, 0), (-80, -60, 0), (0, -60, 0)))
    plate = Part(Box((100, 80, 10)), name="plate")
    key = Part(Box((4, 8, 30)), (30, 0, 0), name="key", instances=ring)
    drill = Part(Cylinder(4, 30), (40, 30, 0), name="drill", instances=corners)
    tilt = (math.cos(0.2), math.sin(0.2), 0, 0)
    foot = Part(Box((10, 10, 20)), (0, 30, -12), tilt, name="foot", instances=(about(2, 170),))
    cage = Part(HollowBox((10, 8, 20), 1), (0, 0, 10), name="cage", instances=(about(1, 180),))
    funnel = Part(HollowFrustum(6, 3, 1, 20), (-20, 0, 10), name="funnel")
    return Assembly((Assembly((plate, foot, cage, funnel)), key, drill), operation="difference", unit="mm")


def test_patterns_have_their_names() -> None:
    parts = {part.name: pattern(part) for part in machine().parts}
    assert parts["plate"] is None
    assert parts["key"] == Ring(5, "z", (10, 0, 0))
    assert parts["drill"] == Row(((40, 30, 0), (-40, 30, 0), (-40, -30, 0), (40, -30, 0)))
    assert isinstance(parts["foot"], Poses)
    assert parts["cage"] == Ring(2, "y", (0, 0, 0))


@given(
    st.integers(2, 12),
    st.integers(0, 2),
    st.tuples(*[st.floats(-100, 100)] * 2),
    st.randoms(use_true_random=False),
)
def test_a_ring_is_found_in_any_order(count: int, axis: int, centre: tuple[float, float], order) -> None:  # type: ignore[no-untyped-def]
    through = np.insert(np.round(centre, 3), axis, 0.0).tolist()
    moves = [about(axis, 360 * k / count, through) for k in range(1, count)]
    order.shuffle(moves)
    part = Part(Box((1, 2, 3)), (200, 210, 220), (0.9, 0.3, 0.2, 0.1), instances=tuple(moves))
    found = pattern(part)
    assert isinstance(found, Ring)
    assert (found.count, found.axis) == (count, "xyz"[axis])
    assert np.allclose(found.centre, through, atol=1e-6)


def test_openscad_builds_the_loops(tmp_path: Path) -> None:
    export(machine(), tmp_path / "a.scad")
    text = (tmp_path / "a.scad").read_text("ascii")
    assert "// drill, 4 times: cylinder\n" in text
    assert "drill_places = [[40, 30, 0], [-40, 30, 0], [-40, -30, 0], [40, -30, 0]];  // mm: where" in text
    assert "for (place = drill_places) translate(place)\n" in text
    assert "cage_thickness = 1;  // mm: thickness of the wall\n" in text
    assert "key_count = 5;  // copies, by equal turns\n" in text
    mesh = rendered(tmp_path / "a.scad")
    assert mesh.is_watertight
    assert np.abs(machine().distance(mesh.vertices)).max() < 2e-3  # facets
    assert mesh.volume == pytest.approx(volume(), rel=1e-3)


def test_build123d_builds_the_loops(tmp_path: Path) -> None:
    pytest.importorskip("build123d", reason="build123d is missing: pip install build123d")
    export(machine(), tmp_path / "a.build123d.py")
    solid = runpy.run_path(str(tmp_path / "a.build123d.py"))["assembly"]
    assert solid.is_valid
    corners = np.array([tuple(v) for v in solid.vertices()])
    assert np.abs(machine().distance(corners)).max() < 1e-5
    assert solid.volume == pytest.approx(volume(), rel=1e-3)


def volume() -> float:
    from partwright.meshing import mesh_assembly

    return float(mesh_assembly(machine().expanded(), 256).volume)


def test_an_unknown_unit_is_said_once(tmp_path: Path) -> None:
    export(Assembly((Part(Box((1, 2, 3)), (1e-16, 0.5, 0), name="brick"),)), tmp_path / "a.scad")
    text = (tmp_path / "a.scad").read_text("ascii")
    assert text.count("unknown unit") == 1
    assert "brick_size = [1, 2, 3];  // full extents x, y, z\n" in text
    assert "brick_place = [0, 0.5, 0];  // where the part's origin lies\n" in text
