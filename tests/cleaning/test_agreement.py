"""The IoU before and after cleaning: of volumes, wherever their faces lie."""

from __future__ import annotations

import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.cleaning.agreement import VolumeSamples
from partwright.fields import Box
from partwright.shapes import load_shape

CELL = 2 / 128  # of the grid of [-1, 1]^3


def plate(top: float) -> Assembly:
    return Assembly((Part(Box((1.8, 1.8, top + 3.5 * CELL)), (0.0, 0.0, (top - 3.5 * CELL) / 2)),))


@pytest.mark.parametrize("moved", [-1e-4, 1e-4])
def test_a_face_that_lies_on_centres_of_cells_may_move_by_a_hair(moved: float) -> None:
    """Seven cells of 128 are this thick: one of them is 14 % of it."""
    given = plate(3.5 * CELL)
    iou = VolumeSamples.of(given).iou(plate(3.5 * CELL + moved))
    assert iou == pytest.approx(1 - abs(moved) / (7 * CELL), abs=1e-3)


def test_half_of_a_solid_agrees_by_half() -> None:
    given = Assembly((Part(Box((2.0, 1.0, 1.0)), (5.0, 0.0, 0.0)),))
    half = Assembly((Part(Box((1.0, 1.0, 1.0)), (4.5, 0.0, 0.0)),))
    assert VolumeSamples.of(given).iou(half) == pytest.approx(0.5, abs=2e-3)
    assert VolumeSamples.of(given).iou(given) == 1.0


def test_a_shape_is_asked_in_its_own_units() -> None:
    shape = load_shape(
        trimesh.creation.box(
            (20.0, 10.0, 10.0), trimesh.transformations.translation_matrix((100.0, 0.0, 0.0))
        )
    )
    same = Assembly((Part(Box((20.0, 10.0, 10.0)), (100.0, 0.0, 0.0)),))
    lower = Assembly((Part(Box((20.0, 10.0, 9.0)), (100.0, 0.0, -0.5)),))
    samples = VolumeSamples.of(shape)
    assert samples.iou(same) == pytest.approx(1.0, abs=1e-4)
    assert samples.iou(lower) == pytest.approx(0.9, abs=2e-3)
