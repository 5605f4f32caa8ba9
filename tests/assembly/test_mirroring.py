"""Mirror images of groups: at the mirror image of a point the distance is the same."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity, mirrored
from partwright.errors import ParameterError
from partwright.fields import (
    Box,
    Cylinder,
    Extrusion,
    Field,
    HollowBox,
    Pipe,
    Quadric,
    Revolution,
    SuperFrustum,
    Torus,
)
from partwright.fields.profile import Profile

SKEW = Profile(((0, 0), (5, 0, 0.4), (3, 2), (1, 4)), (((1, 0.5), (2, 0.5), (1, 1.5)),))
SECTOR = Revolution(Profile(((1, 0), (3, 0, 0.3), (2, 2))), 110)
BENT = SuperFrustum((2, 1, 4), 0.3, 0.1, 0.6, 0.5, 0.2)
SADDLE = Quadric((1, 2, -0.5, 0.2, 0.7, -0.1, -3, 0.4, 0.6, -0.3))
FIELDS = (
    Box((1, 2, 3)),
    HollowBox((4, 3, 2), 0.3),
    Torus(2, 0.4),
    BENT,
    Extrusion(SKEW, 3),
    SECTOR,
    Pipe(((0, 0, 0), (4, 0, 0, 1), (4, 3, 0, 1), (4, 3, 3)), 0.5, 0.2),
    SADDLE,
)
POSE = Similarity(1.0, (0.8, -0.2, 0.5, 0.3), (1.0, -2.0, 0.5))


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.kind)
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_distances_are_those_of_the_mirrored_points(field: Field, axis: str) -> None:
    move = Similarity(1.0, (0.9, 0.1, -0.3, 0.2), (3.0, 1.0, -2.0))
    group = Assembly(
        (Part(field, name="part", instances=(move,)), Part(Cylinder(0.5, 9), (1, 1, 0)))
    ).transformed(POSE)
    image = mirrored(group, axis, 1.5)
    points = np.random.default_rng(3).uniform(-6, 6, (400, 3))
    across = points.copy()
    across[:, "xyz".index(axis)] = 3.0 - across[:, "xyz".index(axis)]
    np.testing.assert_allclose(image.distance(across), group.distance(points), atol=1e-5)
    assert [part.name for part in image.parts] == ["part_mirrored", "cylinder_01_mirrored"]
    twice = mirrored(image, axis, 1.5)
    np.testing.assert_allclose(twice.distance(points), group.distance(points), atol=1e-5)


def test_no_axis_is_named() -> None:
    with pytest.raises(ParameterError, match="axis"):
        mirrored(Assembly((Part(Box((1, 1, 1))),)), "w")
