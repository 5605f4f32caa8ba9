"""From noise to shapes: which parts, their poses, then latents that suit them (section 4.2).

SALAD's cascade of two diffusions (Koo et al. 2023), small. Latents are along their principal directions, each
in its own spread, which the paper found crucial (appendix B.3), and every part's latent hears of all poses.
Which parts there are is drawn before: a training shape's. Latents of shapes of which nothing is kept are then
brought to match one another, in families some of whose parts lie in others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn

from partwright.errors import ModelError, SettingError
from partwright.partsdf.companions import (
    check_tokens,
    companion_file,
    load_companion,
    save_companion,
    with_weights,
)
from partwright.partsdf.diffusion import denoised
from partwright.partsdf.matching_forms import WholeShapes
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.part_sets import Near, drawn_sets
from partwright.partsdf.part_vectors import POSE, PartVectors
from partwright.partsdf.pose_range import within_range
from partwright.partsdf.poses import PoseTensors
from partwright.partsdf.seeds import mixed

KIND = "generator"
_MATCHED = "matched"  # in a file, beside the settings
_WAVES = 16  # by which a network sees the time
_TOGETHER = 8  # shapes that are made at a time, always so many: sums round otherwise for fewer
_FORGOTTEN = 0.3  # dropout of forms: poses tell little of them, and single shapes would be learned by heart


@dataclass(frozen=True)
class GeneratorSettings:
    """width: of tokens; heads; blocks: of either network."""

    width: int = 128
    heads: int = 4
    blocks: int = 4

    def __post_init__(self) -> None:
        check_tokens(self)


class Layouts(nn.Module):
    """Noisy poses (B, P, 12) at times (B,), where there are the parts (B, P, 1), 1 or -1, to their
    velocities: self-attention among parts."""

    def __init__(self, parts: int, settings: GeneratorSettings) -> None:
        super().__init__()
        width = settings.width
        self.enter = nn.Linear(POSE + 1, width)
        self.part = nn.Parameter(0.5 * torch.randn(parts, width))
        self.time = _Time(width)
        block = _block(nn.TransformerEncoderLayer, settings, 0.0)
        self.blocks = nn.TransformerEncoder(block, settings.blocks, enable_nested_tensor=False)
        self.out = _last(width, POSE)

    def forward(self, poses: Tensor, time: Tensor, present: Tensor) -> Tensor:
        there = present > 0
        layout = torch.cat([torch.where(there, poses, 0.0), present], dim=-1)
        tokens = self.enter(layout) + self.part + self.time(time)[:, None]
        result: Tensor = torch.where(there, self.out(self.blocks(tokens)), 0.0)
        return result


class Forms(nn.Module):
    """Noisy latents (B, P, K) at times (B,), with the poses and presence (B, P, 13) that they are for, to
    their velocities: self-attention among latents, cross-attention to poses."""

    def __init__(self, parts: int, latent: int, settings: GeneratorSettings) -> None:
        super().__init__()
        width = settings.width
        self.enter = nn.Linear(latent, width)
        self.placed = nn.Linear(POSE + 1, width)
        self.part = nn.Parameter(0.5 * torch.randn(parts, width))
        self.time = _Time(width)
        block = _block(nn.TransformerDecoderLayer, settings, _FORGOTTEN)
        self.blocks = nn.TransformerDecoder(block, settings.blocks)
        self.out = _last(width, latent)

    def forward(self, latents: Tensor, time: Tensor, layout: Tensor) -> Tensor:
        where = self.placed(layout) + self.part
        tokens = self.enter(latents) + where + self.time(time)[:, None]
        result: Tensor = self.out(self.blocks(tokens, where))
        return result


class _Time(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        self.change = nn.Sequential(nn.Linear(2 * _WAVES, width), nn.SiLU(), nn.Linear(width, width))

    def forward(self, time: Tensor) -> Tensor:
        phase = time[:, None] * torch.pi * torch.arange(1, _WAVES + 1)
        result: Tensor = self.change(torch.cat([phase.sin(), phase.cos()], dim=1))
        return result


def _block(kind: Any, settings: GeneratorSettings, dropout: float) -> Any:
    width = settings.width
    return kind(width, settings.heads, 2 * width, dropout=dropout, batch_first=True, norm_first=True)


def _last(width: int, outputs: int) -> nn.Module:
    return nn.Sequential(nn.LayerNorm(width), nn.Linear(width, outputs))


class Draw(NamedTuple):
    """Which noise a shape is made of: the `number`th of a seed, in its `attempt`th go at it, both from 0."""

    number: int
    attempt: int = 0


@dataclass(frozen=True)
class Generator:
    """Both networks, with the model whose parts they make. matched: whether forms of new shapes are mixed
    from those of whole training shapes, as parts that lie in others suit these only so."""

    model: Model
    settings: GeneratorSettings
    layouts: Layouts
    forms: Forms
    vectors: PartVectors
    matched: bool = False

    def generate(
        self,
        count: int | Sequence[Draw],
        seed: int = 0,
        source: NeuralShape | None = None,
        keep: Sequence[str] = (),
        keep_layout: bool = False,
        change: float = 0.0,
    ) -> list[NeuralShape]:
        """Shapes, each by its own noise: the first n of more are those of n, to the bit. As they come:
        `sound_samples` makes those anew whose parts come apart.

        count: how many, or which, each of these by itself. source: a shape whose parts `keep` stay as they
        are, or, with `keep_layout`, all of whose poses and no latent; or, with `change`, above 0 and at most
        1, which the samples are like: 1 leaves nothing of it.

        Raises:
            SettingError: none is asked for, nothing would be left to make, or the source is missing or of
                another model.
        """
        if isinstance(count, int):
            firsts = range(0, count, _TOGETHER)
            batches = [[Draw(first + i) for i in range(_TOGETHER)] for first in firsts]
        else:
            batches = [[draw] for draw in count]
        if not batches:
            raise SettingError(f"{count} samples: expected 1 or more")
        kept = torch.zeros(len(self.model.parts), dtype=torch.bool)
        for name in keep:
            kept[self.model.index(name)] = True
        self._check(source, kept, keep_layout, change)
        made = [
            shape for draws in batches for shape in self._made(draws, seed, source, kept, keep_layout, change)
        ]
        return made[:count] if isinstance(count, int) else made

    def _made(
        self,
        draws: Sequence[Draw],
        seed: int,
        source: NeuralShape | None,
        kept: Tensor,
        keep_layout: bool,
        change: float,
    ) -> list[NeuralShape]:
        """As `generate`, all draws together. kept: (P,) bool, the parts that stay."""
        noise = _noise(draws, seed, (len(kept), POSE + 2 + self.vectors.width))
        begun, sets, latents = noise.split([POSE, 2, self.vectors.width], dim=-1)
        present = self._present(sets, source, kept, keep_layout, change)

        def placed(**known: Any) -> Tensor:
            poses = denoised(lambda x, t: self.layouts(x, t, present), begun, **known)
            return tidy(torch.cat([poses, present], dim=-1))

        def formed(layout: Tensor, **known: Any) -> Tensor:
            return denoised(lambda x, t: self.forms(x, t, layout), latents, **known)

        if source is None:
            layout = self._within(placed())
            latents = formed(layout)
            if self.matched:
                latents = self._trained.matching(layout, latents)
        else:
            near = self.layout_of(source.poses, source.present).expand(len(draws), -1, -1)
            form = self.vectors.of_latents(source.latents).expand_as(latents)
            if change:
                layout = self._within(placed(like=near[..., :POSE], since=change), like=near[0])
                latents = formed(layout, like=form, since=change)
                if self.matched:
                    known = self._trained.with_one(near[0], form[0])  # which little noise comes back to
                    latents = known.matching(layout, latents)
                source = None
            else:
                fixed = torch.ones_like(kept) if keep_layout else kept
                layout = placed(known=near[..., :POSE], kept=fixed[:, None].expand_as(begun))
                layout = self._within(layout, fixed)
                latents = formed(layout, known=form, kept=kept[:, None].expand_as(latents))
        return [self._shape(layout[i], latents[i], source, kept, keep_layout) for i in range(len(draws))]

    def _present(
        self, noise: Tensor, source: NeuralShape | None, kept: Tensor, keep_layout: bool, change: float
    ) -> Tensor:
        """Which parts there are (B, P, 1), 1 or -1, by noise (B, P, 2)."""
        if source is not None and keep_layout:
            drawn = source.present.expand(len(noise), -1)
        else:
            near = Near(source.present, change) if source is not None and change else None
            chance = torch.special.ndtr(noise[:, 0, 1])
            drawn = drawn_sets(self.model.present, chance, noise[..., 0], kept, near)
        return torch.where(drawn, 1.0, -1.0)[..., None]

    @cached_property
    def _trained(self) -> WholeShapes:
        """The training shapes."""
        model, vectors = self.model, self.vectors
        layouts = self.layout_of(model.poses, model.present)
        return WholeShapes(layouts, vectors.of_latents(model.latents), vectors.tells)

    def layout_of(self, poses: PoseTensors, present: Tensor) -> Tensor:
        """(..., P, 13) of poses (..., P, ...) and presence (..., P)."""
        return tidy(torch.cat([self.vectors.of_poses(poses), 2.0 * present[..., None] - 1], dim=-1))

    def _within(self, layout: Tensor, fixed: Tensor | None = None, like: Tensor | None = None) -> Tensor:
        still = torch.zeros(layout.shape[1], dtype=torch.bool) if fixed is None else fixed
        return within_range(self.model, self.vectors, layout, still, like)

    def _check(self, source: NeuralShape | None, kept: Tensor, keep_layout: bool, change: float) -> None:
        name = self.model.name
        if not 0 <= change <= 1:
            raise SettingError(f"change is {change}; expected above 0 and at most 1")
        if source is None:
            if kept.any() or keep_layout or change:
                raise SettingError(
                    "parts or poses are kept, or samples near a shape made, but of which shape? Name it"
                )
            return
        if source.model.hash != self.model.hash:
            raise SettingError(f"the shape is of another model, {source.model.name}; give one of {name}")
        if keep_layout + bool(kept.any()) + bool(change) > 1:
            raise SettingError("either all poses are kept, or some parts whole, or all is alike; choose one")
        if not kept.any() and not keep_layout and not change:
            raise SettingError("a shape is named, but nothing of it is kept; name parts, or keep its poses")
        if kept.all():
            raise SettingError(f"all parts of {name} are kept; nothing is left to make")
        for part in kept.nonzero().squeeze(1).tolist():
            if not source.present[part]:
                raise SettingError(f"{self.model.parts[part]} is to be kept, but the shape has none")

    def _shape(
        self, layout: Tensor, latents: Tensor, source: NeuralShape | None, kept: Tensor, keep_layout: bool
    ) -> NeuralShape:
        present = layout[:, -1] > 0
        made = NeuralShape.of(
            self.model, self.vectors.latents(latents), self.vectors.poses(layout[:, :POSE]), present
        )
        if source is None:
            return made
        same = (kept | keep_layout)[:, None]  # to the bit, not through vectors
        form = torch.where(kept[:, None], source.latents, made.latents)
        poses = [torch.where(same, a, b) for a, b in zip(source.poses, made.poses, strict=True)]
        present = torch.where(same[:, 0], source.present, present)
        return NeuralShape(self.model, form, PoseTensors(*poses), present)

    def save(self, path: str | Path) -> None:
        """Write it; raises OutputError."""
        tensors = {
            f"{n}.{k}": v for n in ("layouts", "forms") for k, v in getattr(self, n).state_dict().items()
        }
        about = asdict(self.settings) | {_MATCHED: self.matched}
        save_companion(path, KIND, self.model, about, tensors)


def tidy(layout: Tensor) -> Tensor:
    """Poses and presence (..., 13) where presence is 1 or -1, and the pose of what is absent the mean."""
    there = layout[..., -1:] > 0
    return torch.cat([torch.where(there, layout[..., :-1], 0.0), torch.where(there, 1.0, -1.0)], dim=-1)


def load_generator(model: Model, path: str | Path | None = None) -> Generator:
    """The generator of a file, or of the one beside the model's.

    Raises:
        ModelError: there is none; else as `load_companion`.
    """
    source = companion_file(model, KIND, path)
    if source is None:
        raise ModelError(f"{model.name} has no generator; make one with `parts train-generator`")

    def made(settings: dict[str, Any], tensors: dict[str, Tensor]) -> Generator:
        matched = settings.pop(_MATCHED, False)
        if not isinstance(matched, bool):
            raise ValueError(f"{_MATCHED} is {matched!r}")
        known, vectors = GeneratorSettings(**settings), PartVectors.of(model)
        real = with_weights(lambda: nn.ModuleDict(networks(model, vectors, known)), tensors)
        how = {"vectors": vectors, "matched": matched}
        return Generator(model, known, **dict(real.items()), **how)  # type: ignore[arg-type]

    return load_companion(source, KIND, model, made)


def networks(model: Model, vectors: PartVectors, settings: GeneratorSettings) -> dict[str, nn.Module]:
    parts = len(model.parts)
    return {"layouts": Layouts(parts, settings), "forms": Forms(parts, vectors.width, settings)}


def _noise(draws: Sequence[Draw], seed: int, size: tuple[int, ...]) -> Tensor:
    """(len(draws), *size), of which each row depends on the seed and its own draw alone."""
    rows = []
    for number, attempt in draws:
        # The 32 bits of seeds below 4096 are taken as they are, so that their samples stay what they were.
        bits = mixed(attempt, mixed(seed >> 12, (seed << 20) + number))
        rows.append(torch.randn(size, generator=torch.Generator().manual_seed(bits)))
    return torch.stack(rows)
