"""How far a surface is told to be from a shape's, where it is known."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh

from partwright.assembly import Assembly, Part
from partwright.fields import Box, Cylinder, Field
from partwright.metrics import Comparison
from partwright.metrics.deviation import Deviation
from partwright.shapes import UnitFrame, load_shape

_TURN = trimesh.transformations.random_rotation_matrix(np.array([0.3, 0.5, 0.7]))
_QUATERNION = tuple(trimesh.transformations.quaternion_from_matrix(_TURN).tolist())


def between(field: Field, mesh: trimesh.Trimesh) -> Deviation:
    """Both turned alike; unit lengths."""
    mesh.apply_transform(_TURN)
    return Comparison(Assembly([Part(field, rotation=_QUATERNION)]), load_shape(mesh)).deviation


@pytest.mark.parametrize("size", [(18, 0.1, 0.1), (18, 18, 0.1)])
def test_thin_boxes_that_are_met_are_nowhere_off(size: tuple[float, float, float]) -> None:
    found = between(Box(size), trimesh.creation.box(size))
    assert found.protrusion <= found.maximum < 1e-6


def test_a_round_field_is_not_off_by_the_chords_of_its_own_mesh() -> None:
    found = between(Cylinder(1, 10), mesh := trimesh.creation.cylinder(1, 10, sections=128))
    radius = UnitFrame.of(mesh.vertices).length_to_unit(1.0)
    lost = radius * (1 - math.cos(math.pi / 128))  # by the chords of the shape's
    assert lost * 0.95 < found.protrusion <= found.maximum < lost + 2e-5
    assert found.quantile_95 <= found.maximum
