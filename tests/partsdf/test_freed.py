"""What a family's directions do not reach: numbers that move freely, of near kin alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf import freed
from partwright.partsdf.editing import moved
from partwright.partsdf.familiarity import POOR, Familiarity, familiarity
from partwright.partsdf.freed import judged
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import mean_error
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.targets import Target
from partwright.partsdf.unknowns import FreeUnknowns

QUICK = ReconstructionSettings(iterations=60, points=512)
KNOB = 2


def without_knob(model: Model, number: int) -> NeuralShape:
    lamp = NeuralShape.trained(model, f"lamp{number}")
    return replace(lamp, present=torch.tensor([True, True, False]))


@pytest.fixture
def bare(model: Model) -> NeuralShape:
    """A lamp without a knob, whose number went astray while others were looked for."""
    return without_knob(model, 0)


@pytest.fixture
def target(bare: NeuralShape, lamps: PreparedFamily) -> Target:
    return own_target(bare, lamps.load(0).points)


def own_target(bare: NeuralShape, points: np.ndarray) -> Target:
    own = NeuralShape.of(bare.model, bare.latents, bare.poses, bare.present)
    return Target(torch.from_numpy(points), torch.from_numpy(own.distances(points)))


def as_if(monkeypatch: pytest.MonkeyPatch, residual: float) -> Familiarity:
    known = Familiarity("lamps", residual, {}, 0.5)
    monkeypatch.setattr(freed, "familiarity", lambda *_: known)
    return known


def test_kin_that_is_not_near_yet_comes_nearer(
    bare: NeuralShape, target: Target, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = as_if(monkeypatch, residual=0.1)
    astray = moved(bare, "ball", (0.05, 0, 0))
    found, told = judged(astray, target, QUICK)
    assert mean_error(found, target) < 0.5 * mean_error(astray, target)
    assert told is known  # how it compared with the family before that
    # Parts that are not there are as an assembly has them: else it would be another shape.
    assert torch.equal(found.latents[KNOB], bare.model.absent_latent[KNOB])
    for mine, usual in zip(found.poses, bare.model.average_pose, strict=True):
        torch.testing.assert_close(mine[KNOB], usual[KNOB])


def test_what_is_near_and_what_is_no_kin_stays(
    bare: NeuralShape, target: Target, lamps: PreparedFamily, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lamp that the model knows best is near; which that is differs between processors."""
    bared = [without_knob(bare.model, number) for number in range(8)]
    known_lamps = [(one, own_target(one, lamps.load(number).points)) for number, one in enumerate(bared)]
    best, own = min(known_lamps, key=lambda pair: familiarity(*pair).residual)
    found, known = judged(best, own, QUICK)
    assert found is best
    assert known == familiarity(best, own)
    for residual in (0.02, POOR + 0.01):
        told = as_if(monkeypatch, residual)
        found, known = judged(bare, target, QUICK)
        assert found is bare
        assert known is told
    as_if(monkeypatch, 0.1)
    of_points = replace(target, low=torch.zeros_like(target.sdf))
    assert judged(bare, of_points, QUICK)[0] is bare


def test_what_is_held_does_not_move(bare: NeuralShape) -> None:
    unknowns = FreeUnknowns(bare, True, bare.present)
    optimiser: Any = torch.optim.SGD(unknowns.groups(QUICK))
    loss = unknowns.latents().sum() + sum(pose.sum() for pose in unknowns.poses())
    loss.backward()
    optimiser.step()
    still = ~bare.present
    assert torch.equal(unknowns.latents()[still], bare.latents[still])
    assert not torch.equal(unknowns.latents()[~still], bare.latents[~still])
    for mine, given in zip(unknowns.poses(), bare.poses, strict=True):
        assert torch.equal(mine[still], given[still])
        assert not torch.equal(mine[~still], given[~still])
