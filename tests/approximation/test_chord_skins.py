"""What lies between facets of a round wall and the arc that they stand for, and nothing else, is left out."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold

import partwright as pw
from partwright.approximation.sketches.chord_skins import ChordSkins

CHORDS = 24


def held(body: Manifold, points: np.ndarray) -> np.ndarray:
    """(N,) whether points (N, 3), own units, lie in a skin of a body."""
    mesh = body.to_mesh64()
    shape = pw.load_shape(trimesh.Trimesh(mesh.vert_properties[:, :3], mesh.tri_verts), unit="mm")
    unit = shape.frame.to_unit(points).astype(np.float32)
    return ChordSkins.of(*shape.unit_mesh).hold(unit, *shape.unit_nearest(unit))


def ring(radius: float, within: tuple[float, float], chords: int = CHORDS) -> np.ndarray:
    """Points on the spokes through the middles of chords, at shares of an arc's height over them."""
    angle = (np.arange(chords) + 0.5) * 2 * math.pi / chords
    low = radius * math.cos(math.pi / chords)
    reach = low + np.linspace(*within, chords) * (radius - low)
    return np.column_stack([reach * np.cos(angle), reach * np.sin(angle), np.linspace(-2, 2, chords)])


def test_skins_lie_outside_round_walls_and_within_the_walls_of_holes() -> None:
    body = Manifold.cylinder(6, 10, circular_segments=CHORDS, center=True)
    body -= Manifold.cylinder(8, 4, circular_segments=CHORDS, center=True)
    for radius in (10.0, 4.0):
        assert held(body, ring(radius, (0.05, 1.0))).all()
        assert not held(body, ring(radius, (1.3, 3.0))).any()
        assert not held(body, ring(radius, (-3.0, -0.05))).any()


def corner(chords: int) -> tuple[Manifold, np.ndarray]:
    """A plate with one corner of that many chords, and points half way up over the middle of each."""
    angle = np.linspace(0, math.pi / 2, chords + 1)
    arc = np.column_stack([8 + 2 * np.cos(angle), 8 + 2 * np.sin(angle)])
    body = Manifold.extrude(CrossSection([[[-10, -10], [10, -10], *arc.tolist(), [-10, 10]]]), 4)
    middle = (angle[1:] + angle[:-1]) / 2
    reach = 2 * (1 + math.cos(math.pi / 4 / chords)) / 2
    points = [8 + reach * np.cos(middle), 8 + reach * np.sin(middle), np.full(chords, 2.0)]
    return body, np.column_stack(points)


def test_half_a_turn_at_either_end_of_an_arc_belongs_to_it() -> None:
    """The first and the last chord of a rounded corner turn off the walls by half as much."""
    assert held(*corner(4)).all()


def test_three_sides_are_no_arc() -> None:
    """Any that turn alike lie on a circle."""
    assert not held(*corner(3)).any()
    roof = [[-10, 0], [10, 0], [10, 3], [4, 6], [-4, 6], [-10, 3]]
    body = Manifold.extrude(CrossSection([roof]), 4)
    assert not held(body, np.array([[0.0, 6.2, 2.0], [7.1, 4.65, 2.0]])).any()


@pytest.mark.parametrize("chords", [4, 6, 8])
def test_polygons_have_none(chords: int) -> None:
    body = Manifold.cylinder(6, 10, circular_segments=chords, center=True)
    assert not held(body, ring(10.0, (0.05, 1.0), chords)).any()


def test_a_bevel_has_none() -> None:
    """It turns by 30 degrees on both sides, as a chord would, but is the only one."""
    corners = [[-10, -10], [10, -10], [10, 0], [9, 1.7320508], [-10, 12.7]]
    body = Manifold.extrude(CrossSection([corners]), 4)
    assert not held(body, np.array([[9.52, 0.88, 2.0], [9.57, 0.9, 2.0]])).any()
