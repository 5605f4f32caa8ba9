"""The local decoder: what is left out, gradients, rooms, and parts that hear of one another."""

from __future__ import annotations

import math
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from partwright.assembly import Similarity
from partwright.datasets.prepared import PreparedFamily
from partwright.errors import SettingError
from partwright.partsdf.assemblies import from_assembly, to_assembly
from partwright.partsdf.config import Config, DecoderSettings, config_from
from partwright.partsdf.data import load_samples, needed_room
from partwright.partsdf.editing import moved
from partwright.partsdf.local import REACH, ROOM, LocalDecoder
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import PoseTensors, local_points
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct
from partwright.partsdf.segmented_linear import LEAK, segmented_linear
from partwright.partsdf.training import MODEL, train
from partwright.shapes import UnitFrame
from tests.partsdf.lamps import small_config

SMALL = DecoderSettings(latent=6, width=16, layers=4, octaves=2, architecture="local", token=16, heads=2)


def placed(seed: int = 2, points: int = 60) -> tuple[torch.Tensor, torch.Tensor, PoseTensors]:
    """Latents (3, 4, Z), world points (3, N, 3) and poses (3, 4, ...) in double precision."""
    generator = torch.Generator().manual_seed(seed)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=generator, dtype=torch.float64)

    poses = PoseTensors(0.4 * normal(3, 4, 3), normal(3, 4, 4), 0.1 + 0.1 * normal(3, 4, 3).abs())
    return normal(3, 4, SMALL.latent), 0.5 * normal(3, points, 3), poses


def decoder(settings: DecoderSettings = SMALL) -> LocalDecoder:
    torch.manual_seed(0)
    made = LocalDecoder(4, settings).double()
    made.fit_room(torch.rand(4, 3, dtype=torch.float64) + 0.8)
    return made


@pytest.mark.parametrize("name", ["vehicles", "lamps"])
def test_one_part_alone_is_that_of_all(name: str, model: Model) -> None:
    """To the bit by our own decoder, with its derivatives; whatever decoder it is."""
    known = load_model(name) if name == "vehicles" else model
    shape = NeuralShape.trained(known, "0")
    points = 2 * torch.rand(400, 3, generator=torch.Generator().manual_seed(0)) - 1
    latents = shape.latents.clone().requires_grad_()
    one = known.decoded(latents, shape.poses).part(1, points)
    all_of_them = known.part_distances(latents, shape.poses, points)[1]
    assert torch.equal(one, all_of_them)
    (mine,), (theirs,) = (torch.autograd.grad(d.sum(), latents) for d in (one, all_of_them))
    torch.testing.assert_close(mine, theirs)


def test_far_parts_are_left_out_and_near_ones_are_each_as_if_alone() -> None:
    """Every pair by itself: the network's value within reach of the room, the room's distance elsewhere."""
    made, (z, points, poses) = decoder(), placed()
    local = local_points(points, poses)
    found = made(z, local, poses)
    room = ((local.abs() - made.room[:, None]) * poses.scale[:, :, None]).amax(-1)
    far = room >= REACH
    assert 0.3 < far.double().mean() < 0.95
    torch.testing.assert_close(found[far], room[far], rtol=0, atol=0)
    assert (found >= room).all()  # nothing leaves its room
    assert (found[~far] > room[~far]).any()
    conditioned = made.condition(z, poses)
    for n in range(0, points.shape[1], 7):
        torch.testing.assert_close(conditioned(local[:, :, n : n + 1]), found[:, :, n : n + 1])


def test_a_sheet_is_seen_as_its_room_is() -> None:
    """A cuboid that is thinner by as much as its room is thicker has the same room, and the same values."""
    made, (z, points, poses) = decoder(), placed()
    torch.testing.assert_close(made.unit, made.room)
    conditioned, local = made.condition(z, poses), local_points(points, poses)
    thin = torch.tensor([1.0, 1.0, 50.0], dtype=torch.float64)
    units = {"room": made.room * thin, "unit": made.unit * thin}
    sheet = replace(conditioned, scale=poses.scale / thin, **units)  # type: ignore[type-var]
    torch.testing.assert_close(sheet(local * thin), conditioned(local))


@pytest.mark.parametrize("changes", [{}, {"modulation": False}])
def test_gradients_agree_with_finite_differences(changes: dict[str, object]) -> None:
    made, (z, points, poses) = decoder(replace(SMALL, **changes)), placed(points=3)  # type: ignore[arg-type]

    def distances(z: torch.Tensor, points: torch.Tensor, *pose: torch.Tensor) -> torch.Tensor:
        one = PoseTensors(*pose)
        return made(z, local_points(points, one), one)

    inputs = [t[:1].detach().clone().requires_grad_() for t in (z, points, *poses)]
    assert torch.autograd.gradcheck(distances, inputs, eps=1e-7, atol=1e-4)


def test_each_segment_has_its_own_weights() -> None:
    generator = torch.Generator().manual_seed(0)
    x = torch.randn(11, 5, generator=generator, dtype=torch.float64)
    weight = torch.randn(4, 5, 3, generator=generator, dtype=torch.float64)
    shift = torch.randn(4, 3, generator=generator, dtype=torch.float64)
    ends = [4, 4, 9, 11]  # the second is empty
    found = segmented_linear(x, weight, shift, ends, activated=True)
    for first, last, g in ((0, 4, 0), (4, 9, 2), (9, 11, 3)):
        expected = torch.nn.functional.leaky_relu(x[first:last] @ weight[g] + shift[g], LEAK)
        torch.testing.assert_close(found[first:last], expected)
    for activated in (True, False):
        inputs = [t.clone().requires_grad_() for t in (x, weight, shift)]
        assert torch.autograd.gradcheck(lambda *t, on=activated: segmented_linear(*t, ends, on), inputs)


def test_segments_that_are_filled_up_come_to_the_same() -> None:
    """What a GPU does, values and gradients; a part that is asked nowhere is a segment of no rows."""
    made, (z, points, poses) = decoder(), placed()
    points[1] += 5.0  # far from all parts

    def network(filled: bool) -> list[torch.Tensor]:
        made.zero_grad()
        inputs = [t.clone().requires_grad_() for t in (z, points, *poses)]
        conditioned = made.condition(inputs[0], PoseTensors(*inputs[2:]))
        local = local_points(inputs[1], PoseTensors(*inputs[2:]))
        values = conditioned(local, filled)  # type: ignore[call-arg]
        values.square().sum().backward()
        return [values, *(t.grad for t in inputs), *(p.grad.clone() for p in made.parameters())]

    for one, other in zip(network(filled=True), network(filled=False), strict=True):
        torch.testing.assert_close(one, other)
    far = made.condition(z[:1], poses.map(lambda t: t[:1]))
    nowhere = torch.full((1, 4, 7, 3), 50.0, dtype=torch.float64)
    torch.testing.assert_close(far(nowhere, True), far(nowhere, False))  # type: ignore[call-arg]


def test_parts_hear_of_one_another_once_a_shape() -> None:
    z, points, poses = placed()
    moved, turned = z.clone(), poses.translation.clone()
    moved[:, 0] += 1
    turned[:, 0] += 0.05
    local = local_points(points, poses)
    for talks in (True, False):
        made = decoder(replace(SMALL, cross_part=talks))
        before = made(z, local, poses)
        for after in (made(moved, local, poses), made(z, local, poses._replace(translation=turned))):
            change = (after - before).abs().amax(dim=(0, 2))
            assert change[0] > 1e-6
            assert bool((change[1:] > 0).all()) is talks


def test_settings_that_cannot_be_are_refused() -> None:
    with pytest.raises(SettingError, match=r"decoder.token is 15, which 2 heads cannot share"):
        replace(SMALL, token=15)
    with pytest.raises(SettingError, match=r"training.balance is 1.5; expected 0 to 1"):
        config_from({"family": "f", "name": "n", "training": {"balance": 1.5}})


@pytest.fixture(scope="module")
def local_config(lamps: PreparedFamily) -> Config:
    training = {"epochs": 70, "batch": 8, "points": 192, "rate": 2e-3, "latent_rate": 2e-2, "anneal": 0.5}
    data = asdict(small_config(lamps))
    data["decoder"] |= {"architecture": "local", "width": 48, "layers": 4, "octaves": 3, "token": 32}
    data["training"] |= training | {"balance": 0.5}
    return config_from(data)


@pytest.fixture(scope="module")
def trained(local_config: Config, tmp_path_factory: pytest.TempPathFactory) -> tuple[Model, Path]:
    torch.set_num_threads(1)
    folder = tmp_path_factory.mktemp("local")
    return train(local_config, folder).model, folder / MODEL


def test_it_learns_comes_back_and_finds_a_shape(trained: tuple[Model, Path], lamps: PreparedFamily) -> None:
    model, path = trained
    assert load_model(path).hash == model.hash
    known = lamps.load(0)
    shape = NeuralShape.trained(model, "lamp0")
    inside, found = known.sdf < 0, shape.distances(known.points) < 0
    assert (inside & found).sum() / (inside | found).sum() > 0.8
    (index,) = lamps.split("test")
    held = lamps.load(index)
    few = ReconstructionSettings(iterations=60, points=512)
    again = reconstruct(model, held, few).distances(held.points) < 0
    assert (again & (held.sdf < 0)).sum() / (again | (held.sdf < 0)).sum() > 0.75
    surfaces = mesh_shape(shape, 48)
    assert surfaces.whole.is_watertight
    assert surfaces.evaluations < surfaces.dense / 3
    assert np.abs(shape.distances(surfaces.whole.vertices)).max() < 2 / 48


def test_rooms_hold_all_that_is_inside(lamps: PreparedFamily, local_config: Config) -> None:
    samples = load_samples(lamps, [0, 1, 2], local_config)
    needed = needed_room(samples)
    for i in range(3):
        shape = lamps.load(i)
        inside = shape.sdf < 0
        local = local_points(torch.from_numpy(shape.points[inside]), PoseTensors.of(shape.poses)).abs()
        for p in range(3):
            mine = local[p, torch.from_numpy(shape.part[inside] == p)]
            assert (mine <= needed[p] + 1e-6).all()
    made = LocalDecoder(3, local_config.decoder)
    made.fit_room(needed)
    assert (made.room >= ROOM).all()
    torch.testing.assert_close(made.room, (ROOM * needed).clamp(min=ROOM))


def test_small_parts_get_as_many_points_as_large_ones(lamps: PreparedFamily, local_config: Config) -> None:
    """A balanced draw takes the parts that are there alike, half of each inside."""
    samples = load_samples(lamps, [0, 2], local_config)  # the second has no knob
    points, sdf, part = samples.draw(torch.tensor([1, 0]), 6000, torch.Generator().manual_seed(0), 1.0)
    assert ((sdf < 0).sum(dim=1) == 3000).all()
    for row, parts in ((0, 2), (1, 3)):
        counts = torch.bincount(part[row].long(), minlength=3)
        assert counts[:parts].tolist() == pytest.approx([6000 / parts] * parts, rel=0.06)
        assert counts[parts:].sum() == 0
    plain = torch.bincount(samples.draw(torch.tensor([0]), 6000, torch.Generator())[2][0].long(), minlength=3)
    assert plain[0] > 1.3 * plain[2]
    shape = lamps.load(2)
    for point, distance in zip(points[0, :20], sdf[0, :20], strict=True):
        row = np.flatnonzero((shape.points == point.numpy()).all(axis=1))[0]
        assert shape.sdf[row] == distance


def test_an_assembly_may_be_moved_turned_and_edited(trained: tuple[Model, Path]) -> None:
    """Poses enter the network: they have to be those of the family's frame, however the assembly stands."""
    frame = UnitFrame((10.0, 20.0, 30.0), 0.5)
    shape = NeuralShape.trained(trained[0], "lamp1")
    points = np.random.default_rng(1).uniform(-0.9, 0.9, (200, 3)).astype(np.float32)
    expected = 2 * shape.part_distances(points)
    half = math.sqrt(0.5)
    upright = to_assembly(shape, frame)
    lying = to_assembly(shape, frame, turn=(half, half, 0.0, 0.0))
    tilt = Similarity(3.0, (math.cos(0.4), 0.0, math.sin(0.4), 0.0), (1.0, -2.0, 5.0))
    turned = Similarity(1.0, (half, half, 0.0, 0.0))
    np.testing.assert_allclose(upright.part_distances(frame.from_unit(points)), expected, atol=1e-4)
    lies = frame.from_unit(turned(points.astype(float)))
    np.testing.assert_allclose(lying.part_distances(lies), expected, atol=1e-4)
    again = lying.transformed(tilt)
    np.testing.assert_allclose(again.part_distances(tilt(lies)), 3 * expected, atol=5e-4)
    back, where, how = from_assembly(again)
    np.testing.assert_allclose(back.part_distances(points), expected / 2, atol=1e-4)
    rebuilt = to_assembly(back, where, turn=how)
    np.testing.assert_allclose(rebuilt.part_distances(tilt(lies)), 3 * expected, atol=1e-3)
    shifted = lying.replace_part("ball", lying["ball"].translated((0.0, 0.0, 0.4)))
    wanted = 2 * moved(shape, "ball", (0.0, 0.2, 0.0)).part_distances(points)  # z is the family's y
    np.testing.assert_allclose(shifted.part_distances(lies), wanted, atol=1e-3)
    tensor = torch.tensor(lies, requires_grad=True)
    np.testing.assert_allclose(lying.distance(tensor).detach(), expected.min(axis=0), atol=1e-4)
