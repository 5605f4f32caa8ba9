"""How a generator learns from the latents and poses of training shapes; and a Gaussian beside it."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from partwright.errors import SettingError
from partwright.methods import Cancellation
from partwright.partsdf.companion_training import check_posed, check_trainable, descend, follow
from partwright.partsdf.diffusion import noised
from partwright.partsdf.generator import Generator, GeneratorSettings, networks, tidy
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_vectors import POSE, PartVectors

_BATCH, _RATE = 64, 1e-3
_FIRST = "are generated first"
_AVERAGE = 0.995  # of the weights that are kept, a step
_TOLD = 50  # steps


@dataclass(frozen=True)
class GeneratorStep:
    """layouts, forms: the mean squared errors of both velocities, 1 where nothing is known."""

    number: int
    of: int
    layouts: float
    forms: float


def train_generator(
    model: Model,
    *,
    steps: int = 3000,
    seed: int = 0,
    settings: GeneratorSettings | None = None,
    told: Callable[[GeneratorStep], None] | None = None,
    cancel: Cancellation | None = None,
) -> Generator:
    """A generator for a model, whose file holds all that is learned from; after a cancellation, as far as it
    has come.

    Raises:
        SettingError: fewer than one step, fewer than two shapes, or a model without poses.
    """
    check_trainable(model, steps, _FIRST)
    _check_shapes(model)
    settings = settings or GeneratorSettings()
    torch.manual_seed(seed)
    vectors = PartVectors.of(model)
    made = networks(model, vectors, settings)
    kept = {name: copy.deepcopy(one).requires_grad_(False) for name, one in made.items()}
    result = Generator(model, settings, **kept, vectors=vectors)  # type: ignore[arg-type]
    layouts, forms = result.layout_of(model.poses, model.present), vectors.of_latents(model.latents)
    generator = torch.Generator().manual_seed(seed)

    def terms() -> Tensor:
        rows = torch.randint(len(layouts), (_BATCH,), generator=generator)
        return _errors(made, layouts[rows], forms[rows], generator)

    def averaged(step: int) -> None:
        for name, one in made.items():
            follow(kept[name], one, step, _AVERAGE)

    def heard(number: int, means: list[float]) -> None:
        if told is not None:
            told(GeneratorStep(number, steps, *means))

    descend(
        [p for one in made.values() for p in one.parameters()], terms, steps=steps, rate=_RATE,
        told=heard, every=_TOLD, cancel=cancel, after=averaged,
    )  # fmt: skip
    for one in kept.values():
        one.eval()
    return result


def _errors(made: dict[str, nn.Module], layout: Tensor, form: Tensor, generator: torch.Generator) -> Tensor:
    """(2,) of the velocities of layouts (B, P, 13) and forms (B, P, K); what is absent has no form."""
    time = torch.rand(2, len(layout), generator=generator)
    there = (layout[..., -1:] > 0).float()
    found = []
    for clean, when, weight in ((layout, time[0], torch.ones_like(there)), (form, time[1], there)):
        noise = torch.randn(clean.shape, generator=generator)
        noisy, wanted = noised(clean, noise, when)
        name = "layouts" if clean is layout else "forms"
        told = made[name](noisy, when) if name == "layouts" else made[name](noisy, when, layout)
        error = (told - wanted).square().mean(dim=-1, keepdim=True)
        found.append((weight * error).sum() / weight.sum().clamp(min=1))
    return torch.stack(found)


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
