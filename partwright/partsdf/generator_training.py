"""How a generator learns from the latents and poses of training shapes; and a Gaussian beside it."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from partwright.devices import device_of
from partwright.errors import SettingError
from partwright.methods import Cancellation
from partwright.partsdf.companion_training import check_posed, check_trainable, descend, follow
from partwright.partsdf.diffusion import noised
from partwright.partsdf.generator import Generator, GeneratorSettings, networks, tidy
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import POSE, PartVectors
from partwright.partsdf.soundness import Judge

BATCH, STEPS = 64, 3200
_RATE = 1e-3
_FIRST = "are generated first"
_AVERAGE = 0.995  # of the weights that are kept, a step
_TOLD = 50  # steps
# Forms' share of a step's shapes, and of its rate: poses tell little of them, and learned by heart, they
# would narrow for new layouts.
_SHARE, _SLOWER = 0.5, 0.25


@dataclass(frozen=True)
class GeneratorStep:
    """layouts, forms: the mean squared errors of both velocities, of parts that are there, 1 where nothing
    is known; those of forms as their directions tell."""

    number: int
    of: int
    layouts: float
    forms: float


def train_generator(
    model: Model,
    *,
    steps: int = STEPS,
    batch: int = BATCH,
    seed: int = 0,
    device: str = "auto",
    settings: GeneratorSettings | None = None,
    told: Callable[[GeneratorStep], None] | None = None,
    cancel: Cancellation | None = None,
) -> Generator:
    """A generator for a model, whose file holds all that is learned from; after a cancellation, as far as it
    has come.

    batch: shapes a step. device: "auto", "cpu" or "cuda".

    Raises:
        SettingError: fewer than one step or shape a step, fewer than two shapes, a model without poses, or no
            such device.
    """
    check_trainable(model, steps, batch, _FIRST)
    _check_shapes(model)
    place, settings = device_of(device), settings or GeneratorSettings()
    vectors = PartVectors.of(model)
    torch.manual_seed(seed)
    with place:
        made = networks(model, vectors, settings)
    kept = {name: copy.deepcopy(one).requires_grad_(False) for name, one in made.items()}
    matched = bool(Judge(model).lying)
    result = Generator(model, settings, **kept, vectors=vectors, matched=matched)  # type: ignore[arg-type]
    layouts, forms = result.layout_of(model.poses, model.present), vectors.of_latents(model.latents)
    layouts, forms, tells = layouts.to(place), forms.to(place), vectors.tells.to(place)
    shares = {"layouts": 1.0, "forms": _SLOWER}
    generator = torch.Generator(place).manual_seed(seed)

    def terms() -> Tensor:
        with place:  # all that is drawn
            rows = torch.randint(len(layouts), (batch,), generator=generator)
            return _errors(made, layouts[rows], forms[rows], tells, generator)

    def averaged(step: int) -> None:
        for name, one in made.items():
            follow(kept[name], one, step, _AVERAGE)

    def heard(number: int, means: list[float]) -> None:
        if told is not None:
            told(GeneratorStep(number, steps, *means))

    descend(
        [{"params": made[name].parameters(), "lr": share} for name, share in shares.items()], terms,
        steps=steps, rate=_RATE, told=heard, every=_TOLD, cancel=cancel, after=averaged,
    )  # fmt: skip
    for one in kept.values():
        one.cpu().eval()
    return result


def _errors(
    made: dict[str, nn.Module], layout: Tensor, form: Tensor, tells: Tensor, generator: torch.Generator
) -> Tensor:
    """(2,) of the velocities of poses, of layouts (B, P, 13), and of forms (B, P, K) of some of them; what is
    absent has neither.

    tells: (P, K) weights of forms, 1 in the mean."""
    poses, present = layout[..., :POSE], layout[..., POSE:]
    some = slice(math.ceil(_SHARE * len(layout)))

    def error(network: str, clean: Tensor, given: Tensor, weights: Tensor) -> Tensor:
        time = torch.rand(len(clean), generator=generator)
        noisy, wanted = noised(clean, torch.randn(clean.shape, generator=generator), time)
        unlike = (weights * (made[network](noisy, time, given) - wanted).square()).mean(dim=-1)
        there = (given[..., -1] > 0).float()
        return (there * unlike).sum() / there.sum().clamp(min=1)

    return torch.stack([
        error("layouts", poses, present, torch.ones(())),
        error("forms", form[some], layout[some], tells),
    ])  # fmt: skip


def gaussian_samples(model: Model, count: int, seed: int = 0) -> list[NeuralShape]:
    """Shapes from the normal distribution of the training shapes' poses, presence and latents together: what
    a generator has to be better than.

    Raises:
        SettingError: fewer than two shapes, or a model without poses.
    """
    check_posed(model, _FIRST)
    _check_shapes(model)
    vectors = PartVectors.of(model)
    there = 2.0 * model.present[..., None] - 1
    layout = tidy(torch.cat([vectors.of_poses(model.poses), there], dim=-1))
    known = torch.cat([layout, vectors.of_latents(model.latents)], dim=-1)
    mean = known.mean(dim=0)
    weight = torch.randn(count, len(known), generator=torch.Generator().manual_seed(seed))
    drawn = mean + torch.einsum("ns,spk->npk", weight, known - mean) / (len(known) - 1) ** 0.5
    return [
        NeuralShape.of(
            model,
            vectors.latents(one[:, POSE + 1 :]),
            vectors.poses(one[:, :POSE]),
            one[:, POSE] > 0,
        )
        for one in drawn
    ]


def _check_shapes(model: Model) -> None:
    if len(model.shapes) < 2:
        raise SettingError(f"{model.name} knows {len(model.shapes)} shape; two or more are needed")
