"""An assembly's numbers, their derivatives, and parts that grow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import partwright as pw
from partwright.errors import ParameterError
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Extrusion,
    Frustum,
    HollowBox,
    Pipe,
    Profile,
    Revolution,
    Sphere,
    SuperFrustum,
    Torus,
    Tube,
)
from partwright.fields.profile import circle
from partwright.tolerances.feasible_offset import grown
from partwright.tolerances.leaves import free_numbers, moved, numbers, slope, weigh, with_numbers
from tests.tolerances.shapes import ALL

PLATE = Profile([(-0.5, -0.4), (0.5, -0.4, 0.5), (0.5, 0.3), (0, 0.3), (-0.5, 0.1)], [circle(0.15)])
SOLIDS = (
    Box((0.8, 0.5, 0.3)),
    Cylinder(0.4, 0.7),
    Sphere(0.4),
    Capsule(0.2, 0.5),
    Tube(0.5, 0.2, 0.6),
    Torus(0.5, 0.15),
    HollowBox((0.8, 0.7, 0.5), 0.15),
    Cone(0.4, 0.8),
    Frustum(0.5, 0.2, 0.6),
    Frustum(0.3, 0.5, 0.6),
    SuperFrustum((0.6, 0.4, 0.5), 0.5, 0.05, 0.8),
    SuperFrustum((0.6, 0.6, 0.5), 1.0, 0.0, 1.0, 0.0, 0.6),
    Extrusion(PLATE, 0.4),
    Extrusion(Profile.rectangle(0.8, 0.6, 0.2), 0.5, top_fillet=0.15, bottom_chamfer=0.1),
    Extrusion(Profile.rectangle(0.9, 0.8, 0.3), 0.3, 10),
    Pipe(((-0.5, -0.4, 0), (0.4, -0.4, 0, 0.3), (0.4, 0.4, 0, 0.3), (0.4, 0.4, 0.5)), 0.12),
    Pipe(((-0.5, -0.4, 0), (0.4, -0.4, 0, 0.4), (0.4, 0.5, 0)), 0.25, 0.12),
    Revolution(Profile([(0, -0.3), (0.5, -0.3), (0.5, 0.1), (0.3, 0.3, 0.3), (0, 0.35)])),
)
POINTS = np.random.default_rng(0).uniform(-1, 1, (4000, 3)).astype(np.float32)


@pytest.mark.parametrize("name", ALL)
def test_the_fold_is_the_assemblys_own_distance(name: str) -> None:
    assembly = ALL[name]()[1]
    value, _ = weigh(assembly, POINTS)
    np.testing.assert_allclose(value, assembly.distance(POINTS), atol=2e-5)


def profiles() -> pw.Assembly:
    """Two copies of a plate with a rim, a hole in it, and a turned knob."""
    plate = pw.Part(
        Extrusion(PLATE, 0.4, top_fillet=0.05),
        (0, 0, -0.3),
        instances=(pw.assembly.Similarity(translation=(0.2, 0, 0.5)),),
    )
    knob = pw.Part(SOLIDS[-1], (0.3, 0.2, 0.2), (0.9, 0.2, 0.3, 0.1))
    return (plate | knob) - pw.Part(Extrusion(Profile.regular(6, 0.2), 1.0))


@pytest.mark.parametrize("name", [*ALL, "profiles"])
def test_slopes_are_finite_differences_of_the_whole(name: str) -> None:
    assembly = profiles() if name == "profiles" else ALL[name]()[1]
    free = [free_numbers(part) for part in assembly.parts]
    by_number, column, step = slope(assembly, POINTS, free).by_number, 0, 4e-3
    for part, may in zip(assembly.parts, free, strict=True):
        for number in np.flatnonzero(may):
            move = step * (np.arange(len(may)) == number)
            high, low = (
                assembly.replace_part(part.name, moved(part, m)).distance(POINTS) for m in (move, -move)
            )
            off = np.abs((high - low) / (2 * step) - by_number[:, column])
            assert np.quantile(off, 0.9) < 0.02  # the rest lies at creases
            column += 1
    assert column == by_number.shape[1]


@pytest.mark.parametrize("field", SOLIDS, ids=lambda field: field.kind)
@settings(max_examples=15)
@given(by=st.floats(-0.05, 0.1))
def test_a_grown_part_lies_that_much_further_out(field, by: float) -> None:
    """Everywhere that the part reached, and only a little beyond."""
    part = pw.Part(field, (0.1, 0, 0), (0.9, 0.2, 0.3, 0.1))
    before, after = (pw.Assembly([one]).distance(POINTS) for one in (part, grown(part, by)))
    if by >= 0:
        assert after[np.abs(before) < 0.1].max() <= (before - by)[np.abs(before) < 0.1].max() + 1e-4
        assert (after <= 1e-4)[before <= by - 1e-4].all()
    else:
        assert (after > -1e-4)[before > by + 1e-4].all()
    assert (np.abs(after - before) < 3 * abs(by) + 1e-4).all()


@pytest.mark.parametrize("field", SOLIDS, ids=lambda field: field.kind)
def test_of_a_part_that_shrinks_by_more_than_it_is_nothing_is_left(field) -> None:
    with pytest.raises(ParameterError):
        grown(pw.Part(field), -1.0)


@pytest.mark.parametrize("field", SOLIDS, ids=lambda field: field.kind)
def test_numbers_come_and_go(field) -> None:
    assert with_numbers(field, numbers(field)) == field


def test_what_is_plain_stays_plain() -> None:
    part = pw.Part(SuperFrustum((1, 1, 1), 0.0, 0.0, 1.0, 0.0, 0.3))
    free = free_numbers(part)
    assert free.tolist() == [True] * 3 + [False] * 3 + [True] * 3 + [False] * 4 + [True, False]
    turned = replace(part, rotation=(0.9, 0.1, 0, 0), blend=0.1)
    assert free_numbers(turned)[[3, 4, 5, -1]].all()
