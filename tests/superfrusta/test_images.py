"""What the symmetries of a shape take regions and parts to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.assembly.rows import rows
from partwright.fields import SuperFrustum
from partwright.shapes import load_shape
from partwright.superfrusta import Settings
from partwright.superfrusta.alike_regions import first_alike
from partwright.superfrusta.growing import carve, grow
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.symmetry import Symmetry, generated_by, mirror, rotation
from tests.superfrusta.meshes import box, table
from tests.superfrusta.rows import box as box_row
from tests.superfrusta.rows import subtracting

SETTINGS = replace(Settings.for_quality("draft"), near=6000, uniform=6000, resolution=48)
ORIGIN, Z = np.zeros(3), np.array([0.0, 0.0, 1.0])
LEGS = [(x, y) for x in (-1, 1) for y in (-1, 1)]


@pytest.fixture(scope="module")
def samples() -> FitSamples:
    return FitSamples.of(load_shape(table()), SETTINGS)


@pytest.fixture(scope="module")
def top() -> np.ndarray:
    """(1, 17) in the unit frame."""
    shape = load_shape(table())
    one = Assembly((Part(SuperFrustum((2, 1.2, 0.15)), (0, 0, 1.0), blend=0.001),))
    unit = one.translated([-c for c in shape.frame.centre]).scaled(shape.frame.scale)
    return subtracting(rows(unit.parts))


def turned(order: int, error: float = 0.0) -> Symmetry:
    return Symmetry("rotation", order, rotation(Z, 2 * np.pi / order, ORIGIN), error)


def test_symmetries_generate_what_takes_a_shape_to_itself(samples: FitSamples) -> None:
    """Of a table: two mirrors and half a turn. Thirds and quarters of a turn make twelve, and sevenths with
    them too many; what holds badly counts for nothing."""
    assert len(samples.images) == 3
    assert len(generated_by([turned(3), turned(4)], 0.01)) == 11
    assert len(generated_by([turned(3), turned(4), turned(7)], 0.01)) == 11
    assert len(generated_by([turned(3), turned(4, 0.02)], 0.01)) == 2
    plane = Symmetry("mirror", 2, mirror(np.array([1.0, 0, 0]), ORIGIN), 0.0)
    assert len(generated_by([turned(3), plane], 0.01)) == 5
    assert generated_by([], 0.01) == generated_by([turned(30)], 0.01) == ()


def test_symmetries_are_not_looked_for_where_none_are_wanted() -> None:
    alone = FitSamples.of(load_shape(table()), replace(SETTINGS, symmetry=False))
    assert alone.images == ()


def legs(samples: FitSamples) -> list[np.ndarray]:
    """Voxels (X * Y * Z,) of each, below the top."""
    points, inside = samples.grid_points, samples.grid.values.ravel() < 0
    low = inside & (points[:, 2] < points[inside, 2].max() - 0.25)
    return [low & (np.sign(points[:, :2]) == leg).all(axis=1) for leg in LEGS]


def test_a_region_is_the_image_of_the_first_that_is_alike(samples: FitSamples) -> None:
    """Legs are of each other, but neither of half a leg, nor of one that is to be subtracted, nor of the
    top."""
    inside = samples.grid.values.ravel() < 0
    whole = legs(samples)
    top_ = inside & ~np.logical_or.reduce(whole)
    half = whole[1] & (samples.grid_points[:, 2] < np.median(samples.grid_points[whole[1], 2]))
    wanted = [(top_, 1.0), *((leg, 1.0) for leg in whole), (half, 1.0), (whole[3], -1.0), (whole[3], -1.0)]
    assert first_alike(samples, wanted) == [0, 1, 1, 1, 1, 5, 6, 7]


@pytest.mark.parametrize(("symmetry", "most"), [(True, 1), (False, 4)])
def test_a_leg_that_is_found_is_tried_in_all_places(symmetry: bool, most: int, top: np.ndarray) -> None:
    """One part a round, and four legs are there, images of one another; else it takes four parts."""
    samples = FitSamples.of(load_shape(table()), replace(SETTINGS, symmetry=symmetry))
    assert len(grow(samples, top, SETTINGS, most).last) == 4
    found = grow(samples, top, SETTINGS, 1).last
    assert len(found) == (4 if symmetry else 1)
    assert (
        sorted(map(tuple, np.sign(found[:, :2]).astype(int).tolist())) == sorted(LEGS)[: len(found)]
        or not symmetry
    )
    if symmetry:
        centres = np.abs(found[:, :3])
        assert np.ptp(centres[:, :2], axis=0).max() < 2e-3
        assert np.ptp(found[:, 7:], axis=0).max() == 0


def test_a_hole_that_is_found_is_tried_in_all_places() -> None:
    drills = [
        trimesh.creation.cylinder(0.12, 1.0, sections=48).apply_translation((x, y, 0))
        for x in (-0.6, 0.6)
        for y in (-0.3, 0.3)
    ]
    plate = ((1.8, 1.2, 0.3), (0.0, 0.0, 0.0))
    drilled = trimesh.boolean.difference([box(*plate), *drills], engine="manifold")
    samples = FitSamples.of(load_shape(drilled), SETTINGS)
    found = carve(samples, box_row(*plate)[None], SETTINGS, 1).last
    assert len(found) == 4
    assert np.abs(np.abs(found[:, :2]) - (0.6, 0.3)).max() < 0.03
