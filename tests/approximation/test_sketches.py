"""Directions and candidates read off closed surfaces."""

from __future__ import annotations

import math

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold

from partwright.approximation.sketches.candidates import candidates
from partwright.approximation.sketches.directions import frames, long_axis
from partwright.assembly import Part
from partwright.fields import Box, Cylinder, Extrusion, Revolution, Tube
from partwright.fields.profile import Profile, circle
from partwright.meshing.named_solids import named_solid


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


def test_a_port_at_the_height_of_a_pockets_middle_is_none_of_its_outline() -> None:
    """Of what is too much, pocket and port together: seen from above the port's middle makes it wider."""
    pocket = Manifold.cube((100, 60, 20), center=True)
    port = Manifold.cylinder(12, 6, circular_segments=48, center=True).rotate((90, 0, 0))
    found = candidates((pocket + port.translate((0, 33, 0))).scale((0.018,) * 3), [np.eye(3)], holes=True)
    boxes = [one.part.field.size for one in found if isinstance(one.part.field, Box)]
    assert any(size == pytest.approx((1.8, 1.08, 0.36), abs=1e-3) for size in boxes)
