"""Pieces that float though the shape is one body."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from scipy import ndimage
from scipy.spatial.transform import Rotation

from partwright.fields.columns import Column
from partwright.fitting import fit
from partwright.meshing import lean_assembly, mesh_assembly, mesh_field
from partwright.methods import FitRequest, Run
from partwright.shapes import Shape, load_shape
from partwright.superfrusta.objective import score
from partwright.superfrusta.rejoining import Pieces, Surface, is_one, needed, rejoined
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.symmetric_fit import RepeatedPart, expanded

SETTINGS = Settings(near=4000, uniform=4000)
GAP, RADIUS, NECK, THIN = 0.04, 0.44, 0.05, 0.014
AT = RADIUS + GAP / 2


@cache
def dumbbell(neck: bool) -> FitSamples:
    return FitSamples.of(of_balls(neck), SETTINGS, Run(threads=1))


@cache
def of_balls(neck: bool) -> Shape:
    """Two balls, apart along x, and what joins them."""
    balls = [Manifold.sphere(RADIUS, 64).translate((x, 0, 0)) for x in (-AT, AT)]
    body = Manifold.compose(balls)
    rod = Manifold.cylinder(0.3, NECK, NECK, 32, True).rotate((0, 90, 0))
    made = (body + rod if neck else body).to_mesh()
    return load_shape(trimesh.Trimesh(np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts)))


def ball(x: float, blend: float = 0.0) -> RepeatedPart:
    """In the unit frame, whose longest side is 1.8; round, of a length that may grow."""
    scale = 0.9 / (AT + RADIUS)
    size = [0.02, 0.02, 0.02, 1, scale * RADIUS - 0.01, 1, 0, 0, blend, 1]
    return RepeatedPart(np.array([scale * x, 0, 0, 1, 0, 0, 0, *size], np.float32))


def seen(samples: FitSamples, cells: int = 160) -> Surface:
    def surface(leaves: list[RepeatedPart]) -> tuple[np.ndarray, np.ndarray]:
        rows = expanded(leaves)
        mesh = mesh_field(lambda points: samples.distance_of(rows, points), [-1] * 3, [1] * 3, cells)
        return np.asarray(mesh.vertices), np.asarray(mesh.faces, np.int64)

    return surface


def found_in(
    neck: bool, leaves: list[RepeatedPart], known: int = 0, most: int | None = None
) -> list[RepeatedPart]:
    samples, settings = dumbbell(neck), replace(SETTINGS, max_parts=most)
    return rejoined(of_balls(neck), samples, leaves, settings, seen(samples), known)


def one(samples: FitSamples, leaves: list[RepeatedPart]) -> bool:
    rows = expanded(leaves)
    return is_one(samples, rows, samples.grid_field(rows))


@pytest.mark.parametrize("gap", [GAP, 0.012])  # of which the second is narrower than a voxel
def test_a_part_stands_for_a_neck_that_was_left_out(gap: float) -> None:
    samples, apart = dumbbell(True), [ball(-RADIUS - gap / 2), ball(RADIUS + gap / 2)]
    before = expanded(apart)
    assert Pieces.of(*seen(samples)(apart)).count == 2
    found = found_in(True, apart)
    assert found[:2] == apart
    assert len(found) == 3
    middle = np.column_stack([np.linspace(-0.2, 0.2, 101), np.zeros((101, 2))]).astype(np.float32)
    assert not (samples.distance_of(before, middle) < 0).all()
    assert (samples.distance_of(expanded(found), middle) < 0).all()
    assert Pieces.of(*seen(samples)(found)).count == 1
    assert score(samples, expanded(found)) > score(samples, before) - 1e-3
    assert found_in(True, apart, most=2) is apart


def test_necks_go_before_what_is_known() -> None:
    apart = [ball(-AT), ball(AT)]
    first, neck, last = found_in(True, apart, known=1)
    assert [first, last] == apart
    assert abs(neck.row[0]) < 0.1


def test_nothing_changes_where_the_shape_is_two_or_the_parts_are_one() -> None:
    apart, whole = [ball(-AT), ball(AT)], [ball(-AT + GAP), ball(AT)]
    assert found_in(False, apart) is apart
    assert found_in(True, whole) is whole


def test_a_blend_joins_parts() -> None:
    samples, apart = dumbbell(True), [ball(-AT, 0.2), ball(AT, 0.2)]
    assert one(samples, apart)
    assert found_in(True, apart) is apart


@pytest.mark.parametrize("gap", [0.035, 0.015, 0.004, -0.004, -0.01])
def test_whether_parts_meet_is_told_between_points_of_the_grid(gap: float) -> None:
    samples = dumbbell(True)
    assert one(samples, [ball(-RADIUS - gap / 2), ball(RADIUS + gap / 2)]) == (gap < 0)


def test_a_sheet_that_is_thinner_than_voxels_is_one_body() -> None:
    """Its voxels are not."""
    turn = Rotation.from_euler("x", 20, degrees=True)
    sheet = trimesh.creation.box((1.8, 1.2, THIN))
    sheet.apply_transform(np.block([[turn.as_matrix(), np.zeros((3, 1))], [np.eye(4)[3:]]]))
    shape = load_shape(sheet)
    samples = FitSamples.of(shape, SETTINGS, Run(threads=1))
    assert ndimage.label(samples.grid.values < 0, np.ones((3, 3, 3)))[1] > 1
    size = [0.88, 1.2, THIN, 0, 0, 1, 0, 0, 0, 1]
    halves = [
        RepeatedPart(np.array([x, 0, 0, *turn.as_quat(scalar_first=True), *size], np.float32))
        for x in (-0.45, 0.45)
    ]
    surface = seen(samples, 320)
    assert Pieces.of(*surface(halves)).count == 2
    found = rejoined(shape, samples, halves, SETTINGS, surface)
    assert len(found) == 3
    assert Pieces.of(*surface(found)).count == 1


def test_chips_are_no_pieces() -> None:
    chip = ball(0.0)
    chip.row[[Column.DILATION, Column.TZ]] = 0.03, 0.7
    samples = dumbbell(True)
    leaves = [ball(-AT + GAP), ball(AT), chip]
    assert Pieces.of(*seen(samples)(leaves)).count == 1
    assert one(samples, leaves)


def test_of_several_necks_those_that_join_more_are_needed() -> None:
    voxels = [np.full(3, k) for k in range(4)]
    given = zip(voxels, ([0, 1], [0, 1], [1, 2], [0, 2]), strict=True)
    assert [int(one[0]) for one in needed(3, given)] == [0, 2]


def test_what_the_last_changes_part_is_joined_again(monkeypatch: pytest.MonkeyPatch) -> None:
    apart = [ball(-AT), ball(AT)]

    def parting(search: ResidualFit, shape: Shape, known: int) -> None:
        search.leaves = apart

    monkeypatch.setattr(ResidualFit, "polish", parting)
    shape = of_balls(True)
    fitted = FitRequest(shape, Settings.for_quality("draft"), Run(threads=1)).fitted()
    assert len(fitted.assembly) == 3
    # What was looked at last is the surface of the result.
    surface = mesh_assembly(fitted.assembly)
    assert fitted.surface is not None
    assert np.array_equal(fitted.surface.vertices, surface.vertices)
    assert np.array_equal(fitted.surface.faces, surface.faces)
    result = fit(shape, quality="draft", threads=1)
    assert not result.warnings
    assert np.array_equal(result.surface.vertices, lean_assembly(result.assembly, mesh=surface).vertices)
