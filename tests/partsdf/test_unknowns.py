"""What a reconstruction moves: numbers as such, or in the family's spread where points leave them open."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import partwright as pw
from partwright.datasets.families.recipes import FAMILIES, make_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import PartVectors
from partwright.partsdf.poses import rotation_matrices
from partwright.partsdf.reconstruction import reconstruct_unknown
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.targets import NEAR, Target
from partwright.partsdf.unknowns import (
    FamilyUnknowns,
    Frame,
    FreeUnknowns,
    Unknowns,
    precision,
    unknowns_of,
)


def test_both_begin_where_the_start_is(model: Model) -> None:
    """Also with what the family's directions do not hold, as the latent of a part that is absent."""
    start = NeuralShape.trained(model, "lamp2")  # without a knob
    assert torch.equal(start.latents[2], model.latents[2, 2])
    ways: tuple[Unknowns, ...] = (FreeUnknowns(start, True), FamilyUnknowns(start, True, 100))
    for unknowns in ways:
        torch.testing.assert_close(unknowns.latents(), start.latents, atol=1e-5, rtol=0)
        poses = unknowns.poses()
        torch.testing.assert_close(poses.translation, start.poses.translation, atol=1e-5, rtol=0)
        torch.testing.assert_close(poses.scale, start.poses.scale, atol=1e-5, rtol=1e-5)
        turned = rotation_matrices(poses.rotation)
        torch.testing.assert_close(turned, rotation_matrices(start.poses.rotation), atol=1e-5, rtol=0)
        groups = unknowns.groups(ReconstructionSettings())
        assert all(t.requires_grad for group in groups for t in group["params"])
    held = FamilyUnknowns(start, False, 100)
    assert len(held.groups(ReconstructionSettings())) == 1
    assert held.poses() is start.poses


def test_the_prior_is_how_unlikely_all_parts_are_together(model: Model) -> None:
    """None at the means; as many times less as there are points, and as their errors are smaller; and the
    less, the more parts differ as those of training shapes do together."""
    vectors = PartVectors.of(model)
    mean = NeuralShape.of(model, model.mean_latent, vectors.poses(torch.zeros(3, 12)), model.present[0])
    none = FamilyUnknowns(mean, True, 100).prior(0.02, moved=True)
    assert float(none.detach()) == pytest.approx(0, abs=1e-9)
    form, place = torch.zeros(3, vectors.width), torch.zeros(3, 12)
    form[0, 0], place[1, 2] = 2.0, 3.0
    spread = vectors.pose_spread[:, 2]
    place[0, 2] = -3.0 * spread[0] / spread[1]  # so that the whole is where it was
    off = NeuralShape(model, vectors.latents(form), vectors.poses(place), model.present[0])
    unknowns = FamilyUnknowns(off, True, 100)
    numbers, weight = torch.cat([place, form], dim=1).flatten(), precision(model, vectors)
    expected = 0.5 * 0.02 / 100 * float(numbers @ weight @ numbers)
    assert float(unknowns.prior(0.02, moved=True).detach()) == pytest.approx(expected, rel=1e-3)
    for moved in (False, True):  # an optimiser that takes steps of one size follows any pull, however weak
        unknowns.prior(0.02, moved).backward()
        place = unknowns.groups(ReconstructionSettings())[1]["params"][0]
        assert (place.grad is not None) == moved
    fewer = FamilyUnknowns(off, True, 50).prior(0.01, moved=True)
    torch.testing.assert_close(fewer, unknowns.prior(0.02, moved=True))
    there = model.present[..., None]
    known = torch.cat([vectors.of_poses(model.poses), vectors.of_latents(model.latents)], dim=2) * there
    known = known.flatten(1)
    alone = known.square().sum(dim=1)
    assert float((known @ weight * known).sum(dim=1).mean()) < 0.8 * float(alone.mean())
    # As likely as any: parts of one shape each, which are not together in any.
    mixed = known.unflatten(1, (3, -1))[torch.arange(len(known))[:, None].add(torch.arange(3)) % len(known),
                                        torch.arange(3)].flatten(1)  # fmt: skip
    assert float((mixed @ weight * mixed).sum(dim=1).mean()) > 1.2 * float(
        (known @ weight * known).sum(dim=1).mean()
    )


def test_the_family_may_be_seen_anywhere_and_in_any_size(model: Model) -> None:
    """Of a piece of a shape a scan's own frame says nothing: what is likely is so in any other, too."""
    start, frame = (
        NeuralShape.trained(model, "lamp0"),
        Frame(torch.tensor([0.3, -0.2, 0.5]), torch.tensor(0.4)),
    )
    moved = frame.from_family(start.poses)
    for back, was in zip(frame.to_family(moved), start.poses, strict=True):
        torch.testing.assert_close(back, was, atol=1e-6, rtol=1e-5)
    vectors = PartVectors.of(model)
    usual = frame.from_family(vectors.poses(torch.zeros(3, 12)))
    for found, known in zip(Frame.of(vectors, usual), frame, strict=True):
        torch.testing.assert_close(found, known, atol=1e-5, rtol=1e-5)
    here, there = (FamilyUnknowns(replace(start, poses=p), True, 100) for p in (start.poses, moved))
    torch.testing.assert_close(here.prior(0.02, moved=True), there.prior(0.02, moved=True))
    torch.testing.assert_close(there.poses().scale, moved.scale, atol=1e-5, rtol=1e-5)
    # A surface is all of its shape, and stays in its frame.
    kinds = [len(FamilyUnknowns(start, True, count).groups(ReconstructionSettings())) for count in (100, 0)]
    assert kinds == [3, 2]


def test_small_families_and_known_parts_move_freely(model: Model) -> None:
    """Too few shapes have too few directions; known parts are found as the paper finds them."""
    start = NeuralShape.trained(model, "lamp0")
    places = torch.zeros(4, 3)
    surface = Target(places, places[:, 0])
    assert isinstance(unknowns_of(start, True, surface), FamilyUnknowns)
    assert float(unknowns_of(start, True, surface).prior(0.1, moved=True)) == 0
    known = replace(surface, part=torch.zeros(4))
    assert isinstance(unknowns_of(start, True, known), FreeUnknowns)
    few = replace(model, shapes=model.shapes[:8])  # latents have 8 numbers
    assert isinstance(unknowns_of(replace(start, model=few), True, surface), FreeUnknowns)
    never = replace(model, present=model.present & torch.tensor([True, True, False]))
    assert isinstance(unknowns_of(replace(start, model=never), True, surface), FreeUnknowns)


@pytest.mark.parametrize(
    ("noise", "iterations", "points", "least"),
    [(None, 60, 512, 0.95), (0.0, 60, 512, 0.92), (0.02, 400, 128, 0.7)],
)
def test_a_chair_is_found(noise: float | None, iterations: int, points: int, least: float) -> None:
    """One that no training saw: soon, in a surface (free numbers: IoU .85) and where points are exact (.86);
    and noise that is as large as its legs are thin is not followed, however long (.67)."""
    model, made = load_model("chairs"), make_shape("chairs", FAMILIES["chairs"], 1, 0)
    shape = pw.load_shape(made.whole)
    cloud = shape.unit_surface(2000, 0).points
    cloud = cloud + (noise or 0) * np.random.default_rng(0).standard_normal(cloud.shape)
    target = Target.of_shape(shape, 8000) if noise is None else Target.of_points(cloud, 8000)
    settings = ReconstructionSettings(
        iterations=iterations, points=points, starts=1, exchange=False, start="encoder"
    )
    found = reconstruct_unknown(model, target, settings)
    samples = shape.samples(9500, 500, 0, NEAR)
    inside, true = found.distances(samples.points) < 0, samples.distance < 0
    assert np.count_nonzero(inside & true) / np.count_nonzero(inside | true) > least
