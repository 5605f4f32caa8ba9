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
from partwright.assembly.instance_patterns import Circle, Grid, Line, Poses, Ring, Row, pattern, with_pattern
from partwright.assembly.numbers import with_number
from partwright.assembly.similarity import rotation_matrix
from partwright.export import export
from partwright.fields import Box, Cylinder, HollowBox, HollowFrustum
from tests.export.test_openscad import rendered


def about(axis: int, degrees: float, centre: tuple[float, ...] = (0, 0, 0)) -> Similarity:
    """A turn about a line through a centre."""
    half = math.radians(degrees) / 2
    turn = Similarity(rotation=(math.cos(half), *(np.eye(3)[axis] * math.sin(half)).tolist()))
    x, y, z = (np.array(centre) - rotation_matrix(turn.rotation) @ centre).tolist()
    return Similarity(rotation=turn.rotation, translation=(x, y, z))


def machine() -> Assembly:
    """A plate drilled around a circle, at its corners, on a circle and anywhere, with feet that are mirror
    images: 29 copies."""
    ring = tuple(about(2, 72 * k, (10, 0, 0)) for k in range(1, 5))
    corners = tuple(Similarity(translation=move) for move in ((-80, 0, 0), (-80, -60, 0), (0, -60, 0)))
    plate = Part(Box((100, 80, 10)), name="plate")
    key = Part(Box((4, 8, 30)), (30, 0, 0), name="key", instances=ring)
    drill = Part(Cylinder(4, 30), (40, 30, 0), name="drill", instances=corners)
    tilt = (math.cos(0.2), math.sin(0.2), 0, 0)
    foot = Part(Box((10, 10, 20)), (0, 30, -12), tilt, name="foot", instances=(about(2, 170),))
    cage = Part(HollowBox((10, 8, 20), 1), (0, 0, 10), name="cage", instances=(about(1, 180),))
    funnel = Part(HollowFrustum(6, 3, 1, 20), (-20, 0, 10), name="funnel")
    lying = (math.cos(0.4), math.sin(0.4), 0, 0)
    bolt = with_pattern(Part(Cylinder(1.5, 8), rotation=lying, name="bolt"), Circle(5, 60, 50, (-8, 2, 0)))
    pin = Part(Cylinder(1, 40), (-40, 0, 0), name="pin", instances=(Similarity(translation=(5, 9, 0)),))
    bores = (key, drill, bolt, pin)
    return Assembly((Assembly((plate, foot, cage, funnel)), *bores), operation="difference", unit="mm")


def test_patterns_have_their_names() -> None:
    parts = {part.name: pattern(part) for part in machine().parts}
    assert parts["plate"] is None
    assert parts["key"] == Ring(5, "z", (10, 0, 0))
    assert parts["drill"] == Grid((2, 2, 1), (80, 60, 0), (0, 0, 0))
    assert parts["bolt"] == Circle(5, 60, 50, (-8, 2, 0))
    assert parts["pin"] == Row(((-40, 0, 0), (-35, 9, 0)))
    assert isinstance(parts["foot"], Poses)
    assert parts["cage"] == Grid((1, 1, 2), (0, 0, 20), (0, 0, 0))


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


@given(
    st.integers(3, 12),
    st.tuples(st.floats(1, 100), st.floats(-180, 180)),
    st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: sum(v * v for v in q) > 0.1),
    st.randoms(use_true_random=False),
)
def test_a_circle_is_found_in_any_order(count: int, numbers, turn, order) -> None:  # type: ignore[no-untyped-def]
    wanted = Circle(count, *numbers, (3, -20, 7))
    part = with_pattern(Part(Cylinder(1, 2), rotation=turn), wanted)
    places = [copy.translation for copy in part.copies]
    order.shuffle(places)
    found = pattern(with_pattern(part, Row(tuple(places))))
    assert isinstance(found, Circle) or count == 4  # where it may be a square along the axes
    if isinstance(found, Circle):
        assert found.count == count
        assert found.diameter == pytest.approx(numbers[0])
        off = np.linalg.norm(np.array(places)[:, None] - found.places(part), axis=2).min(axis=1)
        assert off.max() < 1e-6


@given(
    st.tuples(*[st.integers(1, 4)] * 3).filter(lambda n: math.prod(n) > 1),
    st.tuples(*[st.floats(1, 50)] * 3),
    st.randoms(use_true_random=False),
)
def test_a_grid_is_found_in_any_order(counts, spacing, order) -> None:  # type: ignore[no-untyped-def]
    steps = tuple(step if n > 1 else 0.0 for n, step in zip(counts, spacing, strict=True))
    part = with_pattern(Part(Box((1, 2, 3)), rotation=(1, 0.2, 0, 0)), Grid(counts, steps, (3, -20, 7)))
    places = [copy.translation for copy in part.copies]
    order.shuffle(places)
    found = pattern(with_pattern(part, Row(tuple(places))))
    assert isinstance(found, Grid)
    assert found.count == counts
    assert np.allclose(found.spacing, steps)
    assert np.allclose(found.middle, (3, -20, 7))
    if len(places) > 4:
        assert isinstance(pattern(with_pattern(part, Row(tuple(places[1:])))), Row | Grid)


@given(
    st.integers(3, 12),
    st.tuples(*[st.floats(-20, 20)] * 3).filter(lambda step: np.abs(step).max() > 0.1),
    st.randoms(use_true_random=False),
)
def test_a_row_in_any_direction_is_found_in_any_order(count: int, step, order) -> None:  # type: ignore[no-untyped-def]
    places = Line(count, step, (3, -20, 7)).places(Part(Box((1, 2, 3))))
    rest = places[1:].tolist()
    order.shuffle(rest)
    found = pattern(with_pattern(Part(Box((1, 2, 3))), Row((tuple(places[0].tolist()), *map(tuple, rest)))))
    assert isinstance(found, Line | Grid)  # where it is along one of the axes
    if isinstance(found, Line):
        assert found.count == count
        assert np.allclose(found.step, step, atol=1e-7)
        assert np.allclose(found.place, (3, -20, 7), atol=1e-7)
        odd = with_pattern(Part(Box((1, 2, 3))), Row((*map(tuple, places.tolist()), (50, 90, -70))))
        assert isinstance(pattern(odd), Row)


def test_a_slanting_row_is_a_number_and_a_step(tmp_path: Path) -> None:
    row = with_pattern(Part(Box((2, 2, 2)), name="vent"), Line(4, (5, 3, 0), (1, 0, 0)))
    whole = Assembly((row,), unit="mm")
    export(whole, tmp_path / "a.scad")
    text = (tmp_path / "a.scad").read_text("ascii")
    assert "vent_count = 4;  // copies, by equal turns or steps\n" in text
    assert "vent_step = [5, 3, 0];  // mm: from one copy to the next\n" in text
    assert "4 copies, each (5, 3, 0) from the last" in whole.describe()
    more = with_number(row, "count", 6)
    assert pattern(with_number(more, "step.y", -4)) == Line(6, (5, -4, 0), (1, 0, 0))
    assert isinstance(pattern(with_number(more, "step.y", 0)), Grid)
    pytest.importorskip("build123d", reason="build123d is missing: pip install build123d")
    export(whole, tmp_path / "a.build123d.py")
    solid = runpy.run_path(str(tmp_path / "a.build123d.py"))["assembly"]
    assert np.abs(whole.distance(np.array([tuple(v) for v in solid.vertices()]))).max() < 1e-5
    assert solid.volume == pytest.approx(4 * 8)
    mesh = rendered(tmp_path / "a.scad")
    assert np.abs(whole.distance(mesh.vertices)).max() < 1e-5
    assert mesh.volume == pytest.approx(4 * 8)


def test_of_a_square_the_plainer_number_says_what_it_is() -> None:
    """Four holes of a motor are 31 apart, those of a flange are on a circle of 31."""
    hole = Part(Cylinder(1, 2))
    assert pattern(with_pattern(hole, Grid((2, 2, 1), (31, 31, 0), (0, 0, 0)))) == Grid(
        (2, 2, 1), (31, 31, 0), (0, 0, 0)
    )
    assert pattern(with_pattern(hole, Circle(4, 31, 45, (0, 0, 0)))) == Circle(4, 31, 45, (0, 0, 0))


def test_openscad_builds_the_loops(tmp_path: Path) -> None:
    export(machine(), tmp_path / "a.scad")
    text = (tmp_path / "a.scad").read_text("ascii")
    assert "// drill, 4 times: cylinder\n" in text
    assert "drill_counts = [2, 2, 1];  // copies along x, y and z\n" in text
    assert "drill_spacing = [80, 60, 0];  // mm: from one copy" in text
    assert "bolt_count = 5;  // copies, by equal turns or steps\n" in text
    assert "bolt_circle = 60;  // mm: diameter of the circle" in text
    assert "bolt_start = 50;  // degrees: where on the circle the first is\n" in text
    assert "pin_places = [[-40, 0, 0], [-35, 9, 0]];  // mm: where" in text
    assert "for (place = pin_places) translate(place)\n" in text
    assert "cage_thickness = 1;  // mm: thickness of the wall\n" in text
    assert "key_count = 5;  // copies, by equal turns or steps\n" in text
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
