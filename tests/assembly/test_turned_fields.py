"""A solid does not feel some turns: the distances after them are the same."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from partwright.assembly.turned_fields import is_same_turned
from partwright.fields import Box, Cylinder, Extrusion, Field, HollowBox, Revolution, Torus
from partwright.fields.profile import Profile

SLOT = Profile([(-5, -2, 0.0), (5, -2, 1.0), (5, 2, 0.0), (-5, 2, 1.0)])
DROP = Profile([(-5, -1, 0.0), (5, -2, 1.0), (5, 2, 0.0), (-5, 1, 1.0)])
FIELDS = (
    Cylinder(2, 3),
    Torus(4, 1),
    Revolution(Profile([(1, -1), (3, -1), (2, 2)])),
    Box((2, 2, 3)),
    Box((1, 2, 3)),
    HollowBox((4, 4, 3), 0.5),
    HollowBox((4, 4, 4), 0.5),
    Extrusion(SLOT, 3),
    Extrusion(DROP, 3),
    Extrusion(Profile.regular(6, 4), 3),
)


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: type(field).__name__)
@pytest.mark.parametrize("axis", "xyz")
@pytest.mark.parametrize("degrees", [60, 90, 180, 33])
def test_what_is_the_same_turned_has_the_same_distances(field: Field, axis: str, degrees: float) -> None:
    turn = Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
    points = np.random.default_rng(1).uniform(-6, 6, (200, 3))
    same = np.abs(field(points) - field(points @ turn)).max() < 1e-5
    if is_same_turned(field, turn, 1e-9):
        assert same
    elif axis == "z":
        assert not same


def test_an_open_turn_is_not_round() -> None:
    half = Revolution(Profile([(1, -1), (3, -1), (2, 2)]), 180)
    assert not is_same_turned(half, Rotation.from_euler("z", 90, degrees=True).as_matrix(), 1e-9)
    assert is_same_turned(half, np.eye(3), 1e-9)
