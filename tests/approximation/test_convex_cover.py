"""Convex covers: they cover, they are few, and what they add keeps the limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import Manifold, OpType

from partwright.approximation.balanced_hull import balanced_hulls
from partwright.approximation.convex_cover import convex_cover, simplified
from partwright.approximation.convex_piece import Limits, Piece
from partwright.approximation.cutting_planes import Corners, moved
from partwright.approximation.half_space import Surface
from partwright.approximation.hull_faces import faces_of
from partwright.approximation.light_hull import light_hull, plain_hull

SEGMENTS = 96


def union(solids: list[Manifold]) -> Manifold:
    return Manifold.batch_boolean(solids, OpType.Add)


def corners_of(solid: Manifold) -> np.ndarray:
    return np.asarray(solid.to_mesh64().vert_properties)[:, :3]


def box(*bounds: float) -> Manifold:
    lower, upper = np.array(bounds[:3]), np.array(bounds[3:])
    return Manifold.cube(tuple(upper - lower)).translate(tuple(lower))


def hollow_box() -> Manifold:
    return box(0, 0, 0, 3, 2, 1) - box(0.2, 0.2, -1, 2.8, 1.8, 2)


@pytest.mark.parametrize(
    ("solid", "count"),
    [
        (box(0, 0, 0, 3, 2, 1).rotate((10, 20, 30)), 1),
        (union([box(0, 0, 0, 2, 1, 1), box(0, 0, 0, 1, 2, 1)]), 2),
        (union([box(0, 0, 0, 3, 1, 1), box(1, -1, 0, 2, 2, 1)]).rotate((0, 0, 30)), 3),
        (hollow_box(), 4),
        (union([box(0, 0, 0, 1, 1, 1), box(3, 0, 0, 4, 1, 1)]), 2),
    ],
)
def test_what_is_made_of_boxes_is_that_many_pieces_and_exact(solid: Manifold, count: int) -> None:
    pieces = convex_cover(solid, Limits(0.05))
    assert len(pieces) == count
    assert sum(piece.hull.volume() for piece in pieces) == pytest.approx(solid.volume(), rel=1e-6)


@pytest.mark.parametrize("turn", [(0, 0, 0), (10, 20, 30)])
def test_an_open_box_is_its_walls_and_floor(turn: tuple[float, float, float]) -> None:
    """No two cuts of it gain anything."""
    solid = (hollow_box() + box(0, 0, -0.2, 3, 2, 0)).rotate(turn)
    pieces = convex_cover(solid, Limits(0.05))
    assert len(pieces) == 5
    assert sum(piece.extra for piece in pieces) < 0.01 * solid.volume()


def test_an_open_box_of_two_rooms_has_one_wall_more() -> None:
    rooms = [box(x, 0.2, 0.1, x + 1.2, 1.8, 2) for x in (0.2, 1.6)]
    pieces = convex_cover(box(0, 0, 0, 3, 2, 1) - union(rooms), Limits(0.05))
    assert len(pieces) == 6
    assert sum(piece.extra for piece in pieces) < 1e-6


@pytest.mark.parametrize("deviation", [0.1, 0.04])
def test_a_ring_is_as_many_pieces_as_its_chords_ask_for(deviation: float) -> None:
    """A chord over an angle a of a circle of radius r is r (1 - cos a/2) from it: no cut gains anything
    alone."""
    ring = Manifold.cylinder(0.5, 1.0, circular_segments=SEGMENTS) - Manifold.cylinder(
        2, 0.8, circular_segments=SEGMENTS, center=True
    )
    pieces = convex_cover(ring, Limits(deviation, extra=1.0))
    least = math.ceil(math.pi / math.acos(1 - deviation / 0.8))
    assert least <= len(pieces) <= 2 * least
    assert all(piece.within(deviation) for piece in pieces)


def test_pieces_are_spent_where_they_save_most() -> None:
    """A chord over half the angle adds an eighth: two pieces for one save three quarters of what it adds."""
    outer = Manifold.cylinder(0.5, 1.0, circular_segments=SEGMENTS)
    ring = outer - Manifold.cylinder(2, 0.6, circular_segments=SEGMENTS, center=True)
    few, saving, more, plain = (
        convex_cover(solid, Limits(1.0, extra=0.3, most=16, worth=worth))
        for solid, worth in ((ring, None), (ring, 2.0), (ring, 0.5), (outer, 0.5))
    )
    assert len(few) == len(saving) < len(more) == 16
    assert sum(piece.extra for piece in more) < 0.1 * sum(piece.extra for piece in few)
    assert len(plain) == 1


def test_many_pieces_have_to_save_more_where_no_tolerance_was_given() -> None:
    """Chords of a fine ring deviate more than allowed in 32 pieces, too; more hardly save any volume."""
    outer = Manifold.cylinder(0.5, 1.0, circular_segments=192)
    ring = outer - Manifold.cylinder(2, 0.9, circular_segments=192, center=True)
    asked, free = (convex_cover(ring, Limits(1e-3, extra=0.3, most=64, worth=w)) for w in (None, 0.7))
    assert len(free) < 40 < len(asked)


def test_what_is_searched_is_as_fine_as_few_triangles_allow() -> None:
    """A bore is not filled up by chords that would count as pieces' own."""
    drilled = box(0, 0, 0, 3, 2, 1) - Manifold.cylinder(3, 0.3, circular_segments=96).translate((1, 1, -1))
    noisy = Manifold.sphere(1.0, 400)
    assert noisy.num_tri() > 20_000
    assert simplified(drilled, 0.3).volume() == pytest.approx(drilled.volume(), rel=1e-4)
    few = simplified(noisy, 0.3)
    assert few.num_tri() < noisy.num_tri() / 2
    assert few.volume() == pytest.approx(noisy.volume(), rel=5e-3)


def test_limits_are_kept_and_hulls_cover() -> None:
    solid = union([Manifold.sphere(1.0, 48), Manifold.cylinder(3, 0.4, circular_segments=48, center=True)])
    loose, tight = (convex_cover(solid, Limits(0.2, extra)) for extra in (0.2, 0.03))
    assert len(loose) <= len(tight)
    for pieces, extra in ((loose, 0.2), (tight, 0.03)):
        assert sum(piece.extra for piece in pieces) <= extra * solid.volume() * (1 + 1e-6)
        hulls = [piece.hull for piece in pieces]
        assert (solid - union(hulls)).volume() < 3e-3 * solid.volume()


def test_a_speck_far_from_all_else_is_covered_and_one_beside_it_is_not() -> None:
    speck = box(3, 0, 0, 3.01, 0.01, 0.05)  # 5e-7 of the volume, 2 away
    for place, count in ((0.0, 2), (-1.97, 1)):
        body = union([box(0, 0, 0, 1, 2, 5), speck.translate((place, 0, 0))])
        assert len(body.decompose()) == 2
        pieces = convex_cover(body, Limits(0.05, most=8))
        assert len(pieces) == count
    body = union([box(0, 0, 0, 1, 2, 5), speck])
    assert (body - union([piece.hull for piece in convex_cover(body, Limits(0.05))])).volume() < 1e-9


def test_no_more_pieces_than_asked_for() -> None:
    pieces = convex_cover(hollow_box(), Limits(0.05, most=2))
    assert len(pieces) == 2
    assert (hollow_box() - union([piece.hull for piece in pieces])).volume() < 1e-9


def test_a_hull_that_no_plainer_one_holds_stays_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """As rounding has it of slivers."""
    ball = Manifold.sphere(1.0, 24)
    assert plain_hull(ball).volume() == pytest.approx(ball.volume(), rel=1e-3)
    monkeypatch.setattr("partwright.approximation.light_hull._PLAIN", -1e-3)
    assert plain_hull(ball) is ball


def test_a_light_hull_says_what_it_loses() -> None:
    ball = Manifold.sphere(1.0, 64)
    light, beyond = light_hull(ball, 0.05)
    assert light.num_vert() < ball.num_vert() / 3
    assert 0 < beyond <= 0.05
    normals, offsets = faces_of(light)
    assert (corners_of(ball) @ normals.T - offsets).max() == pytest.approx(beyond)
    assert (light - ball).volume() < 1e-9
    assert light_hull(ball, 0.0, most=20)[0].num_vert() <= 20


@pytest.mark.parametrize("wall", [0.3, 0.02])
def test_a_balanced_hull_is_nearer_than_the_hull_and_keeps_what_it_stands_for(wall: float) -> None:
    """Half a bowl: its hull is filled, and moved inwards without end it would be gone."""
    bowl = (Manifold.sphere(1.0, 48) - Manifold.sphere(1 - wall, 48)).trim_by_plane((0, 0, -1), 0)
    piece = Piece(bowl)
    (balanced,) = balanced_hulls([piece], bowl, 0.9)

    def apart(solid: Manifold) -> float:
        return (solid - bowl).volume() + (bowl - solid).volume()

    assert apart(balanced) <= (0.8 if wall < 0.1 else 1.0) * apart(piece.hull)
    assert (bowl ^ balanced).volume() >= 0.5 * bowl.volume()
    brick = box(0, 0, 0, 1, 2, 3)
    assert balanced_hulls([Piece(brick)], brick, 0.9)[0].volume() == pytest.approx(6.0)


def test_a_notch_is_balanced_to_what_the_best_plane_leaves() -> None:
    """An L: its hull fills the corner, and a plane parallel to that chord lies best below it."""
    shape = union([box(0, 0, 0, 3, 1, 1), box(0, 0, 0, 1, 3, 1)])
    (balanced,) = balanced_hulls([Piece(shape)], shape, 2.0)
    normal = np.array([1, 1, 0]) / math.sqrt(2)
    tried = [
        shape.hull().trim_by_plane(tuple(-normal), -offset)
        for offset in np.linspace(1.5, 2 * math.sqrt(2), 200)
    ]

    def apart(solid: Manifold) -> float:
        return (solid - shape).volume() + (shape - solid).volume()

    assert apart(balanced) <= min(map(apart, tried)) * 1.01
    assert apart(balanced) < 0.85 * apart(shape.hull())


def test_what_sticks_out_is_not_cut_off_for_its_little_volume() -> None:
    """A plate with a pin: what its hull adds is a pyramid, and cut off at the plate it would lose but the
    pin. It loses no more of its length than half of the depth that the hull bridges, or than is allowed."""
    shape = union([box(-2, -2, 0, 2, 2, 1), box(-0.1, -0.1, 1, 0.1, 0.1, 3)])
    (cut,) = balanced_hulls([Piece(shape)], shape, 0.1)
    foot, slope = np.array([0.1, 0.1, 1.0]), np.array([2.0, 0.0, 1.9]) / math.hypot(2.0, 1.9)
    depth = float(slope @ (np.array([0.1, 0.1, 3.0]) - foot))
    assert 3 - 0.5 * depth - 1e-6 <= cut.bounding_box()[5] < 2.9
    assert cut.volume() < 0.7 * shape.hull().volume()
    (allowed,) = balanced_hulls([Piece(shape)], shape, 2.0)
    assert allowed.bounding_box()[5] == pytest.approx(1.0)


def test_what_another_hull_has_is_not_lost() -> None:
    """Two halves of an L whose hulls overlap: each may leave to the other what both have."""
    shape = union([box(0, 0, 0, 3, 1, 1), box(0, 0, 0, 1, 3, 1)])
    pieces = [Piece(shape), Piece(box(0, 0, 0, 3, 1, 1))]
    first, second = balanced_hulls(pieces, shape, 3.0)
    assert (shape - union([first, second])).volume() + (first - shape).volume() < 0.3 * pieces[0].extra
    assert second.volume() == pytest.approx(3.0)


def test_volumes_beyond_planes_are_those_of_what_is_cut_off() -> None:
    solid = Manifold.sphere(1.0, 32) - box(0, 0, 0, 1, 1, 1)
    surface, random = Surface.of(solid), np.random.default_rng(0)
    for normal in random.normal(size=(5, 3)):
        normal /= np.linalg.norm(normal)
        offsets = random.uniform(-1.2, 1.2, 4)
        cut = [solid.trim_by_plane(tuple(normal), offset).volume() for offset in offsets]
        np.testing.assert_allclose(surface.beyond(normal, offsets), cut, atol=1e-12)


def test_a_plane_is_moved_to_where_two_boxes_meet() -> None:
    corners = Corners.of(union([box(0, 0, 0, 2, 1, 1), box(2, -2, -2, 3, 3, 3)]))
    start = (np.array([math.cos(0.1), math.sin(0.1), 0.0]), 2.3)
    after, before = corners.hulls([moved(corners, start), start])
    assert after < 0.25 * (before - 27) + 27
    best = np.array([1.0, 0.0, 0.0]), 2.0
    assert moved(corners, best) is best
