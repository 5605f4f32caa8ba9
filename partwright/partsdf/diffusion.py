"""Noise to vectors: the cosine schedule (Nichol & Dhariwal 2021) and DDIM's sampler (Song et al. 2021).

Twenty lines of our own: `diffusers`, which has them too, comes with a client for its hub and eight packages,
which who only wants a chair would have to install.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import torch
from torch import Tensor

STEPS = 64  # of sampling
_OFFSET = 0.008

Denoiser = Callable[[Tensor, Tensor], Tensor]
"""Noisy vectors (B, ...) at times (B,) from 0, clean, to 1, noise, to their velocities."""


def levels(time: Tensor) -> tuple[Tensor, Tensor]:
    """How much of the signal and of the noise there is at times (B,)."""
    angle = ((time + _OFFSET) / (1 + _OFFSET) * math.pi / 2).clamp(max=math.pi / 2 - 1e-3)
    return angle.cos(), angle.sin()


def noised(clean: Tensor, noise: Tensor, time: Tensor) -> tuple[Tensor, Tensor]:
    """Vectors (B, ...) at times (B,), and the velocities that a denoiser is to tell of them
    (Salimans & Ho 2022)."""
    signal, spread = (one.view(-1, *[1] * (clean.ndim - 1)) for one in levels(time))
    return signal * clean + spread * noise, signal * noise - spread * clean


@torch.no_grad()
def denoised(
    denoiser: Denoiser,
    noise: Tensor,
    known: Tensor | None = None,
    kept: Tensor | None = None,
    steps: int = STEPS,
    like: Tensor | None = None,
    since: float = 1.0,
) -> Tensor:
    """Clean vectors (B, ...) that begin as noise. Where `kept`, they are the `known` ones, noised as the rest
    is on the way, so that the rest is made to suit them. Given `like`, they begin at the time `since` as that
    with its share of noise, and so come out near it (SDEdit, Meng et al. 2022)."""
    at = noise if like is None else noised(like, noise, torch.full((len(noise),), since))[0]
    times = torch.linspace(since, 0.0, max(1, round(steps * since)) + 1)
    for now, then in zip(times[:-1].tolist(), times[1:].tolist(), strict=True):
        time = torch.full((len(noise),), now)
        if known is not None and kept is not None:
            at = torch.where(kept, noised(known, noise, time)[0], at)
        velocity = denoiser(at, time)
        signal, spread = (one.view(-1, *[1] * (noise.ndim - 1)) for one in levels(time))
        clean, rest = signal * at - spread * velocity, spread * at + signal * velocity
        signal, spread = levels(torch.tensor(then))
        at = clean if then == 0 else signal * clean + spread * rest
    return at if known is None or kept is None else torch.where(kept, known, at)
