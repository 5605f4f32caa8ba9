"""Outlines, directions and holes read off closed surfaces."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from partwright.approximation.sketches.candidates import candidates
from partwright.approximation.sketches.directions import frames, long_axis
from partwright.approximation.sketches.holes import holes_apart, is_empty, merged_holes
from partwright.approximation.sketches.outlines import fitted_loop
from partwright.approximation.sketches.sections import profile_of
from partwright.approximation.sketches.tangents import with_tangents
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Revolution, Tube
from partwright.fields.profile import Profile, circle, circle_of
from partwright.meshing.named_solids import named_solid

TOLERANCE = 4e-4


def chords(profile: Profile, count: int) -> np.ndarray:
    """Corners (K, 2) of the outline with `count` chords an arc."""
    found = []
    for side in profile.sides[0]:
        if side.centre is None:
            found.append(side.start)
            continue
        x, y = np.subtract(side.start, side.centre)
        for angle in np.arange(count) * side.sweep / count:
            c, s = math.cos(angle), math.sin(angle)
            found.append((side.centre[0] + c * x - s * y, side.centre[1] + s * x + c * y))
    return np.array(found)


@pytest.mark.parametrize("count", [2, 3, 8, 20])
@pytest.mark.parametrize("shift", [0, 1, 5])
def test_a_rounded_rectangle_is_four_lines_and_four_arcs(count: int, shift: int) -> None:
    polygon = np.roll(chords(Profile.rectangle(1.0, 0.6, corner=0.15), count), shift, axis=0)
    loop = fitted_loop(polygon, TOLERANCE)
    assert loop is not None
    sides = Profile(loop).sides[0]
    assert sorted(side.centre is not None for side in sides) == [False] * 4 + [True] * 4
    assert [s.radius for s in sides if s.centre is not None] == pytest.approx([0.15] * 4, abs=1e-9)


@pytest.mark.parametrize("sides", [3, 4, 6, 8])
def test_a_regular_polygon_stays_one(sides: int) -> None:
    loop = fitted_loop(np.array(Profile.regular(sides, 0.5).outline)[:, :2], TOLERANCE)
    assert loop is not None
    assert len(loop) == sides
    assert not any(bulge for _, _, bulge in loop)


@pytest.mark.parametrize("count", [9, 12, 64])
def test_a_circle_is_one(count: int) -> None:
    loop = fitted_loop(np.array(Profile.regular(count, 0.5).outline)[:, :2] + (0.1, 0.2), TOLERANCE)
    assert loop is not None
    found = circle_of(loop)
    assert found is not None
    radius, centre = found
    assert (radius, *centre) == pytest.approx((0.5, 0.1, 0.2), abs=1e-9)


def test_corners_within_a_wall_are_no_corners() -> None:
    square = np.array([(0, 0), (0.3, 1e-6), (1, 0), (1, 0.5), (1, 1), (0, 1)])
    loop = fitted_loop(square, TOLERANCE)
    assert loop is not None
    assert len(loop) == 4


def test_walls_of_a_slot_are_lines_though_a_corner_of_the_mesh_lies_within_them() -> None:
    turns = np.linspace(-0.5, 0.5, 64) * math.pi
    half = np.column_stack([0.063 + 0.081 * np.cos(turns), 0.081 * np.sin(turns)])
    middle = np.array([[0.0, 0.081 + 5e-7]])  # as in single precision
    points = np.concatenate([half, middle, -half, -middle])
    loop = fitted_loop(points, TOLERANCE)
    assert loop is not None
    assert sorted(round(abs(bulge), 3) for _, _, bulge in loop) == [0.0, 0.0, 1.0, 1.0]


def test_an_arc_begins_where_the_line_is_tangent_to_it() -> None:
    """In vents of a lid, one chord of an end counted as part of the wall."""
    lean = math.radians(3)
    x, y = 0.02 * math.cos(lean), 0.2 + 0.02 * math.sin(lean)
    bulge = math.tan((math.pi - lean) / 4)
    off = Profile([(0.02, -0.2), (x, y, bulge), (-0.02, 0.2), (-0.02, -0.2, 1.0)])
    exact = with_tangents(off, TOLERANCE)
    assert exact.corners == pytest.approx(
        np.array([(0.02, -0.2, 0.0), (0.02, 0.2, 1.0), (-0.02, 0.2, 0.0), (-0.02, -0.2, 1.0)]), abs=1e-4
    )
    corner = Profile([(0.02, -0.2), (0.02, 0.2, 0.8), (-0.02, 0.2), (-0.02, -0.2, 1.0)])
    assert with_tangents(corner, TOLERANCE) is corner
    drawn = Profile([(0.02, -0.2), (0.02, 0.2, 1.0), (-0.02, 0.2), (-0.02, -0.2, 1.0)])
    assert with_tangents(drawn, TOLERANCE) is drawn


def test_what_is_flat_is_no_outline() -> None:
    assert fitted_loop(np.array([(0, 0), (1e-6, 0), (0, 1e-6)]), TOLERANCE) is None


def test_a_hole_that_touches_the_outline_is_a_hole() -> None:
    ring = CrossSection([[(0, 0), (1, 0), (1, 1), (0.5, 1), (0.8, 0.5), (0.2, 0.5), (0.5, 1), (0, 1)]])
    profile = profile_of(ring)
    assert profile is not None
    assert [len(loop) for loop in profile.loops] == [5, 3]
    assert profile.area == pytest.approx(1 - 0.15, abs=2e-3)


def test_an_arc_that_nearly_ends_a_sphere_on_the_axis_does() -> None:
    quarter = math.tan(math.pi / 8)
    dome = Profile([(0, -0.5), (0.5, -0.5), (0.5, 0, quarter + 1e-3), (0, 0.5)])
    body = named_solid(Revolution(dome), 1e-5)
    found = [c.part.field for c in candidates(body, [np.eye(3)], holes=True)]
    bullet = next(field for field in found if isinstance(field, Revolution))
    (arc,) = (side for side in bullet.profile.sides[0] if side.centre is not None)
    assert arc.centre[0] == pytest.approx(0, abs=1e-9)
    assert arc.radius == pytest.approx(0.5, abs=2e-3)


def pipe() -> Manifold:
    """A thin pipe with a bend of a quarter turn between straight ends along y and z."""
    bend = named_solid(Revolution(Profile(circle(0.2, (0.5, 0)), (circle(0.17, (0.5, 0)),)), 90.0), 1e-3)
    straight = named_solid(Extrusion(Profile(circle(0.2), (circle(0.17),)), 0.8), 1e-3)
    bend = bend.rotate((90, 0, 90))  # about x, from y = 0.5 to z = 0.5
    return bend + straight.translate((0, 0.5, -0.4)) + straight.rotate((90, 0, 0)).translate((0, -0.4, 0.5))


def test_a_bent_pipe_is_two_tubes_and_a_bend() -> None:
    body = pipe()
    assert len(body.decompose()) == 1
    mesh = body.to_mesh64()
    found = frames(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))
    parts = [one.part for one in candidates(body, found, holes=True)]
    bends = [p.field for p in parts if isinstance(p.field, Revolution) and len(p.field.profile.holes) == 1]
    assert any(bend.angle == pytest.approx(90, abs=15) for bend in bends)
    tubes = [p.field for p in parts if isinstance(p.field, Tube)]
    assert [tube.height for tube in tubes] == pytest.approx([0.8, 0.8], abs=0.01)


def test_directions_of_a_turned_part_begin_with_its_axis() -> None:
    body = named_solid(Revolution(Profile([(0.2, 0), (0.6, 0), (0.6, 0.2), (0.2, 0.8)])), 1e-3)
    turned = body.rotate((30, 40, 0))
    mesh = turned.to_mesh64()
    found = frames(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))
    tip = named_solid(Cylinder(0.01, 1.0), 1e-3).rotate((30, 40, 0))
    axis = np.ptp(np.reshape(tip.bounding_box(), (2, 3)), axis=0)
    assert np.abs(found[0][:, 2]) == pytest.approx(axis / np.linalg.norm(axis), abs=0.02)
    for frame in found:
        assert frame.T @ frame == pytest.approx(np.eye(3), abs=1e-9)
        assert np.linalg.det(frame) == pytest.approx(1.0)


def test_a_plate_with_pockets_is_one_of_its_own_candidates() -> None:
    octagons = [
        tuple((x + px, y, b) for px, y, b in Profile.regular(8, 0.12).outline) for x in (-0.5, 0.0, 0.5)
    ]
    wanted = Profile(Profile.rectangle(1.6, 0.6, corner=0.1).outline, tuple(octagons))
    body = named_solid(Extrusion(wanted, 0.1), 1e-4)
    found = candidates(body, [np.eye(3)], holes=True)
    parts = [one.part.field for one in found if isinstance(one.part.field, Extrusion)]
    best = max(parts, key=lambda field: len(field.profile.holes))
    assert best.height == pytest.approx(0.1, abs=1e-6)
    assert [len(loop) for loop in best.profile.loops] == [8, 8, 8, 8]
    assert best.profile.area == pytest.approx(wanted.area, rel=1e-4)


def test_a_knob_is_turned() -> None:
    outline = [(0, 0), (0.5, 0), (0.5, 0.2), (0.2, 0.3), (0.2, 0.8), (0, 0.8)]
    body = named_solid(Revolution(Profile(outline)), 1e-4).translate((0.1, 0.2, 0.0))
    found = [c.part for c in candidates(body, [np.eye(3)], holes=True)]
    knob = next(part for part in found if isinstance(part.field, Revolution))
    assert knob.field.profile.area == pytest.approx(Profile(outline).area, rel=2e-3)
    assert knob.translation[:2] == pytest.approx((0.1, 0.2), abs=1e-3)


def on_the_axis(body: Manifold) -> set[float]:
    """How much of the axis each candidate that is turned about z covers."""
    found = [c.part for c in candidates(body, [np.eye(3)], holes=True)]
    heights = np.column_stack([np.full(400, 1e-4), np.zeros(400), np.linspace(-1, 1, 400)])
    turned = [part for part in found if isinstance(part.field, Cylinder | Revolution)]
    return {round(float((part.distance(heights) < 0).mean()), 1) for part in turned}


def test_a_hole_across_a_shaft_leaves_no_dent_and_a_cavity_stays() -> None:
    shaft = Manifold.cylinder(1.6, 0.3, circular_segments=48, center=True)
    hole = Manifold.cylinder(2.0, 0.16, circular_segments=32, center=True).rotate((90, 0, 8))
    cavity = Manifold.sphere(0.16, 48)
    whole, dented = 0.8, 0.6
    assert whole in on_the_axis(shaft - hole)
    assert dented not in on_the_axis(shaft - hole)
    assert on_the_axis(shaft - cavity) == {whole, dented}


def test_a_thread_is_turned_at_its_mean_diameter() -> None:
    """A disc with an eccentric hub, twisted many times, is as a thread: any half section is between two."""
    rounds, steps, out = 6, 240, 0.03
    circle_ = CrossSection.circle(0.4, 48).translate((out, 0.0))
    thread = Manifold.extrude(circle_, 1.2, steps, 360.0 * rounds).translate((0, 0, -0.6))
    found = [c.part.field for c in candidates(thread, [np.eye(3)], holes=True)]
    radii = [max(x for x, _, _ in f.profile.outline) for f in found if isinstance(f, Revolution)]
    radii += [f.radius for f in found if isinstance(f, Cylinder)]
    assert min(abs(radius - 0.4) for radius in radii) < 0.005


def test_a_twisted_gear_is_also_a_disc() -> None:
    outline = [
        ((0.55 if k % 4 < 2 else 0.7) * math.cos(a), (0.55 if k % 4 < 2 else 0.7) * math.sin(a))
        for k, a in enumerate(np.arange(68) * (2 * math.pi / 68))
    ]
    gear = Manifold.extrude(CrossSection([outline]), 0.4, 20, 12.0)  # twisted: no section goes on
    found = [c.part for c in candidates(gear, [np.eye(3)], holes=True)]
    widths = [part.bounds()[1][0] for part in found if isinstance(part.field, Cylinder | Revolution)]
    assert max(widths) == pytest.approx(0.7, abs=0.01)


def test_a_long_piece_has_its_own_direction() -> None:
    bar = Manifold.cube((0.1, 0.12, 1.0), True).rotate((20, 0, 0))
    mesh = bar.to_mesh64()
    frame = long_axis(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))
    assert frame is not None
    assert abs(frame[:, 2] @ [0, -math.sin(math.radians(20)), math.cos(math.radians(20))]) > 0.9999
    cube = Manifold.cube((1.0, 1.0, 1.2), True).to_mesh64()
    assert long_axis(np.asarray(cube.vert_properties)[:, :3], np.asarray(cube.tri_verts, np.int64)) is None


def test_round_holes_come_apart_by_size() -> None:
    holes = [
        circle(0.1, (-0.5, 0)),
        circle(0.1, (0.5, 0)),
        circle(0.2),
        Profile.regular(6, 0.1).moved((0, 0.3)).outline,
    ]
    profile = Profile(Profile.rectangle(1.6, 1.0).outline, tuple(holes))
    turned = Similarity(rotation=(math.cos(0.3), 0.0, math.sin(0.3), 0.0), translation=(0.1, 0.2, 0.3))
    plate = Part(Extrusion(profile, 0.2), name="plate").transformed(turned)
    body, cuts = holes_apart(plate)
    assert isinstance(body.field, Extrusion)
    assert len(body.field.profile.holes) == 1
    assert sorted((round(cut.field.radius, 9), len(cut.copies)) for cut in cuts) == [(0.1, 2), (0.2, 1)]
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    inside = body.distance(points) < 0
    for cut in cuts:
        inside &= cut.distance(points) > 0
    assert (inside == (plate.distance(points) < 0)).all()


def test_holes_of_one_form_are_drawn_once() -> None:
    slot = Profile([(-0.2, -0.05, 0), (0.2, -0.05, 1), (0.2, 0.05, 0), (-0.2, 0.05, 1)])
    odd = Profile([(-0.1, 0.3), (0.1, 0.3), (0, 0.4)])
    rolled = Profile((*slot.outline[2:], *slot.outline[:2])).moved((0, -0.2))
    holes = (slot.outline, slot.moved((0.1, 0.15)).outline, rolled.outline, odd.outline)
    plate = Part(Extrusion(Profile(Profile.rectangle(1.6, 1.0).outline, holes), 0.2), (0.1, 0, 0))
    body, (cut,) = holes_apart(plate)
    assert [len(loop) for loop in body.field.profile.loops] == [4, 3]
    assert len(cut.copies) == 3
    points = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)
    inside = (body.distance(points) < 0) & (cut.distance(points) > 0)
    assert (inside == (plate.distance(points) < 0)).all()


def test_a_plate_with_one_round_hole_is_a_box() -> None:
    body, (hole,) = holes_apart(
        Part(Extrusion(Profile(Profile.rectangle(1.0, 0.6).outline, (circle(0.1),)), 0.2))
    )
    assert body.field == Box((1.0, 0.6, 0.2))
    assert hole.field.radius == pytest.approx(0.1)


def test_nothing_has_no_candidates() -> None:
    assert candidates(Manifold(), [np.eye(3)], holes=True) == []


def test_a_bend_is_turned_as_far_as_it_goes() -> None:
    bend = Part(Revolution(Profile.circle(0.1, (0.6, 0.0)), 120.0), (0.1, 0.0, 0.0))
    body = named_solid(bend.field, 1e-4).translate((0.1, 0.0, 0.0))
    found = [c for c in candidates(body, [np.eye(3)], holes=True) if isinstance(c.part.field, Revolution)]
    best = min(found, key=lambda c: abs(c.part.field.angle - 120))
    assert best.part.field.angle == pytest.approx(120, abs=0.3)
    points = np.random.default_rng(0).uniform(-0.8, 0.8, (4000, 3)).astype(np.float32)
    assert ((best.part.distance(points) < 0) == (bend.distance(points) < 0)).mean() > 0.999
    inner, outer = best.bodies
    assert inner.volume() < body.volume() < outer.volume()


def test_a_bend_ends_where_straight_rods_begin() -> None:
    """It goes over into them without an edge, and no face looks along its axis but between two facets."""
    ring = CrossSection.circle(6, 48).translate((20, 0)).revolve(96, 180).rotate((90, 0, 0))
    legs = Manifold.cylinder(40, 6, circular_segments=48) + Manifold.cylinder(
        60, 6, circular_segments=48
    ).translate((40, 0, -20))
    flange = Manifold.cylinder(4, 14, circular_segments=48)
    body = (ring.translate((20, 0, 40)) + legs + flange).scale((0.02, 0.02, 0.02))
    mesh = body.to_mesh64()
    found = frames(np.asarray(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts, np.int64))
    assert any(np.abs(frame[:, 2]) @ (0, 1, 0) > 1 - 1e-9 for frame in found)
    bends = [
        one.part.field
        for one in candidates(body, found, holes=True)
        if isinstance(one.part.field, Revolution) and len(one.part.field.profile.corners) == 2
    ]
    assert 180.0 in [pytest.approx(bend.angle, abs=0.1) for bend in bends if not bend.full]


def test_a_hub_with_ribs_a_keyway_and_bolt_holes_is_turned_all_around() -> None:
    """They leave little that all half sections have; what most have is the hub without them."""
    hub = Manifold.cylinder(8, 40, circular_segments=64) + Manifold.cylinder(40, 18, circular_segments=64)
    rib = CrossSection([[(16, 8), (38, 8), (16, 32)]]).extrude(6).translate((0, 0, -3)).rotate((90, 0, 0))
    for k in range(3):
        hub = hub + rib.rotate((0, 0, 120 * k))
    hub = hub - Manifold.cylinder(50, 10, circular_segments=64).translate((0, 0, -5))
    for k in range(6):
        angle = math.radians(60 * k + 30)
        hole = Manifold.cylinder(20, 3.3, circular_segments=64)
        hub = hub - hole.translate((32 * math.cos(angle), 32 * math.sin(angle), -5))
    hub = hub - Manifold.cube((4, 8, 60), center=True).translate((0, 10, 20))
    own = candidates(hub.scale((0.0225,) * 3), [np.eye(3)], holes=True)
    usual = [one for one in own if one.usual]
    plain = Profile.polygon([(10, 0), (40, 0), (40, 8), (18, 8), (18, 40), (10, 40)])
    assert [one.part.field.full for one in usual if isinstance(one.part.field, Revolution)] == [True]
    assert usual[0].part.field.profile.area == pytest.approx(plain.area * 0.0225**2, rel=0.01)


def test_a_rod_ends_where_it_bends_though_faces_of_other_parts_lie_across_it() -> None:
    """A rod that is straight from x = -0.6 to 0.4, bends there, and has a rib across at x = 0."""
    rod = named_solid(Cylinder(0.08, 1.0), 1e-4).rotate((0, 90, 0)).translate((-0.1, 0, 0))
    bend = named_solid(Revolution(Profile.circle(0.08, (0.4, 0.0)), 120.0), 1e-4)  # about z, from angle 0
    bend = bend.rotate((0, 0, 30)).translate((0.4, -0.4, 0))
    rib = named_solid(Box((0.1, 0.4, 0.1)), 1e-4).translate((0, -0.2, 0))
    along_x = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    parts = [one.part for one in candidates(rod + bend + rib, [along_x], holes=True)]
    rods = [
        p for p in parts if isinstance(p.field, Cylinder) and p.field.radius == pytest.approx(0.08, rel=0.01)
    ]
    ends = [part.bounds()[:, 0].tolist() for part in rods]
    assert any(end == pytest.approx([-0.6, 0.4], abs=0.04) for end in ends)


def test_a_bore_through_two_walls_is_one_and_bolt_holes_are_copies() -> None:
    walls = Part(Box((0.1, 1.0, 1.0)), (-0.4, 0, 0), instances=(Similarity(translation=(0.8, 0, 0)),))
    across = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    bores = [Part(Cylinder(0.2, 0.1), (x, 0, 0), across) for x in (-0.4, 0.4)]
    bolts = [Part(Cylinder(0.05, 0.1), (-0.4, y, 0.3), across) for y in (-0.3, 0.3)]
    tree = Assembly((walls, *bores, *bolts), "difference")
    assert all(is_empty(hole, tree.distance) for hole in (*bores, *bolts))
    assert not is_empty(bores[0], walls.distance)
    bore, bolt = merged_holes([*bores, *bolts], tree.distance)
    assert bore.field.height == pytest.approx(0.9)
    assert bore.translation == pytest.approx((0, 0, 0))
    assert len(bolt.copies) == 2
    assert bolt.field.height == pytest.approx(0.1)
    blocked = (tree | Part(Box((0.1, 1.0, 1.0)))).distance
    assert [len(hole.copies) for hole in merged_holes(bores, blocked)] == [2]
    pairs = [Part(Cylinder(0.05, 0.1), (x, y, 0.3), across) for x in (-0.4, 0.4) for y in (-0.3, 0.3)]
    bolted = Assembly((walls, *pairs), "difference")
    in_the_way = bolted | Part(Box((0.1, 0.5, 1.0)), (0, 0.25, 0))  # of one pair
    assert [len(hole.copies) for hole in merged_holes(pairs, bolted.distance)] == [2]
    assert [len(hole.copies) for hole in merged_holes(pairs, in_the_way.distance)] == [4]


def test_holes_that_were_turned_copies_of_one_are_one() -> None:
    """Three set screws in a round wall point three ways; four are two bores through it."""
    wall = Part(Tube(0.6, 0.1, 1.0))
    across = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)
    for count, bores, height in ((3, 3, 0.2), (4, 2, 1.3)):
        turns = tuple(Similarity.turn((0, 0, 1), 2 * math.pi * k / count) for k in range(1, count))
        screw = Part(Cylinder(0.05, 0.2), (0.55, 0.0, 0.1), across, instances=turns)
        (hole,) = merged_holes([screw], Assembly((wall, screw), "difference").distance)
        assert len(hole.copies) == bores
        assert hole.field.height == pytest.approx(height)
        assert {move.rotation for move in hole.instances} <= {move.rotation for move in turns}


def test_what_stands_on_a_flat_end_of_a_turned_body_is_not_parted_from_it() -> None:
    """Chords are off along the radius only: around the body there is no skin over its flat ends."""
    disc = Manifold.cylinder(0.2, 0.9, 0.9, 64) + Manifold.cylinder(0.6, 0.3, 0.3, 64)
    blade = Manifold.cube((0.3, 0.05, 0.3)).translate((0.45, 0, 0.1))
    found = candidates(disc + blade, [np.eye(3)], holes=False)
    volume = math.pi * (0.9**2 * 0.2 + 0.3**2 * 0.4)
    all_turned = (c for c in found if isinstance(c.part.field, Revolution))
    turned = min(all_turned, key=lambda c: abs(c.bodies[0].volume() - volume))
    left = (disc + blade) - turned.bodies[1]
    low, high = np.reshape(left.bounding_box(), (2, 3))
    assert low[2] == pytest.approx(0.2, abs=1e-5)
    assert high[2] == pytest.approx(0.4, abs=1e-5)


def test_letters_in_a_wall_are_no_corners_of_its_outline() -> None:
    """Each row of them was an outline of its own, extruded through all of it: letters came as stripes."""
    bar = named_solid(Box((1.6, 0.4, 0.5)), 1e-3)
    letter = named_solid(Tube(0.06, 0.02, 0.04), 1e-3).rotate((90, 0, 0))
    for x in np.linspace(-0.6, 0.6, 5).tolist():
        for z in (-0.2, 0.0, 0.2):
            bar -= letter.translate((x, -0.2, z))
    found = candidates(bar, [np.eye(3)], holes=False)
    assert max(one.sides for one in found) > 40
    assert any(
        np.allclose(np.ptp(one.part.bounds(), axis=0), (1.6, 0.4, 0.5)) and one.sides == 4 for one in found
    )
