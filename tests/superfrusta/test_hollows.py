"""Hollows: what counts as one, the filled shape's samples, and bodies that are hollowed out."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from manifold3d import CrossSection, Manifold

from partwright.errors import CancelledError
from partwright.fields.columns import Column
from partwright.methods import Run
from partwright.shapes import load_shape
from partwright.superfrusta import carving
from partwright.superfrusta.carving import Carving
from partwright.superfrusta.hollows import hollows, with_hollows_filled
from partwright.superfrusta.objective import volume_iou
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.settings import Settings
from tests.superfrusta.meshes import box

BODY = np.array((1.8, 1.2, 0.8))
SETTINGS = Settings(resolution=64, near=10_000, uniform=10_000)


def tray(wall: float = 0.1) -> trimesh.Trimesh:
    """A box that is open above."""
    room = box(BODY - (2 * wall, 2 * wall, wall) + (0, 0, 0.2), (0, 0, wall / 2 + 0.1))
    return trimesh.boolean.difference([box(BODY), room], engine="manifold")


def bend() -> trimesh.Trimesh:
    """A thin pipe, bent through a quarter of a circle."""
    ring = CrossSection.circle(0.3, 48) - CrossSection.circle(0.25, 48)
    made = Manifold.revolve(ring.translate((0.9, 0.0)), 96, 90).to_mesh()
    return trimesh.Trimesh(np.asarray(made.vert_properties)[:, :3], np.asarray(made.tri_verts))


def of(mesh: trimesh.Trimesh) -> FitSamples:
    return FitSamples.of(load_shape(mesh), SETTINGS, Run(threads=1))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_bore_a_vessel_and_a_void_are_hollows_however_they_lie(axis: int) -> None:
    solid = np.ones((12, 12, 12), bool)
    solid[[0, -1]] = solid[:, [0, -1]] = solid[:, :, [0, -1]] = False
    for room in (np.s_[4:7, 4:7, :], np.s_[4:7, 4:7, 5:], np.s_[4:7, 4:7, 4:7]):
        shape = solid.copy()
        shape[room] = False
        turned = np.moveaxis(shape, 2, axis)
        expected = np.moveaxis(solid & ~shape, 2, axis)
        np.testing.assert_array_equal(hollows(turned), expected)


def test_a_notch_is_none() -> None:
    solid = np.zeros((12, 12, 12), bool)
    solid[2:10, 2:10, 2:10] = True
    solid[5:7, 2:5, 2:10] = False  # a slot along z, open to one side
    assert not hollows(solid).any()
    assert with_hollows_filled(of(box(BODY))) is None


def test_the_filled_tray_is_the_box_it_was_cut_from() -> None:
    samples = of(tray())
    filled = with_hollows_filled(samples)
    assert filled is not None
    beyond = np.abs(filled.points) - BODY / 2
    true = np.linalg.norm(np.maximum(beyond, 0), axis=1) + np.minimum(beyond.max(axis=1), 0)
    spacing = samples.grid.spacing
    sure = np.abs(true) > spacing
    np.testing.assert_array_equal(filled.inside[sure], true[sure] < 0)
    near = sure & (np.abs(true) < 0.2)
    np.testing.assert_allclose(filled.distance[near], true[near], atol=1.5 * spacing)
    assert np.array_equal(
        filled.grid.values < 0, (samples.grid.values < 0) | hollows(samples.grid.values < 0)
    )


@pytest.mark.parametrize(("mesh", "parts"), [(tray(), 3), (bend(), 4)], ids=["tray", "bend"])
def test_a_hollow_body_is_a_body_and_what_is_taken_out(mesh: trimesh.Trimesh, parts: int) -> None:
    samples = of(mesh)
    rows = Carving(ResidualFit(samples, SETTINGS)).hollowed(SETTINGS)
    assert 1 <= len(rows) <= parts
    assert (rows[:, Column.SIGN] < 0).any() or len(rows) == 1  # or one with a hole of its own
    assert volume_iou(samples, rows) > 0.75


def test_a_bent_pipe_takes_few_parts() -> None:
    fit = ResidualFit(of(bend()), SETTINGS)
    fit.run()
    assert fit.best is not None
    assert len(fit.best) <= 4
    assert volume_iou(fit.samples, fit.best) > 0.95


def test_an_interruption_while_the_body_is_sought_keeps_what_was_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fit = ResidualFit(of(tray()), SETTINGS)
    monkeypatch.setattr(carving, "_GOOD", 2.0)

    def cancelled(_: FitSamples) -> None:
        raise CancelledError("stop")

    monkeypatch.setattr(carving, "with_hollows_filled", cancelled)
    with pytest.raises(CancelledError):
        fit.run()
    assert fit.best is not None
    assert fit.settings == SETTINGS
