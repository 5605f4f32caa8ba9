"""Holes alike become one leaf with copies, and the solid stays what it was."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Assembly, Part
from partwright.capri.repeated_quadrics import TOLERANCE, with_repeats
from partwright.fields import Quadric
from partwright.meshing import mesh_csg
from tests.capri.test_fit import plate, quick  # noqa: F401

BOX = Assembly(
    tuple(Part(Quadric.plane(s * e, 0.8)) for e in np.eye(3) for s in (1.0, -1.0)), "intersection", "box"
)
HOLES = [Quadric.cylinder(0.1, (0, 0, 1), (x, y, 0.3 * x)) for x in (-0.5, 0.0, 0.5) for y in (-0.4, 0.4)]


def drilled(*holes: Quadric) -> Assembly:
    return Assembly((BOX, *map(Part, holes)), "difference")


def copies(assembly: Assembly) -> list[int]:
    return [len(part.copies) for part in assembly.parts]


def same_solid(a: Assembly, b: Assembly) -> bool:
    points = np.random.default_rng(0).uniform(-1, 1, (20_000, 3)).astype(np.float32)
    one, other = a.distance(points), b.distance(points)
    return bool(((one < 0) == (other < 0))[np.abs(one) > 2 * TOLERANCE].all())


@pytest.mark.parametrize(
    "alike",
    [
        pytest.param(HOLES, id="cylinders"),
        pytest.param([Quadric.sphere(0.15, (x, 0, 0.7)) for x in (-0.5, 0, 0.5)], id="spheres"),
        pytest.param([Quadric.cone(0.6, (0, 0, 1), (x, 0, 0.5)) for x in (-0.5, 0, 0.5)], id="cones"),
        pytest.param([Quadric.cylinder(0.1, (0, 0, s), (s * 0.4, 0, 0)) for s in (1, -1)], id="either way"),
    ],
)
def test_what_is_alike_is_one_leaf_and_the_solid_stays(alike: list[Quadric]) -> None:
    before = drilled(*alike)
    after = with_repeats(before)
    assert copies(after) == [1] * 6 + [len(alike)]
    assert same_solid(before, after)
    assert mesh_csg(after).volume == pytest.approx(mesh_csg(before).volume, rel=1e-6)


def test_noise_of_a_detection_is_averaged_out() -> None:
    rng = np.random.default_rng(1)
    radii = 0.1 + 3e-4 * rng.uniform(-1, 1, 8)
    axes = np.array([0, 0, 1]) + 3e-4 * rng.uniform(-1, 1, (8, 3))
    places = [(0.5 * np.cos(a), 0.5 * np.sin(a), 0) for a in np.arange(8) * np.pi / 4]
    before = drilled(*(Quadric.cylinder(r, u, p) for r, u, p in zip(radii, axes, places, strict=True)))
    after = with_repeats(before)
    assert copies(after)[6:] == [8]
    assert same_solid(before, after)
    square, _, _ = after.parts[6].field.matrices()
    assert np.abs(square[2]).max() / np.abs(square).max() < 3e-4  # its axis is closer to z than most were
    centres = np.array(
        [part.field.moved(np.eye(3), part.translation).matrices()[1] for part in after.parts[6].copies]
    )
    assert len(np.unique(centres.round(3), axis=0)) == 8


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(Quadric.cylinder(0.1 + 3 * TOLERANCE, (0, 0, 1), (0.2, 0.2, 0)), id="wider"),
        pytest.param(Quadric.cylinder(0.1, (0, 5 * TOLERANCE, 1), (0.2, 0.2, 0)), id="tilted"),
        pytest.param(Quadric.cylinder(0.1, (1, 0, 0), (0.2, 0.2, 0)), id="across"),
        pytest.param(Quadric.sphere(0.1, (0.2, 0.2, 0.7)), id="a sphere"),
        pytest.param(Quadric.cylinder(0.1, (0, 0, 1), (0.2, 0.2, 0)).complement(), id="its outside"),
        pytest.param(Quadric.ellipsoid((0.1, 0.12, np.inf), (0.2, 0.2, 0)), id="oval"),
        pytest.param(Quadric.plane((0, 0, 1), -0.5), id="a plane"),
    ],
)
def test_what_is_not_alike_stays_apart(other: Quadric) -> None:
    after = with_repeats(drilled(*HOLES, other))
    assert copies(after) == [1] * 6 + [6, 1]
    assert after.parts[7].field == other


def test_sides_of_a_convex_are_never_copies_of_one_another() -> None:
    lens = Assembly(tuple(Part(Quadric.sphere(0.8, (x, 0, 0))) for x in (-0.4, 0.4)), "intersection")
    assert with_repeats(lens) == lens


def test_what_repeats_further_down_is_left_as_it_is() -> None:
    balls = [Part(Quadric.sphere(0.2, (x, 0, 0))) for x in (-0.6, 0.0, 0.6)]
    before = Assembly((Assembly(tuple(balls[:2])), Assembly((balls[2],))))
    after = with_repeats(before)
    assert same_solid(before, after)
    assert copies(after) == [2, 1]
    moved = Assembly((balls[0], Part(Quadric.sphere(0.2), (0.5, 0, 0))))
    assert with_repeats(moved) == moved


def test_a_fit_drills_equal_holes_once(plate) -> None:  # noqa: F811
    fitted, apart = quick(plate), quick(plate, symmetry=False)
    assert sorted(copies(fitted.quadrics)) == [1] * 6 + [2]
    assert [(part.field.kind, len(part.copies)) for part in fitted.assembly.parts] == [
        ("box", 1),
        ("cylinder", 2),
    ]
    assert set(copies(apart.assembly)) == {1}
    assert fitted.details["primitives"] == 7
    assert fitted.details["convexes"] == 2
    assert apart.details["convexes"] == 3
    made, plain = mesh_csg(fitted.assembly), mesh_csg(apart.assembly)
    assert made.euler_number == plain.euler_number == -2
    assert made.volume == pytest.approx(plain.volume, rel=1e-4)
