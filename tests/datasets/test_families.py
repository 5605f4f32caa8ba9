"""Families: closed parts that touch without overlap, the same every time, varied, and whole."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

import partwright as pw
from partwright.datasets.families import FAMILIES, FamilyShape, family
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


def test_mixers_and_cars_are_complete_and_some_chairs_lack_arms_or_back() -> None:
    chairs = [set(shape.parts) for shape in family("chairs", 40, seed=1)]
    for name in ("mixers", "cars"):
        assert all(len(shape.parts) == len(FAMILIES[name].parts) for shape in family(name, 3, seed=1))
    arms, backs = sum("arm_left" in c for c in chairs), sum("back" in c for c in chairs)
    assert 8 <= arms <= 24
    assert 28 <= backs <= 39
    for parts in chairs:
        assert {"seat", "leg_front_left", "leg_back_right"} <= parts
        assert ("arm_left" in parts) == ("arm_right" in parts)
        assert "back" in parts or "arm_left" not in parts


def test_a_mixer_is_hollow_from_end_to_end(made: dict[str, list[FamilyShape]]) -> None:
    for shape in made["mixers"]:
        tube = shape.parts["tube"]
        assert tube.euler_number == 0  # a ring: one hole
        hull = tube.convex_hull.volume
        assert tube.volume < 0.4 * hull


def test_wheel_wells_follow_the_wheels(made: dict[str, list[FamilyShape]]) -> None:
    """No wheel comes nearer to the body than the well's gap, axles aside; all stand on the ground."""
    for shape in made["cars"]:
        body = trimesh.proximity.ProximityQuery(shape.parts["body"])
        for name, wheel in shape.parts.items():
            if name == "body":
                continue
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
    with pytest.raises(SettingError, match=r"no family is called 'boats'.*mixers, chairs, cars"):
        pw.datasets.family("boats", 3, 0)
    with pytest.raises(SettingError, match="0 shapes"):
        pw.datasets.family("cars", 0, 0)
