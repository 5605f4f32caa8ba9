"""What a person draws as one solid with a pocket or a cross hole is read so."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import Manifold

from partwright.approximation.sketches.candidates import candidates
from partwright.approximation.sketches.pockets import as_pockets, closed_by
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Profile, Revolution
from partwright.fields.profile import circle
from partwright.meshing import mesh_assembly
from partwright.meshing.named_solids import named_solid

QUARTER = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))
OVER = (0.0, 1.0, 0.0, 0.0)
WALL = Extrusion(Profile(Profile.rectangle(1.2, 0.8, 0.1).outline, [Profile.rectangle(1, 0.6).outline]), 0.4)


@pytest.mark.parametrize("turn", [QUARTER, OVER], ids=["turned", "upside down"])
@pytest.mark.parametrize(
    "floor",
    [Box((1.1, 0.7, 0.1)), Extrusion(Profile(Profile.rectangle(1.1, 0.7).outline, [circle(0.05)]), 0.1)],
)
def test_a_wall_and_a_floor_are_a_solid_with_a_pocket(turn: tuple, floor: Box | Extrusion) -> None:
    at = (0.0, 0.0, -0.15)
    parts = Part(WALL), Part(floor, at, OVER)
    whole = Assembly(parts)
    ((body, pockets, holes),) = as_pockets(*(part.transformed(_turn(turn)) for part in parts))
    assert isinstance(body.field, Extrusion)
    assert not body.field.profile.holes
    assert len(pockets) == 1
    assert len(holes) == isinstance(floor, Extrusion)
    made = Assembly((body, *pockets, *holes), "difference")
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (5000, 3))
    same = (made.distance(_turn(turn)(points)) < 0) == (whole.distance(points) < 0)
    assert same.mean() > 0.999


def _turn(rotation: tuple) -> Similarity:
    return Similarity(rotation=rotation)


@pytest.mark.parametrize(
    "floor",
    [
        Part(Box((0.8, 0.5, 0.1)), (0, 0, -0.15)),  # closes a part of the hole
        Part(Box((1.4, 0.7, 0.1)), (0, 0, -0.15)),  # reaches beyond the wall
        Part(Box((1.1, 0.7, 0.1)), (0, 0, -0.3)),  # outside
        Part(Box((1.1, 0.7, 0.1)), (0, 0, -0.15), instances=(Similarity(translation=(3, 0, 0)),)),  # one more
        Part(Box((1.1, 0.7, 0.1)), (0, 0, -0.15), (0.9, 0.1, 0, 0)),  # leans
    ],
)
def test_other_parts_stay(floor: Part) -> None:
    assert not list(as_pockets(Part(WALL), floor))


def test_a_hole_that_a_floor_closes_but_for_a_slit_stays_open() -> None:
    """However narrow the slit, or the hole itself: neither is looked for on a lattice."""
    slit = [(-0.55, -0.35), (0.0, -0.35), (0.0, 0.2), (0.01, 0.2), (0.01, -0.35), (0.55, -0.35)]
    notched = Extrusion(Profile([*slit, (0.55, 0.35), (-0.55, 0.35)]), 0.1)
    assert not list(as_pockets(Part(WALL), Part(notched, (0, 0, -0.15))))
    narrow = Profile([(-0.5, -0.3), (-0.499, -0.3), (0.5, 0.3), (0.499, 0.3)])
    wall = Part(Extrusion(Profile(WALL.profile.outline, [narrow.outline]), 0.4))
    assert not list(as_pockets(wall, Part(Box((0.5, 0.5, 0.1)), (0, 0, -0.15))))
    assert list(as_pockets(wall, Part(Box((1.1, 0.7, 0.1)), (0, 0, -0.15))))


def test_a_floor_in_the_middle_leaves_pockets_above_and_below_of_every_copy() -> None:
    """Of which one may be within another solid; the copies of the floor come in any order."""
    turn, far = Similarity(rotation=(0.0, 0.0, 0.0, 1.0)), Similarity(translation=(2, 0, 0))
    walls = Part(WALL, (1, 0, 0), instances=(turn,))
    floors = Part(Box((1.1, 0.7, 0.1)), (-1, 0, 0.05), instances=(far,))
    found = list(as_pockets(walls, floors))
    assert [len(pockets) for _, pockets, _ in found] == [1, 1, 2]
    body, pockets, _ = found[2]
    made = Assembly((body, *pockets), "difference")
    whole = Assembly((walls, floors))
    points = np.random.default_rng(0).uniform(-1.8, 1.8, (9000, 3)) * [1, 0.5, 0.2]
    assert ((made.distance(points) < 0) == (whole.distance(points) < 0)).all()


def test_pockets_that_are_alike_are_copies_of_one() -> None:
    """Two slots and a notch in a plate, closed by a floor: a pattern, and another pocket."""
    slot = Profile([(0.05, -0.1, 0), (0.05, 0.1, 1), (-0.05, 0.1, 0), (-0.05, -0.1, 1)])
    holes = [slot.moved((x, 0.0)).outline for x in (-0.4, 0.0)]
    holes.append(Profile.polygon([(0.3, -0.1), (0.5, -0.1), (0.4, 0.1)]).outline)
    wall = Part(Extrusion(Profile(Profile.rectangle(1.2, 0.8).outline, holes), 0.4))
    floor = Part(Box((1.2, 0.8, 0.1)), (0, 0, -0.15))
    ((body, pockets, _),) = as_pockets(wall, floor)
    assert sorted(len(pocket.copies) for pocket in pockets) == [1, 2]
    points = np.random.default_rng(0).uniform(-0.7, 0.7, (5000, 3))
    made = Assembly((body, *pockets), "difference").distance(points) < 0
    assert (made == (Assembly((wall, floor)).distance(points) < 0)).mean() > 0.999


def test_a_wall_is_seen_though_a_hole_cuts_the_middle() -> None:
    wall = named_solid(WALL, 1e-3) - named_solid(Cylinder(0.1, 2), 1e-3).rotate((90, 0, 0))
    areas = [one.volume for one in candidates(wall, [np.eye(3)], holes=False)]
    assert max(areas) == pytest.approx(WALL.profile.area * 0.4, rel=2e-3)


def test_a_shaft_is_whole_though_a_hole_crosses_its_axis() -> None:
    shaft = Revolution(Profile([(0, -0.9), (0.2, -0.9), (0.2, 0), (0.15, 0), (0.15, 0.9), (0, 0.9)]))
    drilled = named_solid(shaft, 1e-4) - named_solid(Cylinder(0.05, 2), 1e-4).rotate((90, 0, 0)).translate(
        (0, 0, 0.5)
    )
    turned = [one.part.field for one in candidates(drilled, [np.eye(3)], holes=True)]
    profiles = [f.profile for f in turned if isinstance(f, Revolution)]
    assert any(
        len(p.outline) == 6 and p.area == pytest.approx(shaft.profile.area, rel=1e-3) for p in profiles
    )
    # A groove goes on to the outside, and stays.
    apart = named_solid(shaft, 1e-4) - named_solid(Cylinder(0.5, 0.1), 1e-4).translate((0, 0, 0.5))
    turned = [one.part.field for one in candidates(apart, [np.eye(3)], holes=True)]
    assert all(f.profile.area < 0.97 * shaft.profile.area for f in turned if isinstance(f, Revolution))


def test_a_hole_through_a_round_wall_is_a_cylinder() -> None:
    piece: Manifold = named_solid(Cylinder(0.05, 1), 1e-4).rotate((90, 0, 0)) ^ named_solid(
        Cylinder(0.2, 1), 1e-4
    )
    frame = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]).T
    found = [one.part.field for one in candidates(piece, [frame], holes=True)]
    assert any(isinstance(f, Cylinder) and f.height == pytest.approx(0.4, rel=0.02) for f in found)


def test_volumes_are_those_of_the_pieces() -> None:
    whole = Assembly((Part(WALL), Part(Box((1.1, 0.7, 0.1)), (0, 0, -0.15))))
    ((body, pockets, _),) = as_pockets(*whole.parts)
    made = mesh_assembly(Assembly((body, *pockets), "difference"), 64)
    assert made.volume == pytest.approx(mesh_assembly(whole, 64).volume, rel=1e-6)


@pytest.mark.parametrize("turn", [QUARTER, OVER], ids=["turned", "upside down"])
@pytest.mark.parametrize("cut", [Box((0.4, 0.2, 0.6)), Extrusion(Profile.rectangle(0.4, 0.2, 0.05), 0.6)])
def test_an_opening_with_a_floor_is_a_pocket(turn: tuple, cut: Box | Extrusion) -> None:
    """As deep as the floor leaves it, wherever the floor ends beside it; each copy with one of its own."""
    moves = (Similarity(translation=(0.6, 0, 0)),)
    floor = Part(Box((0.3, 0.6, 0.2)), (0, 0, 0.2), QUARTER, instances=moves)
    opening, lid = (part.transformed(_turn(turn)) for part in (Part(cut, instances=moves), floor))
    (pocket,) = closed_by(opening, lid)
    plate = Part(Box((1.4, 0.5, 0.5))).transformed(_turn(turn))
    points = np.random.default_rng(0).uniform(-1, 1, (9000, 3))
    filled = Assembly((Assembly((plate, opening), "difference"), lid)).distance(points) < 0
    drawn = Assembly((Assembly((plate, pocket), "difference"), lid)).distance(points) < 0
    assert (filled == drawn).all()
    depth = pocket.field.size[2] if isinstance(pocket.field, Box) else pocket.field.height
    assert depth == pytest.approx(0.4)
    assert len(pocket.copies) == 2


@pytest.mark.parametrize(
    "floor",
    [
        Part(Box((0.3, 0.6, 0.2)), (0, 0, -0.25)),  # closes a part of it
        Part(Box((0.5, 0.5, 0.1)), (0, 0, 0)),  # between its ends
        Part(Box((0.5, 0.5, 0.7))),  # fills it
    ],
)
def test_openings_without_a_floor_stay(floor: Part) -> None:
    assert not list(closed_by(Part(Box((0.4, 0.2, 0.6))), floor))
