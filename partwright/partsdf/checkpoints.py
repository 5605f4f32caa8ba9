"""Where a training was: one safetensors file that holds all that the next step depends on.

Points and the order of shapes are drawn by generators that are seeded anew by seed and step, so the step's
number stands for the state of all random numbers.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from torch import Tensor

from partwright.atomic_io import write_bytes
from partwright.errors import ModelError, SettingError
from partwright.input_files import check_file
from partwright.partsdf.config import Config, config_from
from partwright.partsdf.model import about_file

FORMAT = "partwright-checkpoint"
_MOMENTS = ("exp_avg", "exp_avg_sq")
_OF_LENGTH = {"training.epochs", "training.warmup"}  # what `--steps` of `parts family` tells


@dataclass
class TrainingState:
    """step: steps done. sums: of the loss terms over the steps of the running epoch; seconds: so far."""

    step: int
    sums: Tensor
    seconds: float = 0.0


def save_checkpoint(
    path: Path,
    config: Config,
    shapes: tuple[str, ...],
    model: torch.nn.Module,
    optimiser: torch.optim.Optimizer,
    state: TrainingState,
) -> None:
    """Replace the checkpoint, whole or not at all."""
    from safetensors.torch import save

    tensors = {f"model.{name}": value for name, value in model.state_dict().items()}
    for name, parameter in model.named_parameters():
        moments = optimiser.state.get(parameter, {})
        tensors |= {f"{moment}.{name}": moments[moment] for moment in _MOMENTS if moment in moments}
    tensors["sums"] = state.sums
    about = {
        "format": FORMAT,
        "config": asdict(config),
        "shapes": shapes,
        "step": state.step,
        "seconds": state.seconds,
    }
    kept = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    write_bytes(path, save(kept, {"partwright": json.dumps(about)}))


def load_checkpoint(
    path: Path,
    config: Config,
    shapes: tuple[str, ...],
    model: torch.nn.Module,
    optimiser: torch.optim.Optimizer,
) -> TrainingState:
    """Put model and optimiser back to where they were.

    Raises:
        ModelError: the file is damaged, or was trained on other shapes.
        SettingError: it was trained with other settings.
    """
    from safetensors import SafetensorError
    from safetensors.torch import load

    check_file(path)
    try:
        data = path.read_bytes()
        tensors, about = load(data), about_file(data)
    except (OSError, SafetensorError, KeyError, ValueError) as error:
        raise ModelError(f"{path}: cannot be read as a checkpoint ({error!s:.200}); remove it") from error
    if about.get("format") != FORMAT:
        raise ModelError(f"{path}: no checkpoint; remove it, or write elsewhere with -o")
    if tuple(about["shapes"]) != shapes:
        raise ModelError(
            f"{path}: a checkpoint of another family: it was trained on {len(about['shapes'])} shapes from "
            f"{about['shapes'][0]!r} on, these are {len(shapes)} from {shapes[0]!r} on; "
            "write elsewhere with -o"
        )
    _check_settings(path, asdict(config_from(about["config"])), asdict(config))
    device = next(model.parameters()).device
    model.load_state_dict(_with_prefix(tensors, "model."))
    step = torch.tensor(float(about["step"]))
    for name, parameter in model.named_parameters():
        if f"exp_avg.{name}" in tensors:
            moments = {moment: tensors[f"{moment}.{name}"].to(device) for moment in _MOMENTS}
            optimiser.state[parameter] = {"step": step.clone(), **moments}
    return TrainingState(about["step"], tensors["sums"].to(device), about["seconds"])


def _check_settings(path: Path, before: dict[str, object], now: dict[str, object]) -> None:
    """What the steps depend on has to be the same; a move to another folder or machine has not."""
    for settings in (before, now):
        settings["family"] = ""
        training = settings["training"]
        assert isinstance(training, dict)
        for name in (
            "accelerator",
            "at_once",
            "devices",
            "threads",
            "validate",
            "validate_shapes",
            "checkpoint",
            "start",
        ):
            training[name] = None
    if before != now:
        changed = sorted(_differences(before, now, ""))
        if "training.epochs" in changed and not set(changed) - _OF_LENGTH:
            # Dictionaries, as was asserted.
            old, new = (settings["training"]["epochs"] for settings in (before, now))  # type: ignore[index]
            raise SettingError(
                f"{path}: is of a training of {old} epochs, and {new} are asked for; one of another length "
                "is a training of its own, as its rates are laid out over its length: take as many steps or "
                "epochs as before, or write elsewhere with -o"
            )
        raise SettingError(
            f"{path}: was trained with other settings ({', '.join(changed)}); take those, or write "
            "elsewhere with -o"
        )


def _differences(a: object, b: object, place: str) -> list[str]:
    if isinstance(a, dict) and isinstance(b, dict):
        keys = {*a, *b}
        return [d for key in keys for d in _differences(a.get(key), b.get(key), f"{place}.{key}")]
    return [] if a == b else [place[1:]]


def _with_prefix(tensors: dict[str, Tensor], prefix: str) -> dict[str, Tensor]:
    return {name[len(prefix) :]: value for name, value in tensors.items() if name.startswith(prefix)}
