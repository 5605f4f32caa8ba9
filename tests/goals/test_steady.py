"""Learned parts that are frozen beside others that are not: their surface stays, too."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Assembly
from partwright.goals import Parameters
from partwright.goals.steady import broken_by, gradients, held_parts, moved
from partwright.partsdf import NeuralShape, load_model, to_assembly

_LIMIT = 1e-4


@pytest.fixture(scope="module")
def car() -> Assembly:
    return to_assembly(NeuralShape.trained(load_model("cars"), "3"))


def test_parts_that_stay_beside_some_that_move_are_held(car: Assembly) -> None:
    moves = [part.name == "body" for part in car.parts]
    wheels = held_parts(car, moves)
    assert [car.parts[one.part].name for one in wheels] == [p.name for p in car.parts if p.name != "body"]
    assert not held_parts(car, [True] * len(car))
    assert not held_parts(car, [False] * len(car))
    for one in wheels:
        assert np.abs(one.distance).max() < 0.02 * np.ptp(car.bounds(), axis=0).max()
        spread = np.linalg.norm(one.points[:32, None] - one.points[None, :32], axis=2)
        size = np.ptp(one.points, axis=0).max()
        assert spread[np.triu_indices(32, 1)].min() > 0.08 * size


def test_what_a_held_part_moves_is_measured_and_its_derivatives_are_those_of_differences(
    car: Assembly,
) -> None:
    parameters = Parameters(car)
    longest = parameters.longest
    wheel = held_parts(car, [part.name != "wheel_back_left" for part in car.parts])
    assert max(broken_by(wheel, car, _LIMIT, longest)) < 0
    assert moved(wheel, car, longest) == {"wheel_back_left": 0.0}

    rows = gradients(wheel, parameters, longest)
    assert rows.shape == (64, len(parameters))
    own = parameters.slices[[part.name for part in car.parts].index("body")]
    direction = np.zeros(len(parameters))
    latent = slice(own.start + 6, own.stop - 3)
    direction[latent] = np.random.default_rng(0).normal(size=latent.stop - latent.start)
    step = 5e-4
    ends = (parameters.with_values(parameters.values + s * step * direction) for s in (1, -1))
    ahead, back = (np.array(broken_by(wheel, end, _LIMIT, longest)) for end in ends)
    expected = (ahead - back) / (2 * step)
    scale = np.abs(expected).max()
    assert scale > 1e-3  # the wheel's surface does follow the body's latent
    assert rows @ direction == pytest.approx(expected, abs=0.05 * scale)

    other = parameters.with_values(parameters.values + 0.3 * direction)
    far = moved(wheel, other, longest)["wheel_back_left"]
    assert far > _LIMIT
    assert max(broken_by(wheel, other, _LIMIT, longest)) > 0
