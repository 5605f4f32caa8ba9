"""Parts that were found and are not there: left out where they stand in the air, and nowhere else."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch
import trimesh

import partwright as pw
from partwright.datasets.prepared import PreparedFamily
from partwright.errors import SettingError
from partwright.partsdf.editing import moved
from partwright.partsdf.model import Model
from partwright.partsdf.needless import needed
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import _of_needed, mean_error
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.targets import Target

KNOB = 2


class Asked:
    """A lamp that says its distances wherever it is asked."""

    def __init__(self, lamp: NeuralShape) -> None:
        self.unit_distance = lamp.distances


@pytest.fixture
def lamp(model: Model) -> NeuralShape:
    return NeuralShape.trained(model, "lamp0")


def target_of(lamp: NeuralShape, lamps: PreparedFamily) -> Target:
    points = lamps.load(0).points
    asked: Any = Asked(lamp)
    return Target(torch.from_numpy(points), torch.from_numpy(lamp.distances(points)), shape=asked)


def without_knob(lamp: NeuralShape) -> NeuralShape:
    return replace(lamp, present=torch.tensor([True, True, False]))


def test_what_stands_in_the_air_is_left_out(lamp: NeuralShape, lamps: PreparedFamily) -> None:
    bare, whole = without_knob(lamp), target_of(lamp, lamps)
    assert needed(lamp, target_of(bare, lamps)).tolist() == [True, True, False]
    assert needed(lamp, whole).all()
    assert needed(bare, whole).tolist() == [True, True, False]  # what was not found stays so
    # Half in its place it explains more than it is in the way, and beside its place it does not.
    assert needed(moved(lamp, "knob", (0, 0, 0.06)), whole).all()
    assert needed(moved(lamp, "knob", (0, 0, 0.6)), whole).tolist() == [True, True, False]
    # Something stays, however little there is.
    nothing = replace(whole, shape=Asked(moved(lamp, "plate", (9, 9, 9))), sdf=torch.ones_like(whole.sdf))
    assert needed(replace(lamp, present=torch.tensor([True, False, False])), nothing).tolist() == [
        True,
        False,
        False,
    ]


def test_points_do_not_tell_where_air_is(lamp: NeuralShape, lamps: PreparedFamily) -> None:
    told = replace(target_of(without_knob(lamp), lamps), shape=None)
    assert needed(lamp, told).all()
    with pytest.raises(SettingError, match="only samples"):
        told.distances(np.zeros((1, 3)))


def test_what_is_left_goes_on(
    lamp: NeuralShape, lamps: PreparedFamily, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To where it was kept from: a ball too far aside, beside a knob that is not there."""
    target = target_of(without_knob(lamp), lamps)
    found = moved(lamp, "ball", (0.1, 0, 0))
    settings = ReconstructionSettings(iterations=200, points=512)
    strange = "partwright.partsdf.familiarity.STRANGE"
    monkeypatch.setattr(strange, 9.0)  # a model of so few shapes finds most lamps odd
    after = _of_needed(found, target, settings, 0, None)
    assert after.present.tolist() == [True, True, False]
    assert mean_error(after, target) < 0.7 * mean_error(without_knob(found), target)
    # A stranger is told by how oddly all its parts lie, so these stay.
    with monkeypatch.context() as patch:
        patch.setattr(strange, 0.0)
        assert _of_needed(found, target, settings, 0, None) is found
    good = _of_needed(lamp, target_of(lamp, lamps), settings, 0, None)
    assert good is lamp  # to the bit, and at no cost


def test_a_target_may_be_asked_wherever_it_is_turned() -> None:
    shape = pw.load_shape(trimesh.creation.box((2, 1, 0.5)))
    target = Target.of_shape(shape, 500)
    half = math.sqrt(0.5)
    for turn in ((half, 0, 0, half), (half, half, 0, 0)):
        target = target.turned(turn)
        np.testing.assert_allclose(target.distances(target.points.numpy()), target.sdf, atol=1e-5)
