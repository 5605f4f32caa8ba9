"""Holes of one form: what counts as a pattern, where its copies lie, and what is cut for one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

import partwright as pw
from partwright.fields.columns import SIZE, Column
from partwright.methods import Run
from partwright.shapes import Shape, load_shape
from partwright.superfrusta.filling import filled
from partwright.superfrusta.hole_cutting import hole_part
from partwright.superfrusta.hole_patterns import HolePattern, hole_patterns
from partwright.superfrusta.hole_search import hides
from partwright.superfrusta.narrow_holes import directions
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings

SETTINGS = Settings(near=4000, uniform=4000)
PITCH, RADIUS = 0.3, 0.07
PLACES = [(PITCH * i, PITCH * j) for i in range(-2, 3) for j in range(-1, 2)]


def block(x: float, y: float, z: float) -> Manifold:
    return Manifold.cube((x, y, z), True)


def plate(places: Sequence[tuple[float, float]] = PLACES, radius: float = RADIUS) -> Manifold:
    """1.8 x 1.2 x 0.1, with a hole at each place."""
    rod = Manifold.cylinder(1.0, radius, radius, 48, True)
    holes = Manifold.compose([rod.translate((x, y, 0.0)) for x, y in places])
    return block(1.8, 1.2, 0.1) - holes


def mesh(body: Manifold) -> trimesh.Trimesh:
    made = body.to_mesh()
    return trimesh.Trimesh(np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts))


def seen(body: Manifold) -> tuple[Shape, FitSamples, list[HolePattern]]:
    shape = load_shape(mesh(body))
    samples = FitSamples.of(shape, SETTINGS, Run(threads=1))
    return shape, samples, hole_patterns(shape, samples)


@pytest.mark.parametrize("turn", [(0, 0, 0), (20, 35, 10)])
def test_a_perforated_plate_has_one_pattern_however_it_lies(turn: tuple[int, int, int]) -> None:
    shape, samples, (pattern,) = seen(plate().rotate(turn))
    assert len(pattern.isometries) == len(PLACES) - 1
    scale = shape.frame.scale
    first = samples.grid.points_of(np.flatnonzero(pattern.hole)).mean(axis=0)
    found = np.array([first, *(way(first[None])[0] for way in pattern.isometries)])
    holes = [Manifold.sphere(0.01, 8).translate((x, y, 0.0)).rotate(turn) for x, y in PLACES]
    middles = scale * (np.array([mesh(one).bounds.mean(axis=0) for one in holes]) - shape.frame.centre)
    nearest = np.linalg.norm(found[:, None] - middles, axis=2).argmin(axis=1)
    assert len(set(nearest)) == len(PLACES)
    off = found - middles[nearest]  # how deep the middle of a layer of voxels lies is the voxels' own
    assert np.linalg.norm(off - off[0], axis=1).max() < 0.2 * samples.grid.spacing
    volume = np.count_nonzero(pattern.filling) * samples.grid.spacing**3
    assert volume == pytest.approx(len(PLACES) * np.pi * RADIUS**2 * 0.1 * scale**3, rel=0.15)


def test_webs_thinner_than_a_voxel_hide_no_hole() -> None:
    places = [*PLACES[:-1], (PLACES[-2][0] - PITCH, PITCH)]
    near = (places[0][0], places[0][1] + 2 * RADIUS + 0.004)
    *_, patterns = seen(plate([*PLACES, near]))
    assert [1 + len(one.isometries) for one in patterns] == [len(PLACES)]


@pytest.mark.parametrize(
    "body",
    [
        plate(PLACES[:3]),
        # A comb's gaps are open at one end, and what lies between bars is no hole in a wall.
        block(1.8, 1.2, 0.1)
        - Manifold.compose([block(0.1, 1.0, 1).translate((x, 0.3, 0)) for x, _ in PLACES]),
        Manifold.sphere(0.9, 32),
    ],
)
def test_three_holes_a_comb_and_a_ball_have_none(body: Manifold) -> None:
    assert not seen(body)[2]


def test_the_faces_of_a_turned_box_are_its_directions() -> None:
    box = trimesh.creation.box((1.8, 1.2, 0.6))
    box.apply_transform(trimesh.transformations.rotation_matrix(0.4, (1, 2, 3)))
    found = directions(load_shape(box).unit_surface(2000, 0).normals.astype(np.float64))
    axes = trimesh.transformations.rotation_matrix(0.4, (1, 2, 3))[:3, :3]
    assert len(found) == 3
    np.testing.assert_allclose(np.abs(np.array(found) @ axes).max(axis=1), 1, atol=1e-5)


@pytest.mark.parametrize("depth", [None, 0.2])
def test_a_cut_is_the_hole_and_goes_on_where_that_is_open(depth: float | None) -> None:
    height = 0.3
    rod = Manifold.cylinder(1.0, RADIUS, RADIUS, 64)
    holes = Manifold.compose([rod.translate((x, y, height / 2 - (depth or 0.6))) for x, y in PLACES])
    _, samples, (pattern,) = seen(block(1.8, 1.2, height) - holes)
    part = hole_part(samples, pattern, SETTINGS)
    local = np.sort(part[SIZE] + 2 * part[Column.DILATION])
    np.testing.assert_allclose(local[:2], 2 * RADIUS, rtol=0.02)
    assert local[2] == pytest.approx((height + 0.06) if depth is None else depth + 0.03, abs=0.02)
    assert part[Column.ROUNDNESS] > 0.95
    assert part[Column.SIGN] < 0
    cuboid = hole_part(samples, pattern, replace(SETTINGS, family="cuboid"))
    assert cuboid[Column.ROUNDNESS] == 0.0


def test_filled_holes_are_inside_and_have_no_surface() -> None:
    _, samples, (pattern,) = seen(plate())
    full = filled(samples, pattern.filling)
    within = samples.grid.points()[pattern.filling.ravel()].astype(np.float32)
    assert (full.measure(within) < 0).all()
    assert (samples.measure(within) > 0).all()
    off = np.linalg.norm(full.surface[:, None, :2] - np.array(PLACES), axis=2).min(axis=1)
    assert off.min() > 1.1 * RADIUS
    assert len(full.surface) > 0.7 * len(samples.surface)
    apart = samples.points[(np.abs(samples.points[:, 0]) > 0.85) & (np.abs(samples.distance) < 0.05)]
    np.testing.assert_array_equal(full.measure(apart), samples.measure(apart))


def test_a_fit_of_a_perforated_plate_is_a_plate_and_a_hole() -> None:
    found = pw.fit(load_shape(mesh(plate())), quality="draft", threads=1, max_parts=2)
    assert len(found.assembly) == 2
    assert sorted(1 + len(part.instances) for part in found.assembly.parts) == [1, len(PLACES)]
    assert found.scores.iou > 0.97


def test_alike_holes_of_different_forms_are_no_pattern() -> None:
    forms = [Manifold.cylinder(1.0, 0.1, 0.1, sides, True) for sides in (3, 4, 5, 6, 24)]
    holes = [form.translate((0.3 * i - 0.6, 0.1, 0)) for i, form in enumerate(forms)]
    assert not seen(block(1.8, 1.2, 0.1) - Manifold.compose(holes))[2]


def test_two_forms_are_two_patterns_and_share_no_hole() -> None:
    slot = block(0.12, 0.2, 1)
    slots = Manifold.compose([slot.translate((0.3 * i - 0.6, -0.45, 0)) for i in range(5)])
    *_, patterns = seen(plate([(x, y + 0.2) for x, y in PLACES if y > -0.1]) - slots)
    assert [1 + len(one.isometries) for one in patterns] in ([5, 10], [10, 5])
    assert not (patterns[0].filling & patterns[1].filling).any()


def test_holes_of_many_widths_in_one_grid_are_each_in_one_pattern() -> None:
    widths = np.random.default_rng(0).uniform(0.03, 0.09, 40)
    rods = [Manifold.cylinder(1, w, w, 24, True) for w in widths]
    places = [(0.2 * (k % 8) - 0.7, 0.2 * (k // 8) - 0.4, 0) for k in range(40)]
    holes = Manifold.compose([rod.translate(at) for rod, at in zip(rods, places, strict=True)])
    *_, patterns = seen(block(1.8, 1.2, 0.1) - holes)
    assert sum(one.filling.astype(int) for one in patterns).max() == 1
    assert sum(1 + len(one.isometries) for one in patterns) <= 40


@pytest.mark.parametrize(
    ("one", "count", "hidden"), [(0.005, 3, False), (0.005, 10, True), (0.03, 4, False), (0.03, 6, True)]
)
def test_small_holes_hide_a_wall_and_large_ones_if_they_are_most_of_it(
    one: float, count: int, hidden: bool
) -> None:
    voxels, hole = 10_000, np.zeros((100, 100, 1), bool)
    filling = hole.copy()
    hole.ravel()[: round(one * voxels)] = True
    filling.ravel()[: round(count * one * voxels)] = True
    assert hides(HolePattern(hole, np.eye(3), (), filling), voxels) is hidden


def test_an_interrupted_fit_has_its_holes() -> None:
    cancel = pw.Cancellation()
    shape = load_shape(mesh(plate()))

    def stop(step: pw.Progress) -> None:
        cancel.request()

    found = pw.fit(shape, quality="draft", threads=1, progress=stop, cancel=cancel)
    assert found.outcome == "interrupted"
    assert max(len(part.copies) for part in found.assembly.parts) == len(PLACES)
