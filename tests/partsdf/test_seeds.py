"""Every seed draws something of its own, large ones, too."""

from __future__ import annotations

import torch

from partwright.partsdf.generator import Draw, _noise
from partwright.partsdf.seeds import mixed


def first(seed: int) -> float:
    return float(torch.rand(1, generator=torch.Generator().manual_seed(seed)))


def test_numbers_of_seeds_draw_different_noise() -> None:
    seeds = [0, 1, 2, 4096, 2**20, 2**31]
    drawn = [first(mixed(seed, number)) for seed in seeds for number in range(50)]
    assert len(set(drawn)) == len(drawn)
    assert [mixed(0, number) for number in (0, 7, 2**20)] == [0, 7, 2**20]


def test_samples_of_seeds_that_lie_a_power_of_two_apart_differ() -> None:
    """The generator on the CPU drops what lies above 32 bits: seed 4096 made the samples of seed 0."""
    draws = [Draw(0), Draw(1)]
    noise = [_noise(draws, seed, (3,)) for seed in (0, 1, 4096, 4097, 2**24)]
    for i, one in enumerate(noise):
        for other in noise[:i]:
            assert (one - other).abs().max() > 0.01
