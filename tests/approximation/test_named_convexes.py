"""Convexes of quadrics become the solids that they are, at an unchanged volume; what is none stays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from partwright.approximation.named_convexes import with_named_convexes
from partwright.assembly import Assembly, Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Cone, Cylinder, Extrusion, Frustum, Quadric, Revolution, Sphere
from partwright.meshing.csg import solid_of

Z = (0.0, 0.0, 1.0)


def planes(*rows: tuple[tuple[float, float, float], float]) -> list[Quadric]:
    return [Quadric.plane(normal, offset) for normal, offset in rows]


def around(x: float, y: float, z: float) -> list[Quadric]:
    """Half-spaces that bound a box of these half extents."""
    return [Quadric.plane(s * e, h) for e, h in zip(np.eye(3), (x, y, z), strict=True) for s in (1.0, -1.0)]


def ends(low: float, high: float) -> list[Quadric]:
    return planes((Z, high), ((0, 0, -1), -low))


def prism(sides: int, lean: float = 0.0) -> list[Quadric]:
    turns = np.arange(sides) * (2 * math.pi / sides)
    return [Quadric.plane((math.cos(t), math.sin(t), lean), 1.0) for t in turns]


def pyramid(half: float, lean: float) -> float:
    """Volume of a square pyramid's lowest stretch of height 1."""
    return 4 * (half**3 - (half - lean) ** 3) / (3 * lean)


CONVEXES: dict[str, tuple[list[Quadric], type, float]] = {
    "box": (around(1, 2, 3), Box, 48.0),
    "box with a plane that touches nothing": ([*around(1, 2, 3), Quadric.plane((1, 1, 0), 9)], Box, 48.0),
    "cylinder": ([Quadric.cylinder(0.5, Z, (1, 2, 0)), *ends(-1, 3)], Cylinder, math.pi),
    "cone": ([Quadric.cone(0.5), *ends(0, 2)], Cone, 2 * math.pi / 3),
    "cone on its head": ([Quadric.cone(0.5), *ends(-2, 0)], Cone, 2 * math.pi / 3),
    "frustum": ([Quadric.cone(0.5), *ends(1, 2)], Frustum, 7 * math.pi / 12),
    "sphere": ([Quadric.sphere(1, (1, 2, 3))], Sphere, 4 * math.pi / 3),
    "hexagonal prism": ([*prism(6), *ends(0, 2)], Extrusion, 2 * 6 * math.tan(math.pi / 6)),
    "shaft with a flat": (
        [Quadric.cylinder(1), *ends(0, 2), Quadric.plane((1, 0, 0), 0.5)],
        Extrusion,
        2 * (math.pi - math.pi / 3 + math.sqrt(3) / 4),
    ),
    "lens across two cylinders": (
        [Quadric.cylinder(1), Quadric.cylinder(1, Z, (1, 0, 0)), *ends(0, 1)],
        Extrusion,
        2 * math.pi / 3 - math.sqrt(3) / 2,
    ),
    "pyramid without its tip": ([*prism(4, 0.25), *ends(0, 1)], Extrusion, pyramid(math.sqrt(17 / 16), 0.25)),
    "ball with flat ends": ([Quadric.sphere(1), *ends(-0.5, 0.5)], Revolution, math.pi * (1 - 1 / 12)),
    "pill": ([Quadric.cylinder(0.5), Quadric.sphere(1)], Revolution, 0.0),
}


def turned(quadrics: list[Quadric], move: Similarity) -> Assembly:
    rotation = rotation_matrix(move.rotation)
    parts = (Part(q.moved(rotation, np.array(move.translation))) for q in quadrics)
    return Assembly((Assembly(tuple(parts), "intersection", name="it"),))


def apart(one: Assembly, other: Assembly) -> float:
    a, b = solid_of(one), solid_of(other)
    return float(((a - b).volume() + (b - a).volume()) / a.volume())


TURNED = Similarity(1.0, (0.8, 0.3, -0.4, 0.33166247903554), (3, -1, 2))


@pytest.mark.parametrize(
    "move",
    [pytest.param(Similarity(), marks=pytest.mark.heavy, id="plain"), pytest.param(TURNED, id="turned")],
)
@pytest.mark.parametrize("name", CONVEXES)
def test_a_convex_is_what_it_is(name: str, move: Similarity) -> None:
    quadrics, kind, volume = CONVEXES[name]
    before = turned(quadrics, move)
    after = with_named_convexes(before)
    assert [type(part.field) for part in after.parts] == [kind]
    assert after.parts[0].name == "it"
    assert apart(before, after) < 3e-3
    if volume:
        assert solid_of(after, 1e-4).volume() == pytest.approx(volume, rel=2e-3)


def test_the_numbers_are_those_that_were_put_in() -> None:
    quadrics, _, _ = CONVEXES["cylinder"]
    (part,) = with_named_convexes(turned(quadrics, Similarity())).parts
    assert isinstance(part.field, Cylinder)
    assert (part.field.radius, part.field.height) == pytest.approx((0.5, 4.0))
    assert part.translation == pytest.approx((1, 2, 1))
    (box,) = with_named_convexes(turned(CONVEXES["box"][0], Similarity())).parts
    assert isinstance(box.field, Box)
    assert box.field.size == pytest.approx((2, 4, 6))
    assert box.rotation == (1, 0, 0, 0)


@pytest.mark.parametrize(
    "quadrics",
    [
        [Quadric.ellipsoid((1, 2, 3))],
        [*around(1, 1, 1), Quadric.plane((1, 1, 1), 1.2)],
        [Quadric.cylinder(1), Quadric.cylinder(1, (1, 0, 0))],
        [*around(1, 1, 1), Quadric.sphere(1.2)],
    ],
    ids=["ellipsoid", "a corner cut off", "crossing cylinders", "box and ball"],
)
def test_what_is_no_such_solid_stays(quadrics: list[Quadric]) -> None:
    before = turned(quadrics, Similarity())
    assert with_named_convexes(before) == before


def test_what_is_cut_away_goes_a_little_beyond() -> None:
    """Holes and notches without end of their own."""
    plate = Assembly(tuple(Part(q) for q in around(4, 3, 0.5)), "intersection", name="plate")
    copies = (Similarity(translation=(-2, 1, 0)),)
    hole = Part(Quadric.cylinder(0.5, Z, (1, 0, 0)), name="hole", instances=copies)
    notch = Assembly(
        tuple(Part(q) for q in planes(((-1, 0, 0), -3), ((0, -1, 0), -2))), "intersection", name="notch"
    )
    before = Assembly((plate, hole, notch), "difference", unit="mm", name="thing")
    after = with_named_convexes(before)
    assert [type(part.field) for part in after.parts] == [Box, Cylinder, Box]
    assert (after.unit, after.name) == ("mm", "thing")
    drill = after["hole"]
    assert isinstance(drill.field, Cylinder)
    assert 1.1 < drill.field.height < 2
    assert drill.instances == hole.instances
    assert apart(before, after) < 1e-3


def test_blends_and_copies_of_several_quadrics_stay() -> None:
    soft = Assembly((Part(Quadric.plane(Z, 1)), Part(Quadric.sphere(2), blend=0.1)), "intersection")
    assert with_named_convexes(Assembly((soft,))) == Assembly((soft,))
