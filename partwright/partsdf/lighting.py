"""Views as pictures: lights, colours, backgrounds and blur at random, which tell nothing of the shape."""

from __future__ import annotations

import math

import torch
from torch import Tensor

from partwright.partsdf.views import SHADED, SIDE, Views

MIDDLE, SPREAD = 0.5, 0.25  # of a picture's numbers, which are from 0 to 1, for a network
_WHITE = 0.3  # of the backgrounds are plain and light
_ONE_COLOUR = 0.5  # of the shapes are of one colour
_THINGS, _THERE = 8, 0.6  # at most, of clutter, and the chance of each


def lit(views: Views, rows: Tensor, generator: torch.Generator) -> tuple[Tensor, Tensor]:
    """Pictures (B, 3, SIDE, SIDE), 0 to 1, of views `rows` (B,), and their silhouettes (B, SIDE, SIDE)."""
    label = views.label[rows]
    part = (label % SHADED).long()
    silhouette = (part > 0).float()
    batch = len(rows)

    def uniform(*size: int, low: float = 0.0, high: float = 1.0) -> Tensor:
        return low + (high - low) * torch.rand(*size, generator=generator)

    def chance(share: float) -> Tensor:
        return uniform(batch, 1, 1, 1) < share

    normal = views.normal[rows].float() / 127
    light, back = views.light[rows][:, None, None], views.back[rows][:, None, None]
    shadow = (label >= SHADED).float() * uniform(batch, 1, 1, low=0.3, high=1.0)
    key = (normal * light).sum(-1).clamp(min=0) * (1 - shadow)
    toward = (normal * back).sum(-1)
    sky = 0.5 + 0.5 * normal[..., 2]
    bright = uniform(batch, 3, 1, 1, low=0.1, high=0.7)
    shade = bright[:, 0] * sky + bright[:, 1] * key + 0.6 * bright[:, 2] * toward + 0.1
    half = torch.nn.functional.normalize(light + back, dim=-1)
    gloss = uniform(batch, 1, 1) ** 3 * (normal * half).sum(-1).clamp(min=0) ** 24

    parts = int(part.max()) + 1
    one, each = uniform(batch, 1, 3), uniform(batch, parts, 3)
    palette = torch.where(chance(_ONE_COLOUR)[..., 0], one.expand_as(each), 0.5 * one + 0.5 * each)
    grey = palette.mean(-1, keepdim=True)
    palette = 0.15 + 0.85 * (grey + (palette - grey) * uniform(batch, 1, 1, high=1.5))
    colour = palette.gather(1, part.flatten(1)[..., None].expand(-1, -1, 3)).unflatten(1, (SIDE, SIDE))
    seen = (colour * shade[..., None] + gloss[..., None]).permute(0, 3, 1, 2)
    grain = _clouded(batch, generator)[:, :1]
    seen = seen * torch.where(chance(0.3), 0.7 + 0.6 * grain, torch.ones(()))

    behind = backgrounds(batch, generator)
    under = _larger(torch.roll(torch.nn.functional.avg_pool2d(silhouette[:, None], 12), 1, dims=2))
    behind = behind * (1 - uniform(batch, 1, 1, 1, high=0.7) * under * chance(0.6))
    picture = torch.where(silhouette[:, None] > 0, seen, behind).clamp(0, 1)
    picture = torch.lerp(picture, _blurred(_blurred(picture, 2), 3), uniform(batch, 1, 1, 1))
    picture = picture ** uniform(batch, 1, 1, 1, low=0.6, high=1.5) * uniform(
        batch, 3, 1, 1, low=0.85, high=1.1
    )
    plain = picture.mean(1, keepdim=True).expand_as(picture)
    picture = torch.where(chance(0.15), plain, picture)
    noise = uniform(batch, 1, 1, 1, high=0.05) * torch.randn(picture.shape, generator=generator)
    return (picture + noise).clamp(0, 1), silhouette


def before_clutter(pictures: Tensor, silhouette: Tensor, generator: torch.Generator) -> Tensor:
    """Pictures (B, 3, SIDE, SIDE) of shapes that are where `silhouette` (B, SIDE, SIDE) is 1, half of them
    before boxes, balls, stripes and walls of any colour."""
    batch = len(pictures)

    def uniform(*size: int, low: float = 0.0, high: float = 1.0) -> Tensor:
        return low + (high - low) * torch.rand(batch, *size, generator=generator)

    place = (torch.arange(SIDE) + 0.5) / SIDE
    strength, some = uniform(1, 1, 1, low=0.2), uniform(1, 1) < 0.5
    behind = pictures
    for _ in range(_THINGS):
        across, down = place - uniform(1, 1), place[:, None] - uniform(1, 1)
        angle = uniform(1, 1, high=math.pi)
        along = angle.cos() * across + angle.sin() * down
        aside = angle.cos() * down - angle.sin() * across
        half, other = uniform(1, 1, low=0.03, high=0.33), uniform(1, 1, low=0.03, high=0.33)
        kinds = torch.stack(
            [
                (along.abs() < half) & (aside.abs() < other),
                (along / half).square() + (aside / other).square() < 1,
                (2 * math.pi * uniform(1, 1, low=2.0, high=16.0) * along).sin() > 0.5,
                along > half,
            ]
        )
        kind = torch.randint(len(kinds), (batch,), generator=generator)
        there = kinds[kind, torch.arange(batch)] & some & (uniform(1, 1) < _THERE)
        behind = torch.where(there[:, None], torch.lerp(behind, uniform(3, 1, 1), strength), behind)
    return torch.where(silhouette[:, None] > 0, pictures, behind)


def _clouded(batch: int, generator: torch.Generator) -> Tensor:
    """(B, 3, SIDE, SIDE) smooth noise, 0 to 1, coarse or fine."""
    made = torch.empty(batch, 3, SIDE, SIDE)
    cells = [3, 6, 12, 32]
    chosen = torch.randint(len(cells), (batch,), generator=generator)
    for k, side in enumerate(cells):
        mine = (chosen == k).nonzero().squeeze(1)
        if len(mine):
            coarse = torch.rand(len(mine), 3, side, side, generator=generator)
            made[mine] = _larger(coarse)
    return made


def _larger(coarse: Tensor) -> Tensor:
    return torch.nn.functional.interpolate(coarse, size=(SIDE, SIDE), mode="bilinear")


def _blurred(picture: Tensor, axis: int) -> Tensor:
    """Each pixel half itself, half its two neighbours along an axis."""
    inner = 0.5 * picture.narrow(axis, 1, SIDE - 2)
    inner = inner + 0.25 * (picture.narrow(axis, 0, SIDE - 2) + picture.narrow(axis, 2, SIDE - 2))
    return torch.cat([picture.narrow(axis, 0, 1), inner, picture.narrow(axis, SIDE - 1, 1)], dim=axis)


def backgrounds(batch: int, generator: torch.Generator) -> Tensor:
    """(B, 3, SIDE, SIDE): plain, light, from one colour to another, a wall over a floor, or clouds."""

    def colour() -> Tensor:
        return torch.rand(batch, 3, 1, 1, generator=generator)

    one, other = colour(), colour()
    down = torch.linspace(0, 1, SIDE)[:, None].expand(SIDE, SIDE)
    kind = torch.rand(batch, 1, 1, 1, generator=generator)
    horizon = 0.3 + 0.6 * torch.rand(batch, 1, 1, 1, generator=generator)
    behind = torch.lerp(one, other, 0.5 * down[None, None])
    behind = torch.where(kind < 0.7, torch.where(down > horizon, one, 0.5 + 0.5 * other), behind)
    behind = torch.where(kind < 0.5, one.expand_as(behind), behind)
    clouds = torch.rand(batch, 1, 1, 1, generator=generator) ** 2
    behind = behind + clouds * (_clouded(batch, generator) - 0.5)
    light = (1 - 0.12 * colour() ** 2).expand_as(behind)
    return torch.where(kind < _WHITE, light, behind).clamp(0, 1)
