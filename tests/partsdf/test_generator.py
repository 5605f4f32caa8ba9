"""New shapes out of noise: by seed, with parts or poses kept, and apart from those that are known."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import torch
import trimesh

from partwright.errors import ModelError, SettingError
from partwright.partsdf import companions
from partwright.partsdf.companion_training import descend
from partwright.partsdf.companions import beside
from partwright.partsdf.diffusion import denoised, levels, noised
from partwright.partsdf.generator import KIND, Generator, GeneratorSettings, load_generator
from partwright.partsdf.generator_training import gaussian_samples, train_generator
from partwright.partsdf.matching_forms import WholeShapes
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.novelty import nearest_training_shape
from partwright.partsdf.settings import ReconstructionSettings
from partwright.partsdf.soundness import Judge
from partwright.partsdf.sources import found_in

SMALL = GeneratorSettings(width=48, heads=2, blocks=2)


@pytest.fixture(scope="module")
def generator(model: Model, tmp_path_factory: pytest.TempPathFactory) -> Generator:
    torch.set_num_threads(1)
    saved = model.save(tmp_path_factory.mktemp("generated") / "lamps.safetensors")
    made = train_generator(saved, steps=400, settings=SMALL)
    made.save(beside(saved, KIND) or "")
    return made


@pytest.mark.parametrize("spread", [0.1, 0.4, 1.0])
def test_a_perfect_denoiser_finds_the_distribution(spread: float) -> None:
    """Of a normal distribution the best velocity is known: samples have its mean and all of its spread, where
    a sampler of first order is off by a tenth."""
    mean = 1.5

    def best(at: torch.Tensor, time: torch.Tensor) -> torch.Tensor:
        a, s = (one[:, None] for one in levels(time))
        gain = a * spread**2 / (a**2 * spread**2 + s**2)
        clean = mean + gain * (at - a * mean)
        return (a * at - clean) / s

    noise = torch.randn(4000, 1, generator=torch.Generator().manual_seed(0))
    found = denoised(best, noise)
    assert float(found.mean()) == pytest.approx(mean + spread * float(noise.mean()), abs=0.005)
    assert float(found.std()) == pytest.approx(spread * float(noise.std()), rel=0.01)
    known = torch.full_like(noise, 7.0)
    some = torch.zeros_like(noise, dtype=torch.bool)
    some[:2000] = True
    kept = denoised(best, noise, known, some)
    assert (kept[:2000] == 7).all()
    torch.testing.assert_close(kept[2000:], found[2000:])
    clean, time = torch.randn(50, 3), torch.rand(50)
    noisy, velocity = noised(clean, torch.randn(50, 3), time)
    a, s = (one[:, None] for one in levels(time))
    torch.testing.assert_close(a * noisy - s * velocity, clean)
    assert math.isclose(float(levels(torch.tensor(0.0))[0]), 1.0, abs_tol=1e-3)


def test_samples_are_lamps_by_their_seed(generator: Generator) -> None:
    """Balls stand on plates, as all do that were trained on; about a third has no knob."""
    shapes = generator.generate(48, seed=3)
    top = torch.stack([s.poses.translation[0, 2] + s.poses.scale[0, 2] for s in shapes])
    bottom = torch.stack([s.poses.translation[1, 2] - s.poses.scale[1].mean() for s in shapes])
    assert (top - bottom).abs().median() < 0.1
    spread = torch.stack([s.poses.scale[1, 0] for s in shapes]).std()
    assert float(spread / generator.model.poses.scale[:, 1, 0].std()) == pytest.approx(1.0, abs=0.6)
    assert 24 <= sum("knob" in s.names() for s in shapes) <= 44
    few = generator.generate(2, seed=3)
    for one, same in zip(few, shapes, strict=False):
        assert torch.equal(one.latents, same.latents)
        assert all(map(torch.equal, one.poses, same.poses))
    other = generator.generate(1, seed=4)[0]
    assert (other.latents - few[0].latents).abs().max() > 0.01


def test_samples_are_as_like_a_shape_as_is_asked_for(generator: Generator) -> None:
    """A knob stays a knob where little is changed; where all is, the samples are those of noise alone."""
    model = generator.model
    source = NeuralShape.trained(model, "lamp0")

    def apart(change: float) -> float:
        made = generator.generate(8, 1, source, change=change)
        return float(torch.stack([(s.poses.scale - source.poses.scale).abs().mean() for s in made]).mean())

    little, some, all_of_it = apart(0.05), apart(0.5), apart(1.0)
    assert little < 0.5 * some
    assert some < all_of_it
    near = generator.generate(8, 1, source, change=0.1)
    assert all(torch.equal(one.present, source.present) for one in near)
    assert len({float(one.poses.scale[0, 0]) for one in near}) == 8
    new, free = generator.generate(8, 1, source, change=1.0), generator.generate(8, 1)
    for one, other in zip(new, free, strict=True):  # the schedule leaves a thousandth of the signal
        assert (one.poses.translation - other.poses.translation).abs().max() < 0.1
    with pytest.raises(SettingError, match="expected above 0 and at most 1"):
        generator.generate(1, 0, source, change=1.5)
    with pytest.raises(SettingError, match="of which shape"):
        generator.generate(1, 0, change=0.5)
    with pytest.raises(SettingError, match="choose one"):
        generator.generate(1, 0, source, keep=["plate"], change=0.5)


def test_a_mesh_is_found_as_it_stands_in_the_family(generator: Generator, tmp_path: Path) -> None:
    """Turned by a quarter and larger: the plate is found with its sides in the family's order."""
    turned = trimesh.transformations.rotation_matrix(math.pi / 2, (0, 0, 1))
    plate = trimesh.creation.box((1.6, 1.2, 0.3))
    ball = trimesh.creation.icosphere(3, 0.38)
    ball.apply_translation((0.2, 0, 0.15 + 0.38))
    mesh = trimesh.util.concatenate([plate, ball])
    mesh.apply_transform(trimesh.transformations.scale_matrix(30) @ turned)
    mesh.export(tmp_path / "lamp.ply")
    few = ReconstructionSettings(iterations=60, points=400, starts=2)
    found, warnings = found_in(generator.model, tmp_path / "lamp.ply", few)
    assert found.model is generator.model
    assert "ball" in found.names()
    size = found.poses.scale[0]
    assert size[0] > size[1] > size[2]
    assert isinstance(warnings, tuple)


def test_parts_and_poses_may_be_kept(generator: Generator) -> None:
    model = generator.model
    source = NeuralShape.trained(model, "lamp0")
    for one in generator.generate(3, 1, source, keep=["plate"]):
        assert torch.equal(one.latents[0], source.latents[0])
        for mine, theirs in zip(one.poses, source.poses, strict=True):
            assert torch.equal(mine[0], theirs[0])
        assert (one.latents[1] - source.latents[1]).abs().max() > 1e-3
    first, second = generator.generate(2, 1, source, keep_layout=True)
    for mine, theirs in zip(first.poses, source.poses, strict=True):
        assert torch.equal(mine, theirs)
    assert torch.equal(first.present, source.present)
    assert (first.latents - second.latents).abs().max() > 1e-3


def test_what_cannot_be_kept_is_told(generator: Generator) -> None:
    source = NeuralShape.trained(generator.model, "lamp0")
    bare = NeuralShape.trained(generator.model, "lamp2")  # without a knob
    for changes, said in (
        ({"count": 0}, "0 samples: expected 1 or more"),
        ({"keep": ["plate"]}, "of which shape"),
        ({"source": source}, "nothing of it is kept"),
        ({"source": source, "keep": ["lid"]}, "no part 'lid'"),
        ({"source": source, "keep": list(generator.model.parts)}, "nothing is left to make"),
        ({"source": source, "keep": ["plate"], "keep_layout": True}, "choose one"),
        ({"source": bare, "keep": ["knob"]}, "knob is to be kept, but the shape has none"),
        (
            {"source": replace(source, model=replace(source.model, hash="0" * 64)), "keep": ["plate"]},
            "is of another model",
        ),
    ):
        with pytest.raises(SettingError, match=said):
            generator.generate(**({"count": 1} | changes))  # type: ignore[arg-type]
    with pytest.raises(SettingError, match="knows 1 shape"):
        train_generator(replace(generator.model, shapes=("one",)))
    with pytest.raises(SettingError, match="steps is 0"):
        train_generator(generator.model, steps=0)


def test_its_file(generator: Generator, tmp_path: Path) -> None:
    again = load_generator(generator.model)
    one, two = generator.generate(1, 5)[0], again.generate(1, 5)[0]
    torch.testing.assert_close(one.latents, two.latents, atol=0.05, rtol=0)  # half precision
    assert torch.equal(two.latents, load_generator(generator.model).generate(1, 5)[0].latents)
    with pytest.raises(ModelError, match="lamps has no generator; make one with `parts train-generator`"):
        load_generator(replace(generator.model, hash="3" * 64))


def test_forms_match_one_another_where_parts_lie_in_others(
    generator: Generator, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Known of a family when its generator is trained, and in the file: then a new shape's latents are mixed
    of those of training shapes, but where poses are kept."""
    model = generator.model
    assert not generator.matched  # no part of a lamp lies in another
    monkeypatch.setattr(Judge, "lying", ("knob",))
    matched = train_generator(model, steps=1, settings=SMALL)
    assert matched.matched
    path = tmp_path / "matched.safetensors"
    matched.save(path)
    assert load_generator(model, path).matched
    source = NeuralShape.trained(model, "lamp0")
    monkeypatch.setattr(WholeShapes, "matching", lambda self, layouts, forms: torch.zeros_like(forms))
    mean = generator.vectors.latents(torch.zeros(len(model.parts), generator.vectors.width))
    for how, mixes in (
        ({}, True),
        ({"source": source, "change": 0.5}, True),
        ({"source": source, "keep_layout": True}, False),
    ):
        for maker in (generator, replace(generator, matched=True)):
            (made,) = maker.generate(1, 1, **how)  # type: ignore[arg-type]
            whole = made.present  # what is absent has no form of its own
            assert torch.allclose(made.latents[whole], mean[whole]) == (mixes and maker.matched)
    replace(matched, matched=3).save(path)  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="matched is 3"):
        load_generator(model, path)


def test_a_file_of_an_earlier_version_is_to_be_trained_again(
    generator: Generator, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(companions.VERSIONS, KIND, 1)
    generator.save(tmp_path / "old.safetensors")
    monkeypatch.undo()
    with pytest.raises(ModelError, match=r"earlier Partwright.*train it again with `parts train-generator`"):
        load_generator(generator.model, tmp_path / "old.safetensors")


def test_a_gaussian_to_compare_with_and_the_distance_to_what_is_known(generator: Generator) -> None:
    model = generator.model
    drawn = gaussian_samples(model, 200, seed=1)
    latents = torch.stack([s.latents[0] for s in drawn])
    spread = model.latents[:, 0].std(dim=0)
    torch.testing.assert_close(latents.std(dim=0), spread, rtol=0.35, atol=0)
    name, difference = nearest_training_shape(NeuralShape.trained(model, "lamp3"))
    assert (name, difference) == ("lamp3", pytest.approx(0.0, abs=1e-6))
    _, far = nearest_training_shape(drawn[0])
    assert 1e-4 < far < 0.1


def test_groups_learn_at_their_own_rate() -> None:
    """Adam's first step is the rate, whatever the gradient."""
    fast, slow = (torch.nn.Parameter(torch.ones(1)) for _ in range(2))
    groups: list[dict[str, Any]] = [{"params": [fast], "lr": 1.0}, {"params": [slow], "lr": 0.25}]
    rate, warmed = 0.1, 0.02  # the first of 50 steps over which rates rise
    descend(groups, lambda: torch.stack([fast[0] ** 2, 7 * slow[0] ** 2]), steps=1, rate=rate)
    assert 1 - float(fast.detach()) == pytest.approx(rate * warmed, rel=0.02)
    assert 1 - float(slow.detach()) == pytest.approx(0.25 * rate * warmed, rel=0.02)
