"""Learned parts: latents and poses differentiated through a model that ships, and the trained region."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.assembly import Assembly
from partwright.goals import Parameters, parameter_gradient
from partwright.goals.regions import TrainedRegion
from partwright.partsdf import NeuralShape, load_model, to_assembly


@pytest.fixture(scope="module")
def car() -> Assembly:
    return to_assembly(NeuralShape.trained(load_model("cars"), "3"))


def test_speeds_of_a_learned_surface_are_those_of_finite_differences(car: Assembly) -> None:
    """At places on the body: how far the level moves along its normal with latent, place, turn and length."""
    parameters = Parameters(car)
    rng = np.random.default_rng(0)
    box = car["body"].bounds()
    places = rng.uniform(box[0], box[1], (220, 3))
    for _ in range(3):
        value, slope = car.distance(places), slopes(car, places)
        places = places - (value / (slope**2).sum(1))[:, None] * slope
    on = np.abs(car.distance(places)) < 1e-4
    own = car.part_distances(places)[1:].min(axis=0) > 0.1  # the body alone
    places = places[on & own][:50]
    slope = slopes(car, places)
    steep = np.linalg.norm(slope, axis=1)
    normals = slope / steep[:, None]
    across = np.cross(normals, np.eye(3)[np.abs(normals).argmin(1)])
    vertices = np.concatenate([places, places + 1e-3 * across, places + 1e-3 * np.cross(normals, across)])
    count = len(places)
    assert count > 20
    loss = np.zeros_like(vertices)
    loss[:count] = normals
    gradient = parameter_gradient(parameters, vertices, np.arange(3 * count).reshape(3, count).T, loss)
    for name in ("ty", "wy", "latent_0", "half_x"):
        k = next(i for i in range(len(parameters)) if parameters.name(i) == f"body.{name}")
        step = np.zeros(len(parameters))
        step[k] = 4e-3
        there, back = (parameters.with_values(parameters.values + s * step).distance(places) for s in (1, -1))
        expected = float((-(there - back) / 8e-3 / steep).sum())
        scale = float(np.abs((there - back) / 8e-3 / steep).sum())
        assert gradient[k] == pytest.approx(expected, abs=0.03 * scale + 1e-3), name


def slopes(assembly: Assembly, places: np.ndarray, step: float = 2e-3) -> np.ndarray:
    sides = [[assembly.distance(places + s * step * e) for s in (1, -1)] for e in np.eye(3)]
    return np.stack([(a - b) / (2 * step) for a, b in sides], axis=1)


def test_a_shape_of_the_training_is_inside_of_what_was_trained_and_a_far_latent_is_not(car: Assembly) -> None:
    parameters = Parameters(car)
    region = TrainedRegion(parameters)
    assert region.outside(parameters.values) < 1.0
    far = parameters.values.copy()
    own = region.parts[0][0]
    far[own] = 10 * far[own] + 1.0
    assert region.outside(far) > 1.0

    value, slope = region.measure(parameters.values)
    step = np.zeros(len(parameters))
    step[own] = np.random.default_rng(0).normal(size=own.stop - own.start)
    ends = [region.measure(parameters.values + s * 1e-6 * step)[0] for s in (1, -1)]
    assert value > 0
    assert slope @ step == pytest.approx((ends[0] - ends[1]) / 2e-6, rel=1e-4)
