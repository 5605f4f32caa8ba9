"""Learned parts behind the page: other forms for them. PyTorch is imported where there are some."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from importlib.util import find_spec
from typing import Any

from partwright.assembly import Assembly
from partwright.assembly.joint import is_joint
from partwright.errors import SettingError
from partwright.methods import Cancellation, Progress
from partwright.studio import messages
from partwright.studio.fits import Done, Task

_SUFFIX = ".safetensors"
PREFIX = "parts:"
"""Of the page's names of fits by learned parts, before the model's."""


def methods() -> list[str]:
    """One for each model that ships; none where PyTorch is not installed."""
    if find_spec("torch") is None:
        return []
    folder = files("partwright.partsdf").joinpath("models")
    names = (entry.name for entry in folder.iterdir())
    models = (name.removesuffix(_SUFFIX) for name in sorted(names) if name.endswith(_SUFFIX))
    return [PREFIX + name for name in models]


def donors(assembly: Assembly) -> list[str]:
    """The shapes that the model of the learned parts was trained on; none where there are no such parts."""
    for part in assembly.parts:
        network: Any = getattr(part.field, "network", None)
        if is_joint(part) and network is not None:
            return list(network.shapes)
    return []


def reforming(assembly: Assembly, message: messages.Learned) -> Task:
    """One part's form drawn anew, or taken from a training shape; the others adapt.

    Raises:
        SettingError: no learned part has that name.
    """
    if not any(part.name == message.name and is_joint(part) for part in assembly.parts):
        raise SettingError(f"no learned part is named {message.name!r}")
    verb = "Sample" if message.action == "resample" else "Swap"

    def work(progress: Callable[[Progress], None], cancel: Cancellation) -> Done:
        from partwright.partsdf import editing
        from partwright.partsdf.field import NeuralField
        from partwright.partsdf.neural import NeuralShape

        part = assembly[message.name]
        if not isinstance(part.field, NeuralField):
            raise SettingError(f"{message.name} is of kind {part.field.kind}, which has no other forms here")
        shape, role = part.field.shape, part.field.role
        if message.action == "resample":
            changed = editing.resampled(shape, role, message.seed)
        else:
            changed = editing.swapped(shape, role, NeuralShape.trained(shape.model, message.source))
        latent = tuple(changed.latents[shape.model.index(role)].tolist())
        field = replace(part.field, latent=latent, members=())
        result = assembly.replace_part(message.name, replace(part, field=field))
        return Done(result, messages.Fitted("converged", len(result), 0.0))

    return Task(f"{verb} {message.name}", work)
