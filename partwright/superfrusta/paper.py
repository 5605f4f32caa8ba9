"""The paper's optimiser: its three losses by gradient descent (SuperFrusta, section 3.4, eq. 7-8).

An alternative to Levenberg-Marquardt for comparisons and ablations; slower, in PyTorch. Repeats to the bit on
the same device with the same number of torch threads.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from partwright.errors import SettingError
from partwright.fields import reference
from partwright.fields.columns import (
    ROTATION,
    SHAPE,
    SHAPE_STEP,
    TRANSLATION,
    TRANSLATION_STEP,
    UNSIGNED,
    Column,
)
from partwright.fields.kernel import Rows, Target, _rows, like
from partwright.fields.superfrustum import tightest_bulge
from partwright.superfrusta.limits import LIMITS

BLOCKS = (3, 4, 3, 1, 1, 3, 1)  # columns that share a learning rate, in the order of `PaperConfig.rates`


def _check(name: str, value: object, good: bool, expected: str) -> None:
    if not good:
        raise SettingError(f"{name}: expected {expected}, got {value!r}")


@dataclass(frozen=True)
class PaperConfig:
    """Weights and schedules of the paper's optimiser. A weight of 0 switches its loss off.

    Stated by the paper (section 4, Implementation Details):
        count, quality: lambda_count and lambda_qual of eq. 8. At this lambda_count a small redundant part
            does not reliably vanish, because it stands in for others that may be absent; at 1e-2 it does.

    Ours, because the paper gives no values:
        reconstruction: weight of eq. 7 (the paper's is 1; 0 is for ablations).
        soft_target: compare with sigmoid(-beta * S) of the shape's own distance S, not its 0/1 occupancy.
        iterations, batch: steps of Adam, and the points drawn (with replacement) for each.
        beta: sharpness of the occupancy, first and last, rising by a constant factor.
        tau: width of the mask F < tau (unit lengths). F is that of all parts at full existence: if absent
            parts took their surroundings out of the mask, an empty assembly would have no loss.
        temperature: of the Gumbel-softmax, first and last, falling by a constant factor.
        existence: probability that each part starts with. Without the count loss all parts exist for certain.
        rates: Adam's learning rates for translation, rotation, size, roundness, dilation, the group of taper,
            bulge and onion, and blend.
        rate_existence: the learning rate of the existence logits.
        decay: the last learning rates as a share of the first.
    """

    count: float = 1e-3
    quality: float = 1e-2
    reconstruction: float = 1.0
    soft_target: bool = False
    iterations: int = 300
    batch: int = 4096
    beta: tuple[float, float] = (15.0, 100.0)
    tau: float = 0.1
    temperature: tuple[float, float] = (1.0, 0.2)
    existence: float = 0.9
    rates: tuple[float, ...] = (5e-3, 1e-2, 5e-3, 2e-2, 2e-3, 2e-2, 2e-3)
    rate_existence: float = 0.3
    decay: float = 0.1

    def __post_init__(self) -> None:
        for name in ("count", "quality", "reconstruction"):
            _check(name, getattr(self, name), 0 <= getattr(self, name) < math.inf, "a weight of at least 0")
        for name in ("iterations", "batch"):
            value = getattr(self, name)
            _check(name, value, isinstance(value, int) and value >= 1, "a whole number of at least 1")
        for name in ("beta", "temperature"):
            value = getattr(self, name)
            good = len(value) == 2 and all(0 < v < math.inf for v in value)
            _check(name, value, good, "a first and a last value above 0")
        for name in ("tau", "rate_existence", "decay"):
            _check(name, getattr(self, name), 0 < getattr(self, name) < math.inf, "a number above 0")
        _check("existence", self.existence, 0.5 < self.existence < 1, "a probability between 0.5 and 1")
        good = len(self.rates) == len(BLOCKS) and all(0 <= rate < math.inf for rate in self.rates)
        _check("rates", self.rates, good, f"{len(BLOCKS)} learning rates of at least 0")


@dataclass(frozen=True)
class Optimised:
    """Rows (K, 16) of the parts that still exist, which of the M given ones these are, and their
    probabilities (M,)."""

    rows: Rows
    kept: NDArray[np.bool_]
    existence: NDArray[np.float32]


class LossSamples(NamedTuple):
    """Points (N, 3), the shape's distance and weights (N,)."""

    points: Tensor
    distance: Tensor
    weight: Tensor


@dataclass(frozen=True)
class Losses:
    """The terms of eq. 8 before they are weighted; each a scalar."""

    reconstruction: Tensor
    count: Tensor
    quality: Tensor

    def total(self, config: PaperConfig) -> Tensor:
        """L_rec + lambda_count L_count + lambda_qual L_qual (eq. 8)."""
        weighted = (
            config.reconstruction * self.reconstruction,
            config.count * self.count,
            config.quality * self.quality,
        )
        return weighted[0] + weighted[1] + weighted[2]


def optimise(
    rows: ArrayLike,
    points: ArrayLike,
    distance: ArrayLike,
    weight: ArrayLike,
    *,
    config: PaperConfig,
    seed: int,
    locked: int = 0,
    device: str | torch.device = "cpu",
) -> Optimised:
    """Minimises eq. 8 from rows (M, 17) of added parts by distances (N,) with weights (N,) at points (N, 3).

    The first `locked` rows stay bit for bit and always exist. Parts whose existence probability ends below
    0.5 are dropped; if that were all, the likeliest stays.

    Raises:
        ValueError: arrays do not match in shape, or `locked` is not a number of rows.
    """
    start = _rows(rows)[:, :UNSIGNED]
    if not 0 <= locked <= len(start):
        raise ValueError(f"locked must be from 0 to the number of rows, {len(start)}, got {locked}")
    arrays = Target(*(np.asarray(a, np.float32) for a in (points, distance, weight))).arrays()[:3]
    samples = LossSamples(*(torch.as_tensor(array, device=device) for array in arrays))
    if locked == len(start) or len(samples.points) == 0:
        return Optimised(
            like(_rows(rows).copy(), rows), np.ones(len(start), bool), np.ones(len(start), np.float32)
        )
    moved, probability = _descend(torch.as_tensor(start, device=device), samples, config, locked, seed)
    existence = probability.cpu().numpy()
    kept = existence >= 0.5
    kept[existence.argmax()] = True
    result = _rows(rows).copy()
    result[locked:, :UNSIGNED] = moved.cpu().numpy()
    return Optimised(like(result[kept], rows), kept, existence)


def losses(rows: Tensor, existence: Tensor, samples: LossSamples, beta: float, config: PaperConfig) -> Losses:
    """The three losses of rows (M, 16) whose parts exist to the degree q, `existence` (M,) in 0..1."""
    alone = reference.evaluate_parts(rows, samples.points)
    blends = rows[:, Column.BLEND]
    with torch.no_grad():
        mask = reference.fold(alone, blends) < config.tau
    faded = fade(alone, existence)
    whole = torch.sigmoid(-beta * reference.fold(faded, blends))
    if config.soft_target:
        target = torch.sigmoid(-beta * samples.distance)
    else:
        target = (samples.distance < 0).to(whole)
    return Losses(
        reconstruction_loss(whole, target, samples.weight, mask),
        existence.sum(),
        quality_loss(whole, torch.sigmoid(-beta * faded)),
    )


def fade(distances: Tensor, existence: Tensor) -> Tensor:
    """f* = q f + (1 - q): parts (M, N) of little existence (M,) shrink away (section 3.4, Parsimony)."""
    q = existence[:, None]
    return q * distances + (1 - q)


def reconstruction_loss(occupancy: Tensor, target: Tensor, weight: Tensor, mask: Tensor) -> Tensor:
    """Mean over the masked points of w (o^ - o)^2 (eq. 7); 0 where the mask is empty. All arguments (N,)."""
    return (mask * weight * (occupancy - target) ** 2).sum() / mask.sum().clamp(min=1)


def quality_loss(occupancy: Tensor, part_occupancy: Tensor) -> Tensor:
    """Mean over the points of overlap and smooth-union consistency (section 3.4, Quality).

    Overlap is max(1, sum_i o_i) - 1, consistency o - min(sum_i o_i, 1). occupancy (N,) is o,
    part_occupancy (M, N) the o_i.
    """
    total = part_occupancy.sum(0)
    overlap = total.clamp(min=1) - 1
    consistency = occupancy - total.clamp(max=1)
    return (overlap + consistency).mean()


def sample_existence(logits: Tensor, temperature: float, uniform: Tensor) -> Tensor:
    """Binary Gumbel-softmax: existence in 0..1 from logits and uniform noise, both (M,)."""
    return torch.sigmoid((logits + torch.logit(uniform, eps=1e-6)) / temperature)


def project(rows: Tensor) -> Tensor:
    """Rows with parameters within their bounds, unit quaternions, and no arc folded over its centre."""
    lower, upper, _ = torch.as_tensor(LIMITS.array(), device=rows.device, dtype=rows.dtype)
    translation = rows[:, TRANSLATION].clamp(lower[TRANSLATION_STEP], upper[TRANSLATION_STEP])
    rotation = rows[:, ROTATION] / rows[:, ROTATION].norm(dim=1, keepdim=True)
    shape = rows[:, SHAPE].clamp(lower[SHAPE_STEP], upper[SHAPE_STEP])
    allowed = torch.cat([translation, rotation, shape], 1)
    tightest = tightest_bulge(allowed[:, Column.SX], allowed[:, Column.SZ])
    allowed[:, Column.BULGE] = torch.minimum(allowed[:, Column.BULGE], tightest)
    return allowed


def _descend(
    rows: Tensor, samples: LossSamples, config: PaperConfig, locked: int, seed: int
) -> tuple[Tensor, Tensor]:
    """Rows of the parts that are not locked and existence probabilities (M,) of all after the last step."""
    generator = torch.Generator().manual_seed(seed)
    device = rows.device
    locked_rows, free = rows[:locked], rows[locked:]
    blocks = [block.clone().requires_grad_() for block in free.split(BLOCKS, 1)]
    odds = math.log(config.existence / (1 - config.existence))
    logits = torch.full((len(free),), odds, device=device, requires_grad=True)
    certain = torch.ones(locked, device=device)
    groups: list[dict[str, Any]] = [
        {"params": [block], "lr": rate} for block, rate in zip(blocks, config.rates, strict=True)
    ]
    # While parts are often absent a spare one is worth its price: what logits felt then must fade quickly.
    groups.append({"params": [logits], "lr": config.rate_existence, "betas": (0.9, 0.9)})
    optimiser = torch.optim.Adam(groups)
    schedule = torch.optim.lr_scheduler.LambdaLR(optimiser, lambda i: config.decay ** (i / config.iterations))
    for iteration in range(config.iterations):
        progress = iteration / max(1, config.iterations - 1)
        drawn = torch.randint(len(samples.points), (config.batch,), generator=generator).to(device)
        uniform = torch.rand(len(free), generator=generator).to(device)
        exists = torch.ones_like(logits)
        if config.count > 0:
            exists = sample_existence(logits, _between(config.temperature, progress), uniform)
        optimiser.zero_grad()
        terms = losses(
            torch.cat([locked_rows, torch.cat(blocks, 1)]),
            torch.cat([certain, exists]),
            LossSamples(*(array[drawn] for array in samples)),
            _between(config.beta, progress),
            config,
        )
        terms.total(config).backward()
        optimiser.step()
        schedule.step()
        with torch.no_grad():
            for block, allowed in zip(blocks, project(torch.cat(blocks, 1)).split(BLOCKS, 1), strict=True):
                block.copy_(allowed)
    probability = torch.sigmoid(logits) if config.count > 0 else torch.ones_like(logits)
    return torch.cat(blocks, 1).detach(), torch.cat([certain, probability.detach()])


def _between(ends: tuple[float, float], progress: float) -> float:
    """From the first to the last value by a constant factor."""
    first, last = ends
    return first * (last / first) ** progress
