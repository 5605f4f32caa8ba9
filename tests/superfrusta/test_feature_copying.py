"""Where copies of a feature are looked for."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest

import partwright as pw
from partwright.assembly import Assembly, Part, Similarity
from partwright.fields import Box, Cylinder, Extrusion, Profile
from partwright.meshing import mesh_assembly
from partwright.methods import Run
from partwright.superfrusta.feature_copying import _lattice
from partwright.superfrusta.feature_search import FeatureSearch
from partwright.superfrusta.samples import FitSamples
from partwright.superfrusta.solids import Settings

HOLE = Part(Cylinder(0.02, 0.1), (0.1, 0.2, 0.3))


def lattice(ways: np.ndarray) -> np.ndarray:
    """(N, 3) shifts beyond those that are known."""
    moves = [Similarity(translation=(x, y, z)) for x, y, z in ways.tolist()]
    return np.reshape([move.translation for move in _lattice(HOLE, moves)], (-1, 3))


@pytest.mark.parametrize("count", [0, 1, 2, 6, 16])
def test_sums_and_differences_of_what_is_known_are_looked_at(count: int) -> None:
    ways = np.random.default_rng(count).uniform(-0.8, 0.8, (count, 3))
    known = np.concatenate([np.zeros((1, 3)), ways])
    pairs = [(a, b) for i, a in enumerate(known) for b in known[i + 1 :]]
    sums = np.reshape([s for a, b in pairs for s in (a + b, a - b, b - a)], (-1, 3))
    new = [s for s in sums if np.linalg.norm(known - s, axis=1).min() > 8e-3]
    expected = np.unique(np.round(np.reshape(new, (-1, 3)), 9), axis=0)
    np.testing.assert_array_equal(lattice(ways), expected)


def test_places_that_are_the_same_but_for_noise_are_one() -> None:
    """A grid of pieces whose middles are a little off."""
    grid = np.array([(x, y, 0) for x in range(3) for y in range(3)])[1:]
    exact = lattice(grid * 0.104)
    noisy = lattice(grid * 0.104 + np.random.default_rng(0).uniform(-1e-4, 1e-4, (8, 3)))
    assert len(exact) == len(noisy) == 29
    np.testing.assert_array_equal(
        np.unique(np.rint(noisy / 0.104), axis=0), np.unique(np.rint(exact / 0.104), axis=0)
    )


def test_many_copies_take_little_memory() -> None:
    """And of the places those are looked at to which most of them lead: the one that lacks among them."""
    grid = np.array([(x * 0.05, y * 0.05, 0.0) for x in range(20) for y in range(15)])
    gone = 20 * 7
    tracemalloc.start()
    try:
        ways = lattice(np.delete(grid, (0, gone), axis=0))
        assert tracemalloc.get_traced_memory()[1] < 3e7
    finally:
        tracemalloc.stop()
    assert len(ways) == 500
    assert np.abs(ways - grid[gone]).max(axis=1).min() < 1e-6


@pytest.mark.parametrize("seed", [1, 4])
def test_corners_cut_off_a_sheet_are_one_cut_however_few_samples_each_has(seed: int) -> None:
    """A hat channel with its four corners cut off: two to eight samples each, in one of them by chance three
    that stand for much volume. It was a cut in one corner, or a plate with gutters milled from it."""
    low, high = [(-30, 0), (-12, 0), (-12, 14), (12, 14), (12, 0), (30, 0)], [(30, 1), (13, 1), (13, 15)]
    hat = Profile.polygon([*low, *high, *((-x, y) for x, y in high[::-1])])
    upright, slanted = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0), (math.cos(math.pi / 8), 0.0, 0.0)
    moves = tuple(
        Similarity(translation=(x, y, 0.0)) for x, y in ((-60.0, 0.0), (0.0, -40.0), (-60.0, -40.0))
    )
    corners = Part(Box((8, 8, 6)), (30, 20, 0), (*slanted, math.sin(math.pi / 8)), instances=moves)
    drawn = Assembly((Part(Extrusion(hat, 40), (0, 0, 0), upright), corners), "difference")
    shape, settings = pw.load_shape(mesh_assembly(drawn), unit="mm"), Settings.for_quality("draft")
    samples = FitSamples.of(shape, settings, Run(seed=seed))
    tree = FeatureSearch(shape, samples, settings.alpha).run()
    assert tree is not None
    assert [(f.added, len(f.part.copies)) for f in tree.features] == [(True, 1), (False, 4)]
    assert len(tree.features[0].part.field.profile.corners) == 12
