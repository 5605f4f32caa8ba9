"""Whether the poses of all parts are such as the family has: each may be, and all together not."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch

import partwright as pw
from partwright.datasets.families.recipes import FAMILIES, make_shape
from partwright.partsdf.familiarity import familiarity
from partwright.partsdf.layout import layout_oddness
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct_unknown
from partwright.partsdf.targets import Target


def test_parts_of_many_chairs_are_no_layout_of_a_chair() -> None:
    """Each lies as in some chair that was trained on, all together as in none."""
    model = load_model("chairs")
    (whole,) = model.present.all(dim=1).nonzero(as_tuple=True)
    own = [layout_oddness(NeuralShape.trained(model, str(i))) for i in whole[::40].tolist()]
    parts = torch.arange(len(model.parts))
    mixed = []
    for k in range(3):
        rows = whole[(37 * k + 11 * parts) % len(whole)]
        poses = model.poses.map(lambda t, rows=rows: t[rows, parts])
        mixed.append(layout_oddness(NeuralShape(model, model.latents[rows, parts], poses, parts >= 0)))
    assert max(own) < 1.5
    assert min(mixed) > 2


def test_training_shapes_are_measured_by_the_spread_of_the_others(model: Model) -> None:
    """As many numbers as shapes hold each of them in their own spread, but not one that is held out."""
    rows = torch.arange(len(model.shapes)) > 0
    others = replace(
        model,
        latents=model.latents[rows],
        poses=model.poses.map(lambda t: t[rows]),
        present=model.present[rows],
        shapes=model.shapes[1:],
    )
    first = NeuralShape.trained(model, model.shapes[0])
    assert layout_oddness(replace(first, model=others)) < 2.5
    far = first.poses._replace(translation=first.poses.translation + torch.tensor([0.5, 0.0, 0.0]))
    assert layout_oddness(replace(first, poses=far)) > 3
    alone = replace(others, latents=others.latents[:1], poses=others.poses.map(lambda t: t[:1]),
                    present=others.present[:1], shapes=others.shapes[:1])  # fmt: skip
    assert layout_oddness(replace(first, model=alone)) == 0


@pytest.mark.parametrize(("family", "strange"), [("chairs", False), ("cars", True)])
def test_a_car_among_chairs_is_told_so(family: str, strange: bool) -> None:
    """Its residual alone does not tell it: real chairs come to as much."""
    shape = pw.load_shape(make_shape(family, FAMILIES[family], 1, 0).whole)
    settings = ReconstructionSettings(iterations=60, points=512, starts=1, exchange=False, start="encoder")
    target = Target.of_shape(shape, 8000)
    known = familiarity(reconstruct_unknown(load_model("chairs"), target, settings), target)
    assert bool(known.warnings()) == strange
    assert (known.layout > 1.8) == strange
