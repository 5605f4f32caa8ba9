"""Pieces that float though the shape is one body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from partwright.methods import Run
from partwright.shapes import load_shape
from partwright.superfrusta.objective import score
from partwright.superfrusta.rejoining import Pieces, necks, rejoined
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded

SETTINGS = Settings(near=4000, uniform=4000)
GAP, RADIUS, NECK = 0.04, 0.44, 0.05
AT = RADIUS + GAP / 2


def dumbbell(neck: bool) -> FitSamples:
    """Two balls, apart along x, and what joins them."""
    balls = [Manifold.sphere(RADIUS, 64).translate((x, 0, 0)) for x in (-AT, AT)]
    body = Manifold.compose(balls)
    rod = Manifold.cylinder(0.3, NECK, NECK, 32, True).rotate((0, 90, 0))
    made = (body + rod if neck else body).to_mesh()
    shape = load_shape(trimesh.Trimesh(np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts)))
    return FitSamples.of(shape, SETTINGS, Run(threads=1))


def ball(x: float, blend: float = 0.0) -> RepeatedPart:
    """In the unit frame, whose longest side is 1.8; round, of a length that may grow."""
    scale = 0.9 / (AT + RADIUS)
    size = [0.02, 0.02, 0.02, 1, scale * RADIUS - 0.01, 1, 0, 0, blend, 1]
    return RepeatedPart(np.array([scale * x, 0, 0, 1, 0, 0, 0, *size], np.float32))


def test_a_part_stands_for_a_neck_that_was_left_out() -> None:
    samples, apart = dumbbell(True), [ball(-AT), ball(AT)]
    before = expanded(apart)
    (neck,) = necks(samples, Pieces.of(samples, before))
    points = samples.grid_points[neck]
    assert np.abs(points[:, 0]).max() < 0.08
    assert np.abs(points[:, 1:]).max() < 2 * NECK
    found = rejoined(samples, apart, SETTINGS)
    assert found[:2] == apart
    assert len(found) == 3
    middle = np.column_stack([np.linspace(-0.2, 0.2, 101), np.zeros((101, 2))]).astype(np.float32)
    assert not (samples.distance_of(before, middle) < 0).all()
    assert (samples.distance_of(expanded(found), middle) < 0).all()
    assert score(samples, expanded(found)) > score(samples, before) - 1e-3
    assert rejoined(samples, apart, replace(SETTINGS, max_parts=2)) is apart


def test_nothing_changes_where_the_shape_is_two_or_the_parts_are_one() -> None:
    apart, whole = [ball(-AT), ball(AT)], [ball(-AT + GAP), ball(AT)]
    assert rejoined(dumbbell(False), apart, SETTINGS) is apart
    assert rejoined(dumbbell(True), whole, SETTINGS) is whole


def test_a_blend_joins_parts() -> None:
    samples, apart = dumbbell(True), [ball(-AT, 0.2), ball(AT, 0.2)]
    assert rejoined(samples, apart, SETTINGS) is apart


@pytest.mark.parametrize(("gap", "count"), [(0.035, 2), (0.015, 1), (-0.01, 1)])
def test_parts_that_may_meet_between_points_of_the_grid_are_one(gap: float, count: int) -> None:
    samples = dumbbell(True)
    rows = expanded([ball(-RADIUS - gap / 2), ball(RADIUS + gap / 2)])
    apart = Pieces.of(samples, rows)
    assert apart.count == count
    two = replace(apart, count=2, of_part=np.array([0, 1]))
    assert two.meet(samples, rows, rows[:0], np.zeros((1, 3), np.float32)) == (gap < 0)
