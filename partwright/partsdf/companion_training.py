"""How what lies beside a model learns: AdamW, whose rate rises at first, then falls along half a cosine."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import torch
from torch import Tensor, nn

from partwright.errors import SettingError
from partwright.methods import Cancellation, check_count
from partwright.partsdf.model import Model

_DECAY, _WARMUP = 1e-2, 50

Told = Callable[[int, list[float]], None]
"""The number of a step, from 1, and the means of the terms since it was last told."""


def check_trainable(model: Model, steps: int, batch: int, purpose: str) -> None:
    """Raise SettingError for less than one step, or nothing a step, or a model without poses, which `purpose`
    names."""
    if steps < 1:
        raise SettingError(f"steps is {steps}; expected 1 or more")
    check_count("batch", batch, low=1)
    check_posed(model, purpose)


def check_posed(model: Model, purpose: str) -> None:
    """Raise SettingError for a model without poses. purpose: what needs them."""
    if model.config.one_part or not model.config.poses:
        raise SettingError(f"{model.name} was trained without poses, which {purpose}")


def follow(kept: nn.Module, made: nn.Module, step: int, most: float) -> None:
    """Weights that are kept, a mean of the last steps', stay by `most` of what they were, less at first."""
    share = min(most, step / (step + 10))
    for old, new in zip(kept.parameters(), made.parameters(), strict=True):
        old.lerp_(new.detach(), 1 - share)


def descend(
    parameters: Iterable[nn.Parameter] | Iterable[dict[str, Any]],
    terms: Callable[[], Tensor],
    *,
    steps: int,
    rate: float,
    told: Told | None = None,
    every: int = 50,
    cancel: Cancellation | None = None,
    steepest: float = math.inf,
    after: Callable[[int], None] | None = None,
) -> None:
    """Lessen the sum of the terms (K,), until the steps are done or it is cancelled.

    parameters: or groups of them, of `params` and `lr`, that one's share of the rate.
    terms: of a batch that is drawn anew. every: steps after which `told` hears. steepest: norm that gradients
    are cut to. after: called after each step, with its number from 0.
    """
    optimiser = torch.optim.AdamW(parameters, lr=1.0, weight_decay=_DECAY, fused=True)
    shares = [float(group["lr"]) for group in optimiser.param_groups]
    cancel, sums, since = cancel or Cancellation(), torch.zeros(()), 0
    for step in range(steps):
        if cancel.requested:
            return
        late = 0.5 * (1 + math.cos(math.pi * step / steps))
        for group, share in zip(optimiser.param_groups, shares, strict=True):
            group["lr"] = share * rate * late * min(1.0, (step + 1) / _WARMUP)
        found = terms()
        optimiser.zero_grad()
        found.sum().backward()
        if steepest < math.inf:
            every_one = (p for group in optimiser.param_groups for p in group["params"])
            torch.nn.utils.clip_grad_norm_(every_one, steepest)
        optimiser.step()
        if after is not None:
            after(step)
        sums, since = sums + found.detach(), since + 1
        if told is not None and (since == every or step + 1 == steps):
            told(step + 1, (sums / since).tolist())
            sums, since = torch.zeros(()), 0
