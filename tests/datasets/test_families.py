"""Families: closed parts that touch without overlap, the same every time, varied, and whole."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial import cKDTree

import partwright as pw
from partwright.datasets.families import FAMILIES, FamilyShape, family, vehicle_fittings
from partwright.datasets.families.car_shapes import WHEELS
from partwright.errors import SettingError

COUNT = 8


@pytest.fixture(scope="module")
def made() -> dict[str, list[FamilyShape]]:
    return {name: family(name, COUNT, seed=5) for name in FAMILIES}


@pytest.mark.parametrize("name", FAMILIES)
def test_parts_are_closed_and_disjoint_and_the_whole_is_one_body(
    made: dict[str, list[FamilyShape]], name: str
) -> None:
    for shape in made[name]:
        assert shape.whole.is_watertight
        assert shape.whole.body_count == 1
        for part in shape.parts.values():
            assert part.is_watertight
            assert part.volume > 0
        volume = sum(part.volume for part in shape.parts.values())
        assert volume == pytest.approx(shape.whole.volume, rel=1e-3)  # no overlap, nothing lost


@pytest.mark.parametrize("name", FAMILIES)
def test_parts_come_in_the_order_of_the_family(made: dict[str, list[FamilyShape]], name: str) -> None:
    for shape in made[name]:
        assert list(shape.parts) == [part for part in FAMILIES[name].parts if part in shape.parts]


def test_mixers_and_cars_are_complete_and_some_chairs_lack_arms_back_or_legs() -> None:
    chairs = [set(shape.parts) for shape in family("chairs", 40, seed=1)]
    for name in ("mixers", "cars"):
        assert all(len(shape.parts) == len(FAMILIES[name].parts) for shape in family(name, 3, seed=1))
    arms, backs = sum("arm_left" in c for c in chairs), sum("back" in c for c in chairs)
    assert 8 <= arms <= 24
    assert 28 <= backs <= 39
    legs = [part for part in FAMILIES["chairs"].parts if part.startswith("leg")]
    assert len(legs) == 4
    assert 0 < sum(not parts.issuperset(legs) for parts in chairs) <= 8  # couches that stand on the floor
    for parts in chairs:
        assert "seat" in parts
        assert parts.issuperset(legs) or parts.isdisjoint(legs)
        assert ("arm_left" in parts) == ("arm_right" in parts)
        assert "back" in parts or "arm_left" not in parts


def test_vehicles_have_a_body_and_wheels_and_mostly_what_is_set_into_them() -> None:
    vehicles = family("vehicles", 24, seed=0)
    for shape in vehicles:
        assert {"body", *WHEELS} <= set(shape.parts)
        for pair in ("windows", "mirror"):
            assert (f"{pair}_left" in shape.parts) == (f"{pair}_right" in shape.parts)
    for part in vehicle_fittings.PARTS:
        having = sum(part in shape.parts for shape in vehicles)
        assert 0.5 * len(vehicles) <= having < len(vehicles), part
    assert any(set(shape.parts) == {"body", *WHEELS} for shape in vehicles)
    # from sports cars to box vans: width and height as shares of the length
    sizes = np.array([shape.whole.extents for shape in vehicles])
    assert np.ptp(sizes[:, 0] / sizes[:, 1]) > 0.1
    assert (sizes[:, 2] / sizes[:, 1]).min() < 0.3
    assert (sizes[:, 2] / sizes[:, 1]).max() > 0.45


def test_pairs_are_mirror_images(made: dict[str, list[FamilyShape]]) -> None:
    """Left is the driver's in vehicles, and the left of who stands before a car."""
    for shape in [*made["vehicles"], *made["cars"]]:
        driver = 1 if shape.name.startswith("vehicle") else -1
        for name, left in shape.parts.items():
            if "_left" not in name:
                continue
            right = shape.parts[name.replace("left", "right")]
            assert left.bounds[:, 0].mean() * driver > 0
            np.testing.assert_allclose(left.bounds[:, 0], right.bounds[::-1, 0] * -1, atol=0.05)
            np.testing.assert_allclose(left.bounds[:, 1:], right.bounds[:, 1:], atol=0.05)
            assert left.volume == pytest.approx(right.volume, rel=5e-3)


def test_panes_are_glass_that_the_whole_shows(made: dict[str, list[FamilyShape]]) -> None:
    """Seen from ahead or behind, the first thing in the middle of the pane is the glass."""
    seen = 0
    for shape in made["vehicles"]:
        for name in sorted({"windscreen", "window_back"} & set(shape.parts)):
            glass = shape.parts[name]
            assert 1.5 < 2 * glass.volume / glass.area < 4.0  # cm thick
            ahead = -1.0 if name == "windscreen" else 1.0
            ray = trimesh.ray.ray_triangle.RayMeshIntersector(shape.whole)
            middle = glass.bounds.mean(axis=0)
            start = np.array([[0.0, ahead * 1000, middle[2]]])
            hit = ray.intersects_location(start, [[0, -ahead, 0]], multiple_hits=False)[0]
            own = trimesh.proximity.ProximityQuery(glass).on_surface(hit)[1]
            assert own[0] < 1e-3, (shape.name, name)  # the whole shows the glass
            seen += 1
    assert seen >= COUNT


def test_the_whole_which_is_one_body_shows_every_part(made: dict[str, list[FamilyShape]]) -> None:
    """So all hang together: what floats would be a splinter, which the whole goes without."""
    for shape in made["vehicles"]:
        corners = cKDTree(shape.whole.vertices)
        for name, part in shape.parts.items():
            assert corners.query(part.vertices)[0].min() < 1e-3, (shape.name, name)


def test_a_mixer_is_hollow_from_end_to_end(made: dict[str, list[FamilyShape]]) -> None:
    for shape in made["mixers"]:
        tube = shape.parts["tube"]
        assert tube.euler_number == 0  # a ring: one hole
        hull = tube.convex_hull.volume
        assert tube.volume < 0.4 * hull


def test_wheel_wells_follow_the_wheels(made: dict[str, list[FamilyShape]]) -> None:
    """No wheel comes nearer to the body than the well's gap, axles aside; all stand on the ground."""
    for shape in [*made["cars"], *made["vehicles"]]:
        body = trimesh.proximity.ProximityQuery(shape.parts["body"])
        for name in WHEELS:
            wheel = shape.parts[name]
            low, high = wheel.bounds
            assert low[2] == pytest.approx(0, abs=1e-3)
            radius = (high[2] - low[2]) / 2
            middle = (low + high) / 2
            rim = wheel.vertices[np.hypot(*(wheel.vertices - middle)[:, 1:].T) > 0.98 * radius]
            assert body.on_surface(rim)[1].min() > 0.05 * radius


def test_the_same_seed_gives_the_same_shapes_however_many() -> None:
    for name in FAMILIES:
        few, many = family(name, 2, seed=3), family(name, 3, seed=3)
        other = family(name, 2, seed=4)
        for a, b in zip(few, many, strict=False):
            assert a.name == b.name
            np.testing.assert_array_equal(a.whole.vertices, b.whole.vertices)
            np.testing.assert_array_equal(a.whole.faces, b.whole.faces)
        assert few[0].whole.vertices.shape != other[0].whole.vertices.shape or not np.allclose(
            few[0].whole.vertices, other[0].whole.vertices
        )


def test_shapes_vary(made: dict[str, list[FamilyShape]]) -> None:
    for shapes in made.values():
        proportions = np.array([shape.whole.extents / shape.whole.extents.max() for shape in shapes])
        assert (np.ptp(proportions, axis=0).max()) > 0.1
        assert len({len(shape.whole.faces) for shape in shapes}) == COUNT


def test_unknown_names_and_empty_families_are_refused() -> None:
    with pytest.raises(SettingError, match=r"no family is called 'boats'.*mixers, chairs, cars, vehicles"):
        pw.datasets.family("boats", 3, 0)
    with pytest.raises(SettingError, match="0 shapes"):
        pw.datasets.family("cars", 0, 0)
