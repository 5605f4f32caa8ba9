"""Poses of noise lie to one another as in the family before forms are made for them."""

from __future__ import annotations

import torch

from partwright.partsdf.editing import moved
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import POSE, PartVectors
from partwright.partsdf.pose_range import OFFSET, within_range
from partwright.partsdf.soundness import largest_offset


def layout_of(vectors: PartVectors, shape: NeuralShape) -> torch.Tensor:
    return torch.cat([vectors.of_poses(shape.poses), 2.0 * shape.present[:, None] - 1], dim=1)


def test_what_lies_oddly_comes_back_and_all_else_stays(model: Model) -> None:
    """A ball a tenth above its plate comes down, and its plate up; one a hundredth above it stays, as all do
    where nothing may move."""
    vectors, free = PartVectors.of(model), torch.zeros(3, dtype=torch.bool)
    known = NeuralShape.trained(model, "lamp2")
    start = largest_offset(known)[0]
    odd, fine = (moved(known, "ball", (0, 0, by - start)) for by in (0.1, 0.01))
    assert largest_offset(odd)[0] > 2 * OFFSET > 4 * largest_offset(fine)[0] > 0
    layouts = torch.stack([layout_of(vectors, one) for one in (odd, fine)])
    mine = within_range(model, vectors, layouts, free)
    back = NeuralShape.of(model, known.latents, vectors.poses(mine[0, :, :POSE]), known.present)
    assert largest_offset(back)[0] <= 0.011
    assert float((back.poses.translation - odd.poses.translation)[known.present].abs().max()) < 0.1
    assert torch.equal(mine[1], layouts[1])
    assert torch.equal(mine[:, :, POSE:], layouts[:, :, POSE:])
    plate = torch.tensor([True, False, False])
    assert torch.equal(within_range(model, vectors, layouts, plate)[0, 0], layouts[0, 0])
    assert torch.equal(within_range(model, vectors, layouts, ~free), layouts)
    # Nor where those that lie oddly are kept, or do so in what these are like.
    names = model.parts
    both = torch.tensor([name in ("ball", "plate") for name in names])
    assert torch.equal(within_range(model, vectors, layouts, both), layouts)
    assert torch.equal(within_range(model, vectors, layouts, free, layouts[0]), layouts)
