"""The PyTorch kernel against the compiled one: the same equations, the same fits."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch

from partwright.fields import kernel, reference
from partwright.fields.columns import (
    FIELD,
    PROPORTIONS,
    ROTATION,
    ROTATION_STEP,
    SHAPE,
    SHAPE_STEP,
    SIZE,
    STEP_WIDTH,
    TRANSLATION,
    TRANSLATION_STEP,
    UNSIGNED,
    Column,
    Tangent,
)
from partwright.superfrusta.torch_equations import damped_step
from partwright.superfrusta.torch_kernel import TorchKernel
from tests.superfrusta.rows import subtracting

LIMITS = kernel.Limits(
    lower=(-2.0,) * 3 + (-9.0,) * 3 + (0.004,) * 3 + (0.0, 0.0, 0.0, 0.0, 0.0, 1e-3),
    upper=(2.0,) * 3 + (9.0,) * 3 + (2.5,) * 3 + (1.0, 0.5, 2.0, 1.0, 1.0, 0.3),
    step=(0.1,) * 3 + (0.3,) * 3 + (0.2,) * 3 + (0.3, 0.05, 0.3, 0.3, 0.3, 0.05),
)
STAGES = [(15, 10), (40, 10), (100, 8)]
BOTH = kernel.Penalties(0.05, 0.05)
DEVICES = [
    "cpu",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device")),
]


@pytest.fixture(autouse=True)
def one_thread() -> Iterator[None]:
    """Tensors as small as these are slower on several threads."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.fixture(params=DEVICES)
def torch_kernel(request: pytest.FixtureRequest) -> TorchKernel:
    return TorchKernel(request.param)


def random_rows(generator: np.random.Generator, parts: int) -> np.ndarray:
    """Parts of ordinary proportions, well inside all bounds."""
    rotation = generator.normal(size=(parts, 4))
    columns = [
        generator.uniform(-0.5, 0.5, (parts, 3)),
        rotation / np.linalg.norm(rotation, axis=1, keepdims=True),
        generator.uniform([0.3, 0.3, 0.6], [0.6, 0.6, 0.9], (parts, 3)),
        generator.uniform([0.1, 0.01, 0.5, 0.05, 0.1, 0.01], [0.9, 0.1, 1.5, 0.3, 0.6, 0.2], (parts, 6)),
    ]
    return np.hstack(columns).astype(np.float32)


def target_of(rows: np.ndarray, generator: np.random.Generator, count: int = 3000) -> kernel.Target:
    points = generator.uniform(-1, 1, (count, 3)).astype(np.float32)
    weight = generator.uniform(0.5, 2, count).astype(np.float32)
    return kernel.Target(points, kernel.evaluate(rows, points), weight / weight.sum())


def perturbed(rows: np.ndarray, generator: np.random.Generator, amount: float = 0.05) -> np.ndarray:
    changed = rows.copy()
    changed[:, TRANSLATION] += generator.normal(size=(len(rows), 3)) * amount
    changed[:, ROTATION] += generator.normal(size=(len(rows), 4)) * amount
    changed[:, SIZE] *= 1 + generator.normal(size=(len(rows), 3)) * amount
    changed[:, PROPORTIONS] = [0.5, 0.02, 1.0, 0.1, 0.2]
    return changed


@pytest.mark.parametrize("parts", [1, 5])
def test_distances_equal_the_compiled_kernel(torch_kernel: TorchKernel, parts: int) -> None:
    generator = np.random.default_rng(parts)
    rows = random_rows(generator, parts)
    points = generator.uniform(-1, 1, (4000, 3)).astype(np.float32)
    np.testing.assert_allclose(torch_kernel.evaluate(rows, points), kernel.evaluate(rows, points), atol=2e-6)
    alone = torch_kernel.evaluate_parts(rows, points)
    np.testing.assert_allclose(alone, kernel.evaluate_parts(rows, points), atol=2e-6)


@pytest.mark.parametrize("penalties", [kernel.Penalties(), kernel.Penalties(0.1, 0), BOTH])
@pytest.mark.parametrize("background", [False, True])
@pytest.mark.parametrize(("parts", "beta"), [(1, 15.0), (4, 40.0), (4, 100.0)])
@pytest.mark.parametrize("minus", [(), (1,)])
def test_normal_equations_equal_the_compiled_kernel(
    torch_kernel: TorchKernel,
    minus: tuple[int, ...],
    parts: int,
    beta: float,
    background: bool,
    penalties: kernel.Penalties,
) -> None:
    generator = np.random.default_rng(7)
    truth = random_rows(generator, parts)
    target = target_of(truth, generator)
    rows = subtracting(perturbed(truth, generator), *minus)
    if background:
        behind = kernel.evaluate(random_rows(generator, 1), target.points)
        target = kernel.Target(target.points, target.distance, target.weight, behind)
    loss, gradient, matrix = kernel.normal_equations(rows, target, beta, penalties)
    found_loss, found_gradient, found_matrix = torch_kernel.normal_equations(rows, target, beta, penalties)
    assert found_loss == pytest.approx(loss, rel=1e-4)
    assert torch_kernel.loss(rows, target, beta, penalties) == pytest.approx(loss, rel=1e-4)
    # The compiled kernel leaves out what saturated points add; the exact gradient is tested below.
    assert np.linalg.norm(found_gradient - gradient) < 2e-3 * np.linalg.norm(gradient)
    scale = np.sqrt(np.diag(matrix))  # every entry, in units of its own row and column
    assert np.linalg.norm(found_matrix - matrix) < 5e-5 * np.linalg.norm(matrix)
    assert (np.abs(found_matrix - matrix) <= 5e-3 * (scale[:, None] * scale + 1e-9)).all()


def exact_gradient(
    rows: np.ndarray, target: kernel.Target, beta: float, penalties: kernel.Penalties
) -> np.ndarray:
    """Gradient (15 M,) of the loss by autograd through the reference, in float64."""
    start = torch.tensor(rows).double()
    change = torch.zeros(len(rows), STEP_WIDTH, dtype=torch.float64, requires_grad=True)
    (w, x, y, z), (a, b, c) = start[:, ROTATION].T, change[:, ROTATION_STEP].T / 2
    rotation = [w - x * a - y * b - z * c, x + w * a + y * c - z * b, y + w * b + z * a - x * c]
    rotation.append(z + w * c + x * b - y * a)  # q (1, w/2): R exp(w) to first order
    moved = torch.cat(
        [
            start[:, TRANSLATION] + change[:, TRANSLATION_STEP],
            torch.stack(rotation, 1),
            start[:, SHAPE] + change[:, SHAPE_STEP],
        ],
        1,
    )
    points, distance, weight, background = (torch.tensor(array).double() for array in target.arrays())
    alone = reference.evaluate_parts(moved, points)
    blends, signs = moved[:, Column.BLEND], start[:, Column.SIGN]
    if len(background):
        alone = torch.cat([background[None], alone])
        blends, signs = torch.cat([blends[:1], blends]), torch.cat([torch.ones(1), signs])
    whole = torch.sigmoid(-beta * reference.fold(alone, blends, signs))
    total = torch.sigmoid(-beta * alone[signs > 0]).sum(0)
    squares = (whole - torch.sigmoid(-beta * distance)) ** 2
    squares = squares + penalties.overlap * (total - 1).clamp(min=0) ** 2
    squares = squares + penalties.blending * (whole - total.clamp(max=1)).clamp(min=0) ** 2
    (gradient,) = torch.autograd.grad(0.5 * (weight * squares).sum(), change)
    return gradient.flatten().numpy()


@pytest.mark.parametrize("penalties", [kernel.Penalties(), BOTH])
@pytest.mark.parametrize("background", [False, True])
@pytest.mark.parametrize(("parts", "beta"), [(1, 15.0), (4, 40.0), (4, 100.0)])
@pytest.mark.parametrize("minus", [(), (1,), (3,)])
def test_the_gradient_is_exact(
    torch_kernel: TorchKernel,
    minus: tuple[int, ...],
    parts: int,
    beta: float,
    background: bool,
    penalties: kernel.Penalties,
) -> None:
    generator = np.random.default_rng(11)
    truth = random_rows(generator, parts)
    target = target_of(truth, generator)
    rows = subtracting(perturbed(truth, generator), *minus)
    if background:
        behind = kernel.evaluate(random_rows(generator, 1), target.points)
        target = kernel.Target(target.points, target.distance, target.weight, behind)
    expected = exact_gradient(rows, target, beta, penalties)
    _, found, _ = torch_kernel.normal_equations(rows, target, beta, penalties)
    assert np.linalg.norm(found - expected) < 1e-5 * np.linalg.norm(expected)


def test_little_memory_gives_the_same_sums() -> None:
    generator = np.random.default_rng(1)
    truth = random_rows(generator, 3)
    target, rows = target_of(truth, generator), perturbed(truth, generator)
    whole, pieces = TorchKernel("cpu"), TorchKernel("cpu", memory=1 << 20)
    expected = whole.normal_equations(rows, target, 40.0, BOTH)
    for found, value in zip(pieces.normal_equations(rows, target, 40.0, BOTH), expected, strict=True):
        np.testing.assert_allclose(found, value, rtol=1e-4, atol=1e-6 * np.abs(value).max())
    np.testing.assert_array_equal(pieces.evaluate(rows, target.points), whole.evaluate(rows, target.points))


@pytest.mark.parametrize("penalties", [kernel.Penalties(), BOTH])
@pytest.mark.parametrize(("parts", "steps", "loose"), [(1, 5, 1), (3, 2, 10)])
def test_a_fit_takes_the_same_steps_as_the_compiled_one(
    torch_kernel: TorchKernel, parts: int, steps: int, loose: float, penalties: kernel.Penalties
) -> None:
    # The compiled kernel solves for the step of several parts to a thousandth only.
    generator = np.random.default_rng(parts)
    truth = random_rows(generator, parts + 1)  # one part too few: no exact fit
    target, start = target_of(truth, generator), perturbed(truth, generator)[:parts]
    stages = [(15, steps)]
    expected, loss, count = kernel.levenberg_marquardt(start, target, stages, LIMITS, penalties=penalties)
    rows, found, taken = torch_kernel.levenberg_marquardt(start, target, stages, LIMITS, penalties=penalties)
    assert taken == count
    assert found == pytest.approx(loss, rel=1e-4 * loose)
    np.testing.assert_allclose(rows, expected, atol=1e-3 * loose)


@pytest.mark.parametrize("tied", [False, True])
def test_bounds_and_ties_shape_the_steps_as_in_the_compiled_kernel(
    torch_kernel: TorchKernel, tied: bool
) -> None:
    generator = np.random.default_rng(2)
    truth = random_rows(generator, 1)
    truth[0, PROPORTIONS] = [0.0, 0.0, 1.0, 0.0, 0.0]
    target, start = target_of(truth, generator), perturbed(truth, generator)
    start[0, FIELD] = [0.5, 0.5, 0.7, 0.0, 0.0, 1.2, 0.0, 0.0]  # several parameters on their bounds
    mask = np.array([tied])
    for steps in (1, 2, 4):
        expected, loss, _ = kernel.levenberg_marquardt(start, target, [(15, steps)], LIMITS, tied=mask)
        rows, found, _ = torch_kernel.levenberg_marquardt(start, target, [(15, steps)], LIMITS, tied=mask)
        assert found == pytest.approx(loss, rel=1e-3)
        np.testing.assert_allclose(rows, expected, atol=1e-3)


def test_the_damped_step_solves_for_the_variables_alone() -> None:
    generator = torch.Generator().manual_seed(0)
    root = torch.randn(2, 40, 8, generator=generator, dtype=torch.float64)
    matrix, gradient = root.mT @ root, torch.randn(2, 8, generator=generator, dtype=torch.float64)
    variable = torch.ones(2, 8, dtype=torch.bool)
    variable[0, 2] = variable[1, 5:] = False
    damping = torch.tensor([0.01, 3.0], dtype=torch.float64)
    step = damped_step(matrix, gradient, variable, damping).numpy()
    for i in range(2):
        moving = variable[i].numpy()
        own = matrix[i].numpy()[np.ix_(moving, moving)]
        own = own + np.diag(damping[i].item() * (np.diag(own) + 1e-3) + 1e-9)
        np.testing.assert_allclose(step[i, moving], np.linalg.solve(own, -gradient[i].numpy()[moving]))
        assert (step[i, ~moving] == 0).all()
    broken = damped_step(-matrix, gradient, variable, damping)
    assert broken.isnan().all()


@pytest.mark.parametrize("penalties", [kernel.Penalties(), BOTH])
@pytest.mark.parametrize("parts", [1, 3])
def test_a_fit_ends_where_the_compiled_one_ends(
    torch_kernel: TorchKernel, parts: int, penalties: kernel.Penalties
) -> None:
    generator = np.random.default_rng(parts)
    truth = random_rows(generator, parts)
    exact, start = target_of(truth, generator), perturbed(truth, generator, 0.03)
    noise = generator.normal(size=len(exact.points)).astype(np.float32) * 0.01  # a minimum above 0
    target = kernel.Target(exact.points, exact.distance + noise, exact.weight)
    _, loss, _ = kernel.levenberg_marquardt(start, target, STAGES, LIMITS, penalties=penalties)
    rows, found, steps = torch_kernel.levenberg_marquardt(start, target, STAGES, LIMITS, penalties=penalties)
    assert loss < 0.7 * kernel.loss(start, target, STAGES[-1][0], penalties)
    assert found == pytest.approx(loss, rel=0.02)
    assert found == pytest.approx(kernel.loss(rows, target, STAGES[-1][0], penalties), rel=1e-4)
    assert 0 < steps <= sum(count for _, count in STAGES)
    np.testing.assert_allclose(np.linalg.norm(rows[:, ROTATION], axis=1), 1, atol=1e-6)


def test_only_free_entries_move_and_ties_hold(torch_kernel: TorchKernel) -> None:
    generator = np.random.default_rng(4)
    truth = random_rows(generator, 3)
    target, start = target_of(truth, generator), perturbed(truth, generator)
    start[1, Column.SY] = start[1, Column.SX]
    start[0, Column.SY] = 2 * start[0, Column.SX]  # marked as tied, but nothing of it is free
    free = np.ones((3, STEP_WIDTH), bool)
    free[0] = False
    free[1, 3:6] = False
    tied = np.array([True, True, False])
    options = {"free": free, "tied": tied}
    rows, loss, _ = torch_kernel.levenberg_marquardt(start, target, STAGES, LIMITS, **options)
    _, expected, _ = kernel.levenberg_marquardt(start, target, STAGES, LIMITS, **options)
    np.testing.assert_array_equal(rows[0], start[0])
    np.testing.assert_array_equal(rows[1, ROTATION], start[1, ROTATION])
    assert rows[1, Column.SX] == rows[1, Column.SY] != start[1, Column.SX]
    assert loss == pytest.approx(expected, rel=0.02)


def test_a_fit_stays_in_the_box_and_off_folded_arcs(torch_kernel: TorchKernel) -> None:
    generator = np.random.default_rng(5)
    bent = random_rows(generator, 1)
    bent[0, FIELD] = [0.5, 0.3, 0.55, 0.5, 0.01, 1.0, 1.0, 0.0]
    target = target_of(bent, generator)
    start = perturbed(bent, generator, 0.02)
    start[0, SIZE] = [0.4, 0.3, 0.3]
    start[0, Column.BULGE] = 0.5
    rows, _, _ = torch_kernel.levenberg_marquardt(start, target, STAGES, LIMITS)
    lower, upper, _ = LIMITS.array()
    assert (rows[0, 7:] >= lower[6:]).all()
    assert (rows[0, 7:] <= upper[6:]).all()
    assert (
        np.sin(rows[0, Column.BULGE] * np.pi / 2) <= min(1.0, rows[0, Column.SZ] / rows[0, Column.SX]) + 1e-5
    )


def test_a_bulge_that_is_not_free_keeps_its_bits(torch_kernel: TorchKernel) -> None:
    generator = np.random.default_rng(5)
    truth = random_rows(generator, 1)
    target = target_of(truth, generator)
    start = perturbed(truth, generator, 0.02)
    start[0, Column.BULGE] = 0.9  # tighter than its size allows
    start[0, Column.SZ] = 0.5 * start[0, Column.SX]
    free = np.ones((1, STEP_WIDTH), bool)
    free[0, 12] = False
    rows, _, _ = torch_kernel.levenberg_marquardt(start, target, STAGES, LIMITS, free=free)
    assert rows[0, Column.BULGE] == start[0, Column.BULGE]
    assert (rows[0, SIZE] != start[0, SIZE]).all()


def test_starts_of_unequal_ranges_each_fit_like_alone(torch_kernel: TorchKernel) -> None:
    generator = np.random.default_rng(6)
    truths = random_rows(generator, 3)
    targets = [
        target_of(row[None], generator, count) for row, count in zip(truths, (900, 1500, 600), strict=True)
    ]
    lie = kernel.Target(truths[:1, :3], np.ones(1, np.float32), np.ones(1, np.float32))  # in no range
    joined = kernel.Target(
        *(
            np.concatenate([getattr(t, name) for t in (lie, *targets)])
            for name in ("points", "distance", "weight")
        )
    )
    ends = 1 + np.cumsum([900, 1500, 600])
    ranges = np.stack([ends - [900, 1500, 600], ends], 1)
    starts = np.concatenate([perturbed(truths, generator), perturbed(truths, generator)])
    free = np.ones((6, STEP_WIDTH), bool)
    free[2, Tangent.BULGE] = False  # the bulge of one start
    ranges = np.concatenate([ranges, ranges])
    expected, expected_losses = kernel.fit_starts(starts, ranges, joined, STAGES, LIMITS, free=free)
    rows, losses = torch_kernel.fit_starts(starts, ranges, joined, STAGES, LIMITS, free=free)
    initial = np.array([kernel.loss(s[None], targets[i % 3], STAGES[-1][0]) for i, s in enumerate(starts)])
    assert rows.shape == expected.shape
    assert rows[2, Column.BULGE] == starts[2, Column.BULGE]
    np.testing.assert_array_less(np.abs(losses - expected_losses), 0.02 * expected_losses + 1e-4 * initial)
    for i in range(6):
        _, alone, _ = torch_kernel.levenberg_marquardt(
            starts[i : i + 1], targets[i % 3], STAGES, LIMITS, free=free[i : i + 1]
        )
        assert losses[i] == pytest.approx(alone, rel=0.02, abs=1e-4 * initial[i])


def test_a_background_is_part_of_what_is_explained(torch_kernel: TorchKernel) -> None:
    generator = np.random.default_rng(8)
    truth = random_rows(generator, 2)
    whole = target_of(truth, generator)
    behind = kernel.evaluate(truth[:1], whole.points)
    target = kernel.Target(whole.points, whole.distance, whole.weight, behind)
    assert torch_kernel.loss(truth[1:], target, 40.0) < 1e-10
    start = perturbed(truth[1:], generator)
    ranges = np.array([[0, len(whole.points)]])
    _, losses = torch_kernel.fit_starts(start, ranges, target, STAGES, LIMITS)
    _, expected = kernel.fit_starts(start, ranges, target, STAGES, LIMITS)
    assert losses == pytest.approx(expected, rel=0.02, abs=1e-7)


@pytest.mark.parametrize("minus", [(), (0,), (1, 3)])
@pytest.mark.parametrize("parts", [1, 4])
def test_removal_counts_equal_the_compiled_kernel(
    torch_kernel: TorchKernel, parts: int, minus: tuple[int, ...]
) -> None:
    generator = np.random.default_rng(9)
    rows = subtracting(random_rows(generator, parts), *minus)
    points = generator.uniform(-1, 1, (5000, 3)).astype(np.float32)
    inside = generator.random(5000) < 0.4
    weight = generator.uniform(0.5, 1.5, 5000).astype(np.float32)
    found = torch_kernel.removal_counts(rows, points, inside, weight)
    assert found.shape == (parts + 1, 2)
    np.testing.assert_allclose(found, kernel.removal_counts(rows, points, inside, weight), rtol=1e-5)


def test_wrong_shapes_are_refused() -> None:
    with pytest.raises(ValueError, match="parameter rows must be"):
        TorchKernel("cpu").evaluate(np.zeros((2, 12)), np.zeros((4, 3)))
    with pytest.raises(ValueError, match="points must be"):
        TorchKernel("cpu").evaluate(np.ones((2, UNSIGNED)), np.zeros((4, 2)))
