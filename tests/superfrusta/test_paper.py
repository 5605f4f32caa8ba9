"""The paper's losses against numbers worked out by hand, their gradients, and what descending them does."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
import torch

from partwright.errors import SettingError
from partwright.fields import kernel
from partwright.fields.columns import PROPORTIONS, ROTATION, SIZE, TRANSLATION, UNSIGNED, Column
from partwright.superfrusta.paper import (
    Losses,
    LossSamples,
    PaperConfig,
    fade,
    losses,
    optimise,
    project,
    quality_loss,
    reconstruction_loss,
    sample_existence,
)

# translation, rotation, size, roundness, dilation, taper, bulge, onion, blend
BOX = [-0.35, 0, 0, 1, 0, 0, 0, 0.5, 0.4, 0.6, 0.2, 0.02, 1.0, 0.0, 0.0, 0.02]
ROD = [0.35, 0.1, 0, 0.9, 0.1, 0.4, 0, 0.35, 0.3, 0.9, 0.8, 0.02, 0.8, 0.0, 0.0, 0.02]
QUICK = PaperConfig(iterations=10, batch=256)


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Tensors as small as these are slower on several threads."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def rows_of(*parts: list[float]) -> np.ndarray:
    rows = np.array(parts, np.float32)
    rows[:, ROTATION] /= np.linalg.norm(rows[:, ROTATION], axis=1, keepdims=True)
    return rows


def samples_of(rows: np.ndarray, seed: int = 0, count: int = 8000) -> tuple[np.ndarray, ...]:
    """Half of the points within 0.1 of the surface, the others anywhere."""
    points = np.random.default_rng(seed).uniform(-1, 1, (20 * count, 3)).astype(np.float32)
    near = points[np.abs(kernel.evaluate(rows, points)) < 0.1]
    points = np.concatenate([near[: count // 2], points[: count // 2]])
    return points, kernel.evaluate(rows, points), np.ones(len(points), np.float32)


def iou(rows: np.ndarray, other: np.ndarray) -> float:
    points = np.random.default_rng(99).uniform(-1, 1, (40_000, 3)).astype(np.float32)
    a, b = kernel.evaluate(rows, points) < 0, kernel.evaluate(other, points) < 0
    return float((a & b).sum() / (a | b).sum())


def perturbed(rows: np.ndarray) -> np.ndarray:
    generator = np.random.default_rng(3)
    changed = rows.copy()
    changed[:, TRANSLATION] += generator.normal(size=(len(rows), 3)) * 0.05
    changed[:, ROTATION] += generator.normal(size=(len(rows), 4)) * 0.05
    changed[:, SIZE] *= generator.uniform(0.8, 1.25, (len(rows), 3))
    return project(torch.tensor(changed)).numpy()


def test_reconstruction_is_the_weighted_mean_over_the_mask() -> None:
    occupancy, target = torch.tensor([0.5, 1.0, 0.25, 0.0]), torch.tensor([1.0, 1.0, 0.0, 1.0])
    weight, mask = torch.tensor([2.0, 1.0, 1.0, 5.0]), torch.tensor([True, True, True, False])
    found = reconstruction_loss(occupancy, target, weight, mask)
    assert found == pytest.approx((2 * 0.25 + 0 + 0.0625) / 3)
    assert reconstruction_loss(occupancy, target, weight, torch.zeros(4, dtype=torch.bool)) == 0


def test_quality_counts_overlap_and_what_only_the_blend_fills() -> None:
    whole = torch.tensor([1.0, 1.0, 0.75, 0.0])
    parts = torch.tensor([[1.0, 0.75, 0.25, 0.0], [0.5, 0.25, 0.25, 0.0]])
    # point 0: overlap 0.5; point 1: parts meet exactly; point 2: the blend adds 0.25; point 3: empty
    assert quality_loss(whole, parts) == pytest.approx((0.5 + 0 + 0.25 + 0) / 4)


def test_a_part_fades_towards_outside_with_its_existence() -> None:
    distances = torch.tensor([[-0.5, 0.5], [-0.5, 0.5]])
    found = fade(distances, torch.tensor([1.0, 0.25]))
    np.testing.assert_allclose(found, [[-0.5, 0.5], [0.625, 0.875]])


def test_existence_is_a_relaxed_coin() -> None:
    uniform = torch.rand(200_000, generator=torch.Generator().manual_seed(0))
    logits = torch.full_like(uniform, math.log(3.0))
    heads = sample_existence(logits, 0.1, uniform)
    assert ((heads >= 0) & (heads <= 1)).all()
    assert (heads > 0.5).float().mean() == pytest.approx(0.75, abs=0.005)
    assert ((heads - 0.5).abs() > 0.4).float().mean() > 0.9
    assert sample_existence(torch.zeros(1), 0.5, torch.tensor([0.5])) == 0.5
    assert torch.isfinite(sample_existence(torch.zeros(2), 0.1, torch.tensor([0.0, 1.0]))).all()


def test_losses_of_one_sphere_equal_the_numbers_worked_out_by_hand() -> None:
    sphere = torch.tensor([[0, 0, 0, 1.0, 0, 0, 0, 0, 0, 0, 0, 0.5, 1, 0, 0, 0.02]], dtype=torch.float64)
    points = torch.tensor(
        [[0.4, 0, 0], [0, 0.55, 0], [0, 0, 0.9]], dtype=torch.float64
    )  # F = -0.1, 0.05, 0.4
    samples = LossSamples(
        points, torch.tensor([-0.1, -0.2, -0.3]).double(), torch.tensor([1.0, 2.0, 9.0]).double()
    )
    near, far, beyond = (1 / (1 + math.exp(10 * f)) for f in (-0.1, 0.05, 0.4))
    found = losses(sphere, torch.ones(1).double(), samples, 10.0, PaperConfig(tau=0.1))
    assert found.reconstruction == pytest.approx(((near - 1) ** 2 + 2 * (far - 1) ** 2) / 2)
    assert found.count == 1
    assert found.quality == pytest.approx(0, abs=1e-12)  # one part is its own union
    soft = losses(sphere, torch.ones(1).double(), samples, 10.0, PaperConfig(tau=0.1, soft_target=True))
    deep = 1 / (1 + math.exp(-2))
    assert soft.reconstruction == pytest.approx(2 * (far - deep) ** 2 / 2)
    half = losses(sphere, torch.full((1,), 0.5).double(), samples, 10.0, PaperConfig(tau=9.0))
    faded = [1 / (1 + math.exp(10 * (0.5 * f + 0.5))) for f in (-0.1, 0.05, 0.4)]
    expected = sum(w * (o - 1) ** 2 for w, o in zip((1, 2, 9), faded, strict=True)) / 3
    assert half.reconstruction == pytest.approx(expected)
    assert half.count == 0.5
    assert 0 < beyond < far < near


def test_the_total_weighs_and_switches_off() -> None:
    terms = Losses(*torch.tensor([2.0, 30.0, 4.0]))
    assert terms.total(PaperConfig()) == pytest.approx(2 + 1e-3 * 30 + 1e-2 * 4)
    assert terms.total(PaperConfig(count=0, quality=0)) == 2
    assert terms.total(PaperConfig(reconstruction=0, count=0)) == pytest.approx(0.04)


@pytest.mark.parametrize("term", ["reconstruction", "count", "quality"])
@pytest.mark.parametrize("soft", [False, True])
def test_gradients_equal_finite_differences(term: str, soft: bool) -> None:
    start = perturbed(rows_of(BOX, ROD))
    start[:, PROPORTIONS] = [[0.4, 0.03, 0.9, 0.2, 0.3], [0.6, 0.04, 1.1, 0.1, 0.2]]
    points, distance, weight = (torch.tensor(a).double() for a in samples_of(rows_of(BOX, ROD), count=60))
    config = PaperConfig(soft_target=soft, tau=0.5)
    rows = torch.tensor(start).double().requires_grad_()
    existence = torch.tensor([0.9, 0.8]).double().requires_grad_()

    def loss(rows: torch.Tensor, existence: torch.Tensor) -> torch.Tensor:
        return getattr(losses(rows, existence, LossSamples(points, distance, weight), 8.0, config), term)

    assert torch.autograd.gradcheck(loss, (rows, existence), eps=1e-6, atol=1e-7, rtol=1e-4)


@pytest.mark.parametrize("soft", [False, True])
def test_a_perturbed_assembly_is_recovered(soft: bool) -> None:
    truth = rows_of(BOX, ROD)
    start = perturbed(truth)
    assert iou(start, truth) < 0.8
    config = PaperConfig(iterations=200, batch=1024, soft_target=soft)
    found = optimise(start, *samples_of(truth), config=config, seed=1)
    assert found.kept.all()
    assert iou(found.rows, truth) > 0.95


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.heavy) for seed in (1, 2))])
def test_a_redundant_part_loses_its_existence(seed: int) -> None:
    # Ten times the paper's weight: at 1e-3 the outcome depends on the seed.
    truth = rows_of(BOX, ROD)
    inner = [*BOX[:7], 0.2, 0.2, 0.2, *BOX[10:]]
    config = PaperConfig(iterations=200, batch=1024, count=1e-2)
    found = optimise(rows_of(BOX, ROD, inner), *samples_of(truth), config=config, seed=seed)
    assert found.existence[2] < 0.1
    assert found.existence[:2].min() > 0.9
    np.testing.assert_array_equal(found.kept, [True, True, False])
    assert found.rows.shape == (2, UNSIGNED)
    assert iou(found.rows, truth) > 0.95


def test_without_the_count_loss_every_part_stays() -> None:
    inner = [*BOX[:7], 0.2, 0.2, 0.2, *BOX[10:]]
    config = PaperConfig(iterations=5, batch=256, count=0)
    found = optimise(rows_of(BOX, inner), *samples_of(rows_of(BOX)), config=config, seed=0)
    np.testing.assert_array_equal(found.existence, 1)
    assert found.kept.all()


def test_locked_rows_stay_bit_for_bit_and_exist() -> None:
    truth = rows_of(BOX, ROD)
    start = perturbed(truth)
    start[0, ROTATION] *= 1.5  # not even normalised
    found = optimise(start, *samples_of(truth), config=QUICK, seed=0, locked=1)
    np.testing.assert_array_equal(found.rows[0], start[0])
    assert (found.rows[1] != start[1]).any()
    assert found.existence[0] == 1
    everything = optimise(start, *samples_of(truth), config=QUICK, seed=0, locked=2)
    np.testing.assert_array_equal(everything.rows, start)


def test_one_part_always_stays() -> None:
    config = PaperConfig(iterations=60, batch=256, reconstruction=0, count=1.0, rate_existence=0.3)
    found = optimise(rows_of(BOX, ROD), *samples_of(rows_of(BOX)), config=config, seed=0)
    assert (found.existence < 0.5).all()
    assert found.kept.sum() == len(found.rows) == 1


def test_the_seed_decides_and_the_global_generator_is_left_alone() -> None:
    truth = rows_of(BOX, ROD)
    start, data = perturbed(truth), samples_of(truth)
    state = torch.get_rng_state()
    first, again, other = (optimise(start, *data, config=QUICK, seed=seed).rows for seed in (4, 4, 5))
    assert torch.equal(torch.get_rng_state(), state)
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_descent_ends_inside_the_bounds() -> None:
    truth = rows_of(BOX, ROD)
    config = PaperConfig(iterations=5, batch=256, rates=(0.5,) * 7, count=0)
    rows = torch.tensor(optimise(truth, *samples_of(truth), config=config, seed=0).rows)
    assert (rows[:, 7:] != torch.tensor(truth)[:, 7:]).any()
    torch.testing.assert_close(project(rows), rows)


def test_projection_keeps_rows_inside_their_bounds() -> None:
    wild = np.random.default_rng(0).normal(size=(200, UNSIGNED)).astype(np.float32) * 4
    rows = project(torch.tensor(wild))
    np.testing.assert_allclose(rows[:, ROTATION].norm(dim=1), 1, atol=1e-6)
    assert ((rows[:, Column.ROUNDNESS] >= 0) & (rows[:, Column.ROUNDNESS] <= 1)).all()
    assert (rows[:, SIZE] > 0).all()
    slender = (rows[:, Column.SZ] / rows[:, Column.SX]).clamp(max=1)
    assert (torch.sin(rows[:, Column.BULGE] * math.pi / 2) <= slender + 1e-5).all()
    torch.testing.assert_close(project(rows), rows)


@pytest.mark.parametrize(
    "wrong",
    [
        {"count": -1.0},
        {"quality": math.nan},
        {"iterations": 0},
        {"batch": 1.5},
        {"beta": (0.0, 100.0)},
        {"temperature": (0.5,)},
        {"existence": 1.0},
        {"rates": (1e-3,)},
        {"tau": 0.0},
    ],
)
def test_wrong_settings_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(SettingError, match=next(iter(wrong))):
        PaperConfig(**wrong)  # type: ignore[arg-type]


def test_wrong_arguments_are_refused() -> None:
    rows = rows_of(BOX)
    with pytest.raises(ValueError, match="locked must be"):
        optimise(rows, *samples_of(rows), config=QUICK, seed=0, locked=2)
    points, distance, weight = samples_of(rows)
    with pytest.raises(ValueError, match="distance must be"):
        optimise(rows, points, distance[1:], weight, config=QUICK, seed=0)
