"""A box is the same box by any of its 24 names; a model is asked by the name that it learned."""

from __future__ import annotations

from dataclasses import replace

import torch

from partwright.datasets.agreement import AXIS_NAMINGS
from partwright.datasets.poses import Poses
from partwright.datasets.prepared import PreparedFamily
from partwright.partsdf.model import Model
from partwright.partsdf.part_vectors import quaternions
from partwright.partsdf.pose_naming import named_like
from partwright.partsdf.poses import PoseTensors, rotation_matrices
from partwright.partsdf.reconstruction import reconstruct
from partwright.partsdf.settings import ReconstructionSettings


def renamed(poses: PoseTensors, naming: torch.Tensor) -> PoseTensors:
    """The same boxes, their axes named otherwise."""
    turned = quaternions(rotation_matrices(poses.rotation) @ naming)
    return PoseTensors(poses.translation, turned, (naming.abs().T @ poses.scale[..., None]).squeeze(-1))


def test_all_names_of_a_box_come_to_the_reference_s() -> None:
    """As long as it is turned by less than half of a quarter from it; what has its name stays to the bit."""
    generator = torch.Generator().manual_seed(0)
    turn = torch.tensor([1.0, 0, 0, 0]) + 0.15 * torch.randn(5, 4, generator=generator)
    turn = turn / turn.norm(dim=-1, keepdim=True)
    size = torch.tensor([0.8, 0.5, 0.3]) * torch.exp(0.05 * torch.randn(5, 3, generator=generator))
    poses = PoseTensors(torch.randn(5, 3, generator=generator), turn, size)
    reference = PoseTensors(
        torch.zeros(5, 3),
        torch.tensor([[1.0, 0, 0, 0]]).expand(5, 4),
        torch.tensor([[0.8, 0.5, 0.3]]).expand(5, 3),
    )
    for mine, theirs in zip(named_like(poses, reference), poses, strict=True):
        assert torch.equal(mine, theirs)
    for naming in torch.from_numpy(AXIS_NAMINGS).float():
        found = named_like(renamed(poses, naming), reference)
        torch.testing.assert_close(found.scale, poses.scale)
        torch.testing.assert_close(rotation_matrices(found.rotation), rotation_matrices(poses.rotation))


def test_a_shape_that_was_prepared_apart_is_found_as_well(model: Model, lamps: PreparedFamily) -> None:
    """Its plate named by another axis: the same start, and so the same shape."""
    shape = lamps.load(0)
    naming = torch.tensor([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
    other = renamed(PoseTensors.of(shape.poses), naming)
    apart = replace(shape, poses=Poses(*(t.numpy() for t in other)))
    few = ReconstructionSettings(iterations=2, points=256, starts=1)
    known, found = (reconstruct(model, one, few) for one in (shape, apart))
    for mine, theirs in zip(found.poses, known.poses, strict=True):
        torch.testing.assert_close(mine[0], theirs[0], atol=1e-4, rtol=0)
    torch.testing.assert_close(found.latents[0], known.latents[0], atol=1e-3, rtol=0)
