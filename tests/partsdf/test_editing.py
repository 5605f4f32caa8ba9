"""Edits and interpolation: what changes, what stays, and which laws hold."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.errors import ModelError, SettingError
from partwright.partsdf import editing
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import PoseTensors, local_points, rotation_matrices, slerp

POINTS = np.random.default_rng(3).uniform(-0.9, 0.9, (200, 3)).astype(np.float32)
quaternions = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: math.hypot(*q) > 0.1)


@pytest.fixture(scope="module")
def lamp(model: Model) -> NeuralShape:
    return NeuralShape.trained(model, "lamp1")


def change(a: NeuralShape, b: NeuralShape) -> np.ndarray:
    """(P,) largest change of each part's distance."""
    return np.abs(a.part_distances(POINTS) - b.part_distances(POINTS)).max(axis=1)


def test_a_swap_takes_one_latent_and_the_others_adapt(model: Model, lamp: NeuralShape) -> None:
    other = NeuralShape.trained(model, "lamp3")
    edited = editing.swapped(lamp, "ball", other)
    assert edited.latents[1].equal(other.latents[1])
    assert edited.latents[[0, 2]].equal(lamp.latents[[0, 2]])
    assert all(a.equal(b) for a, b in zip(edited.poses, lamp.poses, strict=True))
    plate, ball, _ = change(edited, lamp)
    assert ball > 1e-3
    assert plate > 1e-5


def test_resampled_latents_are_like_those_of_the_training(model: Model, lamp: NeuralShape) -> None:
    drawn = torch.stack([editing.resampled(lamp, "plate", seed).latents[0] for seed in range(300)])
    known = model.latents[:, 0]
    torch.testing.assert_close(drawn.mean(0), known.mean(0), atol=0.15, rtol=0)
    torch.testing.assert_close(torch.cov(drawn.T), torch.cov(known.T), atol=0.15, rtol=0.3)
    assert editing.resampled(lamp, "plate", 1).latents.equal(editing.resampled(lamp, "plate", 1).latents)


def test_pose_edits_are_what_they_say(lamp: NeuralShape) -> None:
    moved = editing.moved(lamp, "knob", (0.1, 0.0, -0.2))
    torch.testing.assert_close(
        moved.poses.translation[2] - lamp.poses.translation[2], torch.tensor([0.1, 0.0, -0.2])
    )
    turned = editing.turned(lamp, "plate", (0, 0, 2), 90.0)
    quarter = rotation_matrices(turned.poses.rotation)[0] @ rotation_matrices(lamp.poses.rotation)[0].T
    torch.testing.assert_close(quarter, torch.tensor([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]), atol=1e-6, rtol=0)
    scaled = editing.scaled(lamp, "ball", (1.0, 2.0, 1.0))
    torch.testing.assert_close(scaled.poses.scale[1] / lamp.poses.scale[1], torch.tensor([1.0, 2.0, 1.0]))
    for edited in (moved, turned, scaled):
        assert change(edited, lamp).min() > 1e-6  # all parts hear of it


def test_dropped_parts_are_gone_and_can_come_back(model: Model, lamp: NeuralShape) -> None:
    bare = editing.without(lamp, "knob")
    assert bare.names() == ["plate", "ball"]
    assert bare.latents[2].equal(model.absent_latent[2])
    assert editing.with_latent(bare, "knob", lamp.latents[2]).names() == ["plate", "ball", "knob"]
    with pytest.raises(SettingError, match="keep at least one"):
        editing.without(lamp, "plate", "ball", "knob")


def test_interpolation_ends_where_it_should(model: Model, lamp: NeuralShape) -> None:
    other = NeuralShape.trained(model, "lamp2")  # without a knob
    for t, end in ((0.0, lamp), (1.0, other)):
        between = editing.interpolated(lamp, other, t)
        np.testing.assert_allclose(between.part_distances(POINTS), end.part_distances(POINTS), atol=1e-5)
    assert editing.interpolated(lamp, other, 0.4).names() == ["plate", "ball", "knob"]
    assert editing.interpolated(lamp, other, 0.6).names() == ["plate", "ball"]


def test_what_cannot_be_edited_is_said(model: Model, lamp: NeuralShape) -> None:
    with pytest.raises(SettingError, match=r"no part 'arm'; its parts are plate, ball, knob"):
        editing.moved(lamp, "arm", (0, 0, 0))
    with pytest.raises(SettingError, match="no direction"):
        editing.turned(lamp, "ball", (0, 0, 0), 10)
    with pytest.raises(SettingError, match="above 0"):
        editing.scaled(lamp, "ball", (1, 0, 1))
    with pytest.raises(SettingError, match="was not trained on 'lamp77'"):
        NeuralShape.trained(model, "lamp77")
    import dataclasses

    stranger = dataclasses.replace(lamp, model=dataclasses.replace(model, hash="other"))
    with pytest.raises(ModelError, match="different models"):
        editing.interpolated(lamp, stranger, 0.5)


@settings(max_examples=50)
@given(quaternions, quaternions, st.floats(0, 1))
def test_slerp_runs_at_constant_speed_the_short_way(a: tuple, b: tuple, t: float) -> None:
    first, last = (torch.tensor(q, dtype=torch.float64) / math.hypot(*q) for q in (a, b))
    middle = slerp(first, last, t)
    whole = 2 * math.acos(min(1.0, abs(float(first @ last))))
    part = 2 * math.acos(min(1.0, abs(float(first @ middle))))
    assert whole <= math.pi + 1e-9
    assert part == pytest.approx(t * whole, abs=1e-3)


@settings(max_examples=50)
@given(quaternions)
def test_rotation_matrices_are_those_of_assemblies(q: tuple) -> None:
    from partwright.assembly import Similarity

    mine = rotation_matrices(torch.tensor(q, dtype=torch.float64))
    np.testing.assert_allclose(mine, Similarity(1.0, q).matrix()[:3, :3], atol=1e-12)


def test_local_points_have_the_right_gradients() -> None:
    generator = torch.Generator().manual_seed(0)
    shapes = (1, 5, 3), (1, 2, 3), (1, 2, 4), (1, 2, 3)
    x, t, q, s = (torch.rand(n, generator=generator, dtype=torch.float64) + 0.3 for n in shapes)

    def local(*values: torch.Tensor) -> torch.Tensor:
        return local_points(values[0], PoseTensors(*values[1:]))

    assert torch.autograd.gradcheck(local, tuple(v.requires_grad_() for v in (x, t, q, s)))
