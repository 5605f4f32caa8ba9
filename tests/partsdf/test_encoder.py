"""Points to parts at once: clouds as scans give them, and reconstructions that begin with what is seen."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree

from partwright.assembly.similarity import NO_ROTATION
from partwright.datasets.prepared import PreparedFamily
from partwright.errors import EmptyShapeError, FamilyError, ModelError, ParameterError, SettingError
from partwright.partsdf.clouds import PartClouds, draw
from partwright.partsdf.companions import beside
from partwright.partsdf.encoder import KIND, Encoder, EncoderSettings, load_encoder
from partwright.partsdf.encoder_training import train_encoder
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.optimisation import Step
from partwright.partsdf.part_vectors import PartVectors, quaternions
from partwright.partsdf.poses import rotation_matrices
from partwright.partsdf.reconstruction import ReconstructionSettings, mean_error, reconstruct_unknown
from partwright.partsdf.starts import find_starts
from partwright.partsdf.targets import Target
from partwright.shapes.sampling import sample_triangles

SMALL = EncoderSettings(width=32, heads=2, rounds=1, blocks=1, beside=4)


@pytest.fixture(scope="module")
def saved(model: Model, tmp_path_factory: pytest.TempPathFactory) -> Model:
    """The model, from a file of its own."""
    return model.save(tmp_path_factory.mktemp("encoded") / "lamps.safetensors")


@pytest.fixture(scope="module")
def encoder(saved: Model, lamps: PreparedFamily) -> Encoder:
    torch.set_num_threads(1)
    made = train_encoder(saved, lamps, steps=200, rate=4e-3, settings=SMALL)
    path = beside(saved, KIND)
    assert path is not None
    made.save(path)
    return made


def surface(lamps: PreparedFamily, index: int, count: int = 600) -> torch.Tensor:
    shape = lamps.load(index)
    near = np.abs(shape.sdf) < 0.01
    return torch.from_numpy(shape.points[near][:count])


def target_of(lamps: PreparedFamily, index: int) -> Target:
    shape = lamps.load(index)
    return Target(torch.tensor(shape.points), torch.tensor(shape.sdf), surface=surface(lamps, index))


def test_vectors_hold_latents_and_poses(model: Model) -> None:
    vectors = PartVectors.of(model)
    there = model.present
    again = vectors.latents(vectors.of_latents(model.latents))
    torch.testing.assert_close(again[there], model.latents[there], atol=1e-4, rtol=0)
    nearly = model.latents + 0.01 * model.latents.std() * torch.randn(
        model.latents.shape, generator=torch.Generator().manual_seed(1)
    )
    assert vectors.nearest_trained(model, nearly)[there].equal(model.latents[there])
    poses = vectors.poses(vectors.of_poses(model.poses))
    for mine, theirs in zip(poses[::2], model.poses[::2], strict=True):
        torch.testing.assert_close(mine, theirs, atol=1e-5, rtol=0)
    spread = vectors.of_latents(model.latents)[there[:, 0], 0].std(dim=0)
    torch.testing.assert_close(spread, torch.ones_like(spread), atol=1e-3, rtol=0)
    turn = torch.nn.functional.normalize(
        torch.randn(200, 4, generator=torch.Generator().manual_seed(0)), dim=1
    )
    back = quaternions(rotation_matrices(turn))
    torch.testing.assert_close((back * turn).sum(dim=1).abs(), torch.ones(200))


def test_clouds_lie_on_the_surface_that_their_poses_tell_of(saved: Model, lamps: PreparedFamily) -> None:
    """Plain clouds lie on the shape; what tilts, cuts and reframes them moves the poses along."""
    clouds = PartClouds.of(lamps, saved)
    shapes = torch.tensor([0, 1, 4])
    generator = torch.Generator().manual_seed(0)
    drawn = draw(clouds, saved, shapes, 300, generator, plain=True)
    for i, s in enumerate(shapes.tolist()):
        shape = lamps.load(s)
        dense, _ = sample_triangles(shape.vertices.astype(float), shape.faces.astype(int), 20_000, 0)
        assert cKDTree(dense).query(drawn.points[i].numpy())[0].max() < 0.04
    scanned = draw(clouds, saved, shapes.repeat(20), 300, generator)
    extent = scanned.points.amax(dim=1) - scanned.points.amin(dim=1)
    torch.testing.assert_close(extent.amax(dim=1), torch.full((60,), 1.8))
    # The ball's centre, as far from the cloud's points as its radius, wherever noise is small.
    centre, radius = scanned.poses.translation[:, 1], scanned.poses.scale[:, 1].mean(dim=1)
    nearest = (scanned.points - centre[:, None]).norm(dim=2).amin(dim=1)
    assert ((nearest / radius - 1).abs().median()) < 0.1
    assert (scanned.present == saved.present[shapes.repeat(20)]).all()


def test_it_tells_poses_and_presence_of_a_held_out_shape(encoder: Encoder, lamps: PreparedFamily) -> None:
    found = [encoder.encode(surface(lamps, i)[None])[0] for i in range(24)]
    right = [(one.present == encoder.model.present[i]).all() for i, one in enumerate(found)]
    assert sum(right) >= 21
    sizes = np.array([one.poses.scale[1, 0] for one in found])  # of the ball, which is as large as it pleases
    assert np.corrcoef(sizes, encoder.model.poses.scale[:, 1, 0])[0, 1] > 0.5
    held = lamps.load(lamps.split("test")[0])
    (mine,) = encoder.encode(surface(lamps, lamps.split("test")[0])[None])
    assert np.abs(mine.poses.translation.numpy() - held.translation)[:2].max() < 0.15
    # Wherever the cloud lies, and however large it is.
    (moved,) = encoder.encode(3 * surface(lamps, 0)[None] + torch.tensor([5.0, -1.0, 2.0]))
    (plain,) = encoder.encode(surface(lamps, 0)[None])
    expected = 3 * plain.poses.translation + torch.tensor([5.0, -1.0, 2.0])
    there = plain.present
    torch.testing.assert_close(moved.poses.translation[there], expected[there], atol=1e-3, rtol=0)
    torch.testing.assert_close(moved.poses.scale[there], 3 * plain.poses.scale[there], atol=1e-3, rtol=1e-3)


def test_reconstruction_begins_with_what_it_sees(encoder: Encoder, lamps: PreparedFamily) -> None:
    model, target = encoder.model, target_of(lamps, lamps.split("test")[0])
    (start,) = find_starts(model, target, [NO_ROTATION], ReconstructionSettings(start="encoder"))
    assert start.encoded
    as_seen = reconstruct_unknown(model, target, ReconstructionSettings(start="encoder", iterations=0))
    refined = reconstruct_unknown(
        model, target, ReconstructionSettings(start="encoder", iterations=60, points=512)
    )
    assert mean_error(refined, target) < 0.5 * mean_error(as_seen, target)
    # One iteration is enough to exchange parts for those of training shapes that fit better.
    steps: list[Step] = []
    at_once = ReconstructionSettings(start="encoder", iterations=1, points=512)
    exchanged = reconstruct_unknown(model, target, at_once, told=steps.append)
    assert mean_error(exchanged, target) < 0.9 * mean_error(as_seen, target)
    assert [(step.number, step.of) for step in steps] == [(1, 2), (2, 2)]
    # By itself it is one of the starts, of which a few iterations choose.
    starts = find_starts(model, target, [NO_ROTATION], ReconstructionSettings(starts=3))
    assert [one.encoded for one in starts] == [True, False, False]
    quick = ReconstructionSettings(iterations=40, points=512, starts=3)
    assert mean_error(reconstruct_unknown(model, target, quick), target) < mean_error(as_seen, target)


def test_its_file_is_for_one_model(
    encoder: Encoder, saved: Model, lamps: PreparedFamily, tmp_path: Path
) -> None:
    again = load_encoder(saved)
    assert again is not None
    (one,), (two,) = encoder.encode(surface(lamps, 0)[None]), again.encode(surface(lamps, 0)[None])
    torch.testing.assert_close(one.latents, two.latents, atol=5e-3, rtol=0)  # half precision
    with pytest.raises(ModelError, match="trained for another model than lamps"):
        load_encoder(replace(saved, hash="0" * 64), beside(saved, KIND))
    assert load_encoder(replace(saved, hash="1" * 64)) is None
    data = Path(beside(saved, KIND) or "").read_bytes()
    (tmp_path / "cut.safetensors").write_bytes(data[:-100])
    with pytest.raises(ModelError, match="damaged, or no encoder"):
        load_encoder(saved, tmp_path / "cut.safetensors")
    saved.save(tmp_path / "model.safetensors")
    with pytest.raises(ModelError, match="holds no encoder"):
        load_encoder(saved, tmp_path / "model.safetensors")
    # A companion is no model, and is not offered as one.
    with pytest.raises(
        ModelError, match=r"named 'lamps.encoder'; here are: cars, chairs, mixers, vehicles\."
    ):
        load_model("lamps.encoder")


def test_bad_points_and_families_are_told(
    encoder: Encoder, saved: Model, lamps: PreparedFamily, model: Model
) -> None:
    with pytest.raises(EmptyShapeError, match="5 points are too few"):
        encoder.encode(torch.rand(1, 5, 3))
    with pytest.raises(EmptyShapeError, match="all points are at one place"):
        encoder.encode(torch.ones(1, 50, 3))
    with pytest.raises(ParameterError, match="NaN"):
        encoder.encode(torch.full((1, 50, 3), torch.nan))
    with pytest.raises(FamilyError, match="is not what lamps was trained on: 'other' is missing"):
        PartClouds.of(lamps, replace(saved, shapes=("other", *saved.shapes[1:])))
    with pytest.raises(SettingError, match="steps is 0"):
        train_encoder(saved, lamps, steps=0)
    plain = Target(torch.rand(100, 3), torch.rand(100) - 0.5)
    with pytest.raises(SettingError, match="points on the surface are needed"):
        find_starts(saved, plain, [NO_ROTATION], ReconstructionSettings(start="encoder"))
    lonely = replace(model, hash="2" * 64)
    with pytest.raises(ModelError, match="lamps has no encoder"):
        find_starts(lonely, plain, [NO_ROTATION], ReconstructionSettings(start="encoder"))
