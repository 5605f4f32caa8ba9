"""Solids that are seen in open surfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from partwright.errors import OpenShellError
from partwright.shapes import Shape, load_shape
from partwright.shapes.hidden_faces import Ground
from partwright.shapes.reading import source_of
from partwright.shapes.sealing import GAP, Sealed, seal
from partwright.shapes.source import Piece, Source
from tests.shapes.solids import SIDES, blinds


def sealed(mesh: trimesh.Trimesh, ground: Ground | None = None) -> Sealed | None:
    return seal(np.asarray(mesh.vertices), np.asarray(mesh.faces), ground)


def half_ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(4, 0.45).slice_plane([0, 0, 0], [0, 0, 1])


@pytest.mark.parametrize("gap", [0.0, 0.01, 0.02])
def test_what_gaps_leave_open_is_the_solid_that_is_seen(gap: float) -> None:
    found = sealed(blinds(gap))
    assert found is not None
    made = trimesh.Trimesh(found.vertices, found.faces, process=False)
    assert made.is_watertight
    assert made.volume == pytest.approx(SIDES.prod(), rel=0.002 + gap)  # less what sags between slats
    np.testing.assert_allclose(made.extents, SIDES, atol=0.01)
    assert found.solid == 1
    assert not found.made_up.any()


def test_wider_gaps_are_openings() -> None:
    assert sealed(blinds(2 * GAP * 1.8, pitch=0.1)) is None


def test_what_is_open_below_stands_on_the_ground() -> None:
    ball = half_ball()
    assert sealed(ball) is None  # a bowl without a thickness, as far as anybody knows
    found = sealed(ball, Ground(np.array([0.0, 0.0, 1.0]), 0.0))
    assert found is not None
    made = trimesh.Trimesh(found.vertices, found.faces, process=False)
    assert made.is_watertight
    assert made.volume == pytest.approx(2 / 3 * np.pi * 0.45**3, rel=0.03)
    np.testing.assert_allclose(made.extents, (0.9, 0.9, 0.45), atol=0.006)  # no rim at the foot
    below = made.area_faces[found.made_up].sum()
    assert below == pytest.approx(np.pi * 0.45**2, rel=0.15)
    bowl = half_ball()
    bowl.apply_transform(np.diag([1, 1, -1, 1]))
    assert sealed(bowl, Ground(np.array([0.0, 0.0, 1.0]), -0.45)) is None


def test_a_box_of_blinds_is_a_box_that_had_openings() -> None:
    mesh = blinds(0.022, pitch=0.04)
    shape = load_shape(mesh)
    assert any("seen as a solid" in note for note in shape.repairs)
    assert shape.volume == pytest.approx(SIDES.prod(), rel=0.03)
    assert shape.openings.share < 1e-3
    assert shape.confidence == 1
    assert shape.sealed
    assert not load_shape(trimesh.creation.box(SIDES)).sealed
    with pytest.raises(OpenShellError):
        Shape(replace(source_of(mesh), sealing=False))
    assert (shape.signed_distance([[0, 0, 0], [0.8, 0.5, 0.4]]) < 0).all()
    assert (shape.signed_distance([[0, 0, 0.5], [0.95, 0, 0]]) > 0).all()


def test_the_bottom_that_the_ground_closes_is_told() -> None:
    """Of a dome of blinds without a floor, a quarter or so is made up."""
    mesh = blinds(0.022, pitch=0.04)
    mesh.update_faces(mesh.triangles_center[:, 2] > -0.449)

    def standing(up: str | None) -> Shape:
        return Shape(
            Source("mesh", (Piece("mesh", np.asarray(mesh.vertices), np.asarray(mesh.faces)),), None, up)
        )

    shape = standing("z")
    assert shape.volume == pytest.approx(SIDES.prod(), rel=0.03)
    assert shape.openings.count == 1
    whole = 2 * (SIDES[0] * SIDES[1] + SIDES[1] * SIDES[2] + SIDES[2] * SIDES[0])
    assert shape.openings.share == pytest.approx(SIDES[0] * SIDES[1] / whole, rel=0.1)
    with pytest.raises(OpenShellError, match="--up z"):
        standing(None)
