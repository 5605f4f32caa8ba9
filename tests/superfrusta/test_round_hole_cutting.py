"""Round holes that a search has closed: which are, and what is cut for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

import partwright as pw
from partwright.fields.columns import Column
from partwright.methods import Run
from partwright.shapes import Shape, load_shape
from partwright.superfrusta.round_hole_cutting import with_round_holes
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded

SETTINGS = Settings(near=2000, uniform=2000)
RADIUS, THIN = 0.2, 0.02


def box(x: float, y: float, z: float, at: float = 0.0) -> RepeatedPart:
    return RepeatedPart(np.array([0, 0, at, 1, 0, 0, 0, x, y, z, 0, 0, 1, 0, 0, 0, 1], np.float32))


def rod(radius: float, height: float, x: float = 0.0) -> Manifold:
    return Manifold.cylinder(height, radius, radius, 48, True).translate((x, 0, 0))


def seen(body: Manifold) -> tuple[Shape, FitSamples]:
    made = body.to_mesh()
    shape = load_shape(trimesh.Trimesh(np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts)))
    return shape, FitSamples.of(shape, SETTINGS, Run(threads=1))


def plate(thickness: float, *holes: Manifold) -> Manifold:
    return Manifold.cube((1.8, 1.2, thickness), True) - Manifold.compose(list(holes))


def occupied(samples: FitSamples, leaves: list[RepeatedPart]) -> np.ndarray:
    return samples.distance_of(expanded(leaves), samples.points) < 0


def test_a_hole_in_a_thin_plate_is_cut_and_goes_on_on_both_sides() -> None:
    shape, samples = seen(plate(THIN, rod(RADIUS, 1.0)))
    thick = [box(1.8, 1.2, 1.5 * THIN)]  # fits are never exact: no skin may be left
    found = with_round_holes(shape, samples, thick, SETTINGS)
    assert found[:1] == thick
    (cut,) = found[1:]
    assert cut.row[Column.SIGN] < 0
    np.testing.assert_allclose(cut.row[[Column.SX, Column.SY]], 2 * RADIUS, rtol=0.01)
    assert cut.row[Column.SZ] == pytest.approx(THIN + 0.06, abs=1e-3)
    across = np.linspace(-0.02, 0.02, 41)
    middle = np.column_stack([np.zeros((41, 2)), across]).astype(np.float32)
    assert (samples.distance_of(expanded(found), middle) > 0).all()


def test_what_closes_one_section_closes_a_hole() -> None:
    shape, samples = seen(plate(0.6, rod(RADIUS, 1.0)))
    hollow = [box(1.8, 1.2, 0.6), *with_round_holes(shape, samples, [box(1.8, 1.2, 0.6)], SETTINGS)[1:]]
    assert with_round_holes(shape, samples, hollow, SETTINGS) is hollow
    lidded = [*hollow, box(1.0, 1.0, 0.01, at=0.1)]
    found = with_round_holes(shape, samples, lidded, SETTINGS)
    assert len(found) == len(lidded) + 1
    np.testing.assert_array_equal(occupied(samples, found), occupied(samples, hollow))


def test_a_floor_that_lies_a_little_higher_closes_nothing() -> None:
    shape, samples = seen(plate(0.6, rod(RADIUS, 0.8).translate((0, 0, 0.3))))  # its floor at -0.1
    for higher, closed in ((0.01, False), (0.1, True)):
        depth = 0.4 - higher
        row = box(2 * RADIUS, 2 * RADIUS, depth + 0.1, at=0.35 - depth / 2).row.copy()
        row[[Column.ROUNDNESS, Column.SIGN]] = 1, -1
        leaves = [box(1.8, 1.2, 0.6), RepeatedPart(row)]
        assert (with_round_holes(shape, samples, leaves, SETTINGS) is not leaves) is closed


def test_a_thin_floor_stays() -> None:
    """Of a boss on a plate, which the fit has a little further in."""
    wall = plate(0.004) + rod(0.3, 0.4).translate((0, 0, 0.2)) - rod(RADIUS, 1.0).translate((0, 0, 0.502))
    shape, samples = seen(wall)
    rows = np.stack([box(1.8, 1.2, 0.006, 0.001).row, box(0.6, 0.6, 0.4, 0.2).row])
    rows[1, Column.ROUNDNESS] = 1
    rows[:, [Column.TX, Column.TY, Column.TZ]] = shape.frame.to_unit(rows[:, :3])
    (cut,) = with_round_holes(shape, samples, [RepeatedPart(row) for row in rows], SETTINGS)[2:]
    floor = shape.frame.to_unit(np.array([[0, 0, 0.001]])).astype(np.float32)
    within = shape.frame.to_unit(np.array([[0, 0, 0.01], [0, 0, 0.2]])).astype(np.float32)
    whole = np.concatenate([rows, cut.row[None]])
    assert samples.distance_of(whole, floor) < 0
    assert (samples.distance_of(whole, within) > 0).all()


def test_holes_of_one_size_are_one_part_and_a_budget_takes_the_widest() -> None:
    small = [rod(0.05, 1.0, x) for x in (-0.6, -0.4, 0.4, 0.6)]
    shape, samples = seen(plate(THIN, rod(RADIUS, 1.0), *small))
    body = [box(1.8, 1.2, THIN)]
    wide, narrow = with_round_holes(shape, samples, body, SETTINGS)[1:]
    assert (len(wide.isometries), len(narrow.isometries)) == (0, 3)
    assert wide.row[Column.SX] > narrow.row[Column.SX]
    within = np.array([[x, 0, 0] for x in (-0.6, -0.4, 0.0, 0.4, 0.6)], np.float32)
    assert (samples.distance_of(expanded([*body, wide, narrow]), within) > 0).all()
    first = with_round_holes(shape, samples, body, replace(SETTINGS, max_parts=2))[1:]
    assert [leaf.row.tobytes() for leaf in first] == [wide.row.tobytes()]
    assert with_round_holes(shape, samples, body, replace(SETTINGS, max_parts=1)) is body


def test_boxes_alone_have_no_round_holes() -> None:
    shape, samples = seen(plate(THIN, rod(RADIUS, 1.0)))
    body = [box(1.8, 1.2, THIN)]
    assert with_round_holes(shape, samples, body, replace(SETTINGS, family="cuboid")) is body


def test_a_fit_of_a_thin_plate_has_its_hole() -> None:
    shape, _ = seen(plate(0.01, rod(0.08, 1.0)))
    found = pw.fit(shape, quality="draft", threads=1)
    middle, beside = found.assembly.distance(shape.frame.centre + np.array([[0.0, 0, 0], [0.3, 0, 0]]))
    assert beside < 0 < middle
