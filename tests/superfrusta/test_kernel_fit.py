"""Least squares in the kernel: derivatives, exact recovery, locks, bounds, ties and threads."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from partwright.fields import kernel
from partwright.fields.columns import (
    FIELD,
    ROTATION,
    ROTATION_STEP,
    SHAPE,
    SIZE,
    STEP_WIDTH,
    TRANSLATION,
    UNSIGNED,
    Column,
    Tangent,
)
from partwright.superfrusta.limits import LIMITS
from tests.superfrusta.rows import (
    TURNED,
    disturbed,
    exact_target,
    points_in_box,
    random_rows,
    row,
    subtracting,
)

STAGES = ((15.0, 20), (40.0, 20), (100.0, 30))
BOTH = kernel.Penalties(overlap=0.3, blending=0.2)
BLEND = Tangent.BLEND
SX, SZ, BULGE = Tangent.SX, Tangent.SZ, Tangent.BULGE
SIZES = SHAPE
# A quaternion's entries move with the local rotation; every other derivative has a column of its own.
COLUMN_OF = {d: Column[d.name] for d in Tangent if d.name[0] != "W"}

POSE = ((0.1, -0.05, 0.02), TURNED)
SOLIDS = {
    "box": row(*POSE, size=(1.2, 0.7, 0.4)),
    "rounded box": row(*POSE, size=(1.0, 0.7, 0.4), roundness=0.5, dilation=0.05),
    "cylinder": row(*POSE, size=(0.6, 0.6, 1.1), roundness=1.0),
    "cone": row(*POSE, size=(0.8, 0.8, 1.0), roundness=1.0, taper=0.0),
    "frustum": row(*POSE, size=(0.8, 0.7, 1.0), roundness=0.7, taper=0.6),
    "tube": row(*POSE, size=(0.8, 0.8, 1.0), roundness=1.0, onion=0.6, dilation=0.02),
    "bent tube": row(*POSE, size=(0.4, 0.4, 1.2), roundness=1.0, onion=0.5, bulge=0.5, dilation=0.01),
}
ROUND = {"cylinder", "cone", "tube"}  # turning about the axis changes nothing


def moved(rows: np.ndarray, part: int, derivative: int, step: float) -> np.ndarray:
    """The rows after a step of one derivative; rotations turn about the part's own axes."""
    changed = rows.copy()
    if derivative in COLUMN_OF:
        changed[part, COLUMN_OF[derivative]] += step
        return changed
    turn = Rotation.from_rotvec(step * np.eye(3)[derivative - Tangent.WX])
    turned = Rotation.from_quat(rows[part, ROTATION], scalar_first=True) * turn
    changed[part, ROTATION] = turned.as_quat(scalar_first=True)
    return changed


@pytest.mark.parametrize("name", SOLIDS)
def test_a_disturbed_solid_is_found_again(name: str) -> None:
    true, target = SOLIDS[name], exact_target(SOLIDS[name][None])
    start = disturbed(true)[None]
    assert kernel.loss(start, target, 100.0) > 1e-3
    found, loss, iterations = kernel.levenberg_marquardt(start, target, STAGES, LIMITS, threads=1)
    assert loss < 1e-9
    assert loss == pytest.approx(kernel.loss(found, target, 100.0), rel=1e-3, abs=1e-12)
    assert 0 < iterations <= sum(count for _, count in STAGES)
    np.testing.assert_allclose(found[0, TRANSLATION], true[TRANSLATION], atol=1e-3)
    np.testing.assert_allclose(found[0, FIELD], true[FIELD], atol=1e-3)
    if name not in ROUND:
        np.testing.assert_allclose(found[0, ROTATION], true[ROTATION], atol=1e-3)
    everywhere = points_in_box(2000, seed=9)
    np.testing.assert_allclose(
        kernel.evaluate(found, everywhere), kernel.evaluate(true[None], everywhere), atol=1e-4
    )


def test_a_disturbed_assembly_is_found_again() -> None:
    true = np.array(
        [
            row((-0.35, 0, 0), size=(0.5, 0.8, 0.6)),
            row((0.35, 0.1, 0), TURNED, (0.4, 0.4, 1.2), roundness=1.0, blend=0.1),
        ]
    )
    target = exact_target(true, 12_000)
    start = np.array([disturbed(true[0]), disturbed(true[1])])
    found, loss, _ = kernel.levenberg_marquardt(start, target, STAGES, LIMITS, threads=1)
    assert loss < 1e-8
    np.testing.assert_allclose(found[:, TRANSLATION], true[:, TRANSLATION], atol=2e-3)
    assert found[1, Column.BLEND] == pytest.approx(0.1, abs=5e-3)


def test_a_perfect_start_stays_bit_for_bit() -> None:
    rows = random_rows(2, 3)
    found, loss, _ = kernel.levenberg_marquardt(rows, exact_target(rows), STAGES, LIMITS)
    assert (
        loss < 1e-30
    )  # where a part is too far to be felt, occupancies of less than 1e-15 are taken for none
    np.testing.assert_array_equal(found, rows)


@pytest.mark.parametrize("minus", [(), (2,), (1,)], ids=["added", "subtracted", "nested"])
@pytest.mark.parametrize("penalties", [kernel.Penalties(), BOTH], ids=["reconstruction", "penalties"])
def test_the_gradient_is_the_derivative_of_the_loss(
    penalties: kernel.Penalties, minus: tuple[int, ...]
) -> None:
    target, rows, beta = exact_target(random_rows(3, 1), 20_000), subtracting(random_rows(3, 2), *minus), 12.0
    loss, gradient, _ = kernel.normal_equations(rows, target, beta, penalties)
    assert loss == pytest.approx(kernel.loss(rows, target, beta, penalties), rel=1e-12)
    gradient = gradient.reshape(3, -1)
    assert gradient[0, BLEND] == 0  # the first part joins nothing
    found = np.zeros_like(gradient)
    for part in range(3):
        for derivative in range(STEP_WIDTH):
            ahead, behind = (moved(rows, part, derivative, step) for step in (5e-4, -5e-4))
            rise = kernel.loss(ahead, target, beta, penalties) - kernel.loss(behind, target, beta, penalties)
            found[part, derivative] = rise / 1e-3
    # Points that cross a kink within the step leave an error that shrinks with it.
    np.testing.assert_allclose(found, gradient, atol=5e-3 * np.abs(gradient).max())


def test_the_matrix_is_the_curvature_of_the_loss_where_it_fits() -> None:
    """At zero residual the Gauss-Newton matrix is the Hessian: loss(x + v) = v^T J^T J v / 2."""
    rows, beta = random_rows(2, 5), 10.0
    target = exact_target(rows)
    loss, gradient, matrix = kernel.normal_equations(rows, target, beta)
    assert loss < 1e-30
    assert np.abs(gradient).max() == 0
    generator = np.random.default_rng(0)
    for _ in range(5):
        v = np.zeros((2, STEP_WIDTH))
        v[:, list(COLUMN_OF)] = generator.normal(size=(2, len(COLUMN_OF))) * 1e-3
        near = rows.copy()
        for derivative, column in COLUMN_OF.items():
            near[:, column] += v[:, derivative].astype(np.float32)
        expected = v.ravel() @ matrix @ v.ravel() / 2
        assert kernel.loss(near, target, beta) == pytest.approx(expected, rel=0.03)


@settings(max_examples=20)
@given(seed=st.integers(0, 1000), beta=st.floats(5, 300))
def test_the_matrix_is_symmetric_and_positive_semidefinite(seed: int, beta: float) -> None:
    target = exact_target(random_rows(3, seed), 1500, seed)
    _, _, matrix = kernel.normal_equations(random_rows(3, seed + 1), target, beta, BOTH)
    np.testing.assert_array_equal(matrix, matrix.T)
    values = np.linalg.eigvalsh(matrix)
    assert values.min() >= -1e-5 * values.max()


def test_a_subtracted_part_is_found_again() -> None:
    """A block with a bore, both disturbed."""
    true = subtracting(np.stack([row(size=(1.2, 0.9, 0.5)), row(size=(0.4, 0.4, 0.8), roundness=1.0)]), 1)
    start = true.copy()
    start[:, TRANSLATION] += 0.04
    start[:, 7:9] *= 0.9
    free = np.ones((2, STEP_WIDTH), bool)
    free[:, BLEND - 5 : BLEND] = False  # sharp and straight: a length and the dilation would share the work
    target = exact_target(true)
    found, loss, _ = kernel.levenberg_marquardt(start, target, STAGES, LIMITS, free=free, threads=1)
    assert loss < 1e-7
    np.testing.assert_allclose(found[0, SIZE], true[0, SIZE], atol=5e-3)
    np.testing.assert_allclose(found[1, 7:9], true[1, 7:9], atol=5e-3)
    np.testing.assert_array_equal(found[:, Column.SIGN], (1, -1))


def test_only_parts_that_are_added_overlap() -> None:
    """A bore through two blocks side by side: the penalty is what it is without the bore."""
    blocks = np.stack([row((-0.3, 0, 0), size=(0.6, 0.6, 0.6)), row((0.3, 0, 0), size=(0.6, 0.6, 0.6))])
    bore = row(size=(0.2, 0.2, 2.0), roundness=1.0)
    rows = subtracting(np.stack([*blocks, bore]), 2)
    target, quality = exact_target(rows), kernel.Penalties(overlap=1.0)
    without = exact_target(blocks)
    penalty = kernel.loss(rows, target, 40.0, quality) - kernel.loss(rows, target, 40.0)
    assert penalty == pytest.approx(kernel.loss(blocks, without, 40.0, quality), rel=1e-6)


def test_parts_in_the_background_count_as_if_they_were_there() -> None:
    rows, target = random_rows(3, 4), exact_target(random_rows(2, 5))
    behind = kernel.Target(
        target.points, target.distance, target.weight, kernel.evaluate(rows[:2], target.points)
    )
    assert kernel.loss(rows[2:], behind, 30.0) == kernel.loss(rows, target, 30.0)
    _, alone, _ = kernel.normal_equations(rows[2:], behind, 30.0)
    _, together, _ = kernel.normal_equations(rows, target, 30.0)
    np.testing.assert_allclose(alone, together[30:], rtol=1e-3, atol=1e-6)


def test_weight_zero_is_not_there() -> None:
    rows, target = random_rows(2, 6), exact_target(random_rows(2, 7), 2048)
    weight = np.where(np.arange(2048) < 1024, target.weight, 0).astype(np.float32)
    half = kernel.Target(target.points[:1024], target.distance[:1024], target.weight[:1024])
    masked = kernel.Target(target.points, target.distance, weight)
    assert kernel.loss(rows, masked, 30.0, BOTH) == pytest.approx(
        kernel.loss(rows, half, 30.0, BOTH), rel=1e-9
    )


@settings(max_examples=25)
@given(seed=st.integers(0, 1000), density=st.floats(0, 1))
def test_locked_parameters_stay_bit_for_bit(seed: int, density: float) -> None:
    generator = np.random.default_rng(seed)
    rows, target = random_rows(3, seed), exact_target(random_rows(2, seed + 1), 1500)
    free = generator.random((3, STEP_WIDTH)) < density
    free[:, ROTATION_STEP] = free[:, [Tangent.WX]]  # a quaternion moves as a whole
    free[0] = False  # and a whole part stays
    free[:, BULGE] |= (
        free[:, SX] | free[:, SZ]
    )  # an arc must not fold through its centre: it follows the size
    found, _, _ = kernel.levenberg_marquardt(rows, target, STAGES, LIMITS, free=free, threads=1)
    np.testing.assert_array_equal(found[0], rows[0])
    for derivative, column in COLUMN_OF.items():
        locked = ~free[:, derivative]
        np.testing.assert_array_equal(found[locked, column], rows[locked, column])
    locked = ~free[:, Tangent.WX]
    np.testing.assert_array_equal(found[locked, ROTATION], rows[locked, ROTATION])


def test_a_locked_bulge_stays_where_the_size_shrinks() -> None:
    bent = row(size=(0.8, 0.4, 0.7), bulge=0.6)[None]
    free = np.zeros((1, STEP_WIDTH), bool)
    free[0, SZ] = True
    target = exact_target(row(size=(0.8, 0.4, 0.3))[None])
    found, _, _ = kernel.levenberg_marquardt(bent, target, STAGES, LIMITS, free=free)
    assert found[0, Column.SZ] < 0.7
    assert found[0, COLUMN_OF[BULGE]] == bent[0, COLUMN_OF[BULGE]]


@settings(max_examples=25)
@given(seed=st.integers(0, 1000))
def test_bounds_are_kept_and_the_loss_never_rises(seed: int) -> None:
    rows, target = random_rows(3, seed), exact_target(random_rows(1, seed + 7), 1500)
    found, loss, _ = kernel.levenberg_marquardt(rows, target, STAGES, LIMITS, penalties=BOTH, threads=1)
    assert np.isfinite(found).all()
    lower, upper, _ = LIMITS.array()
    assert (found[:, SIZES] >= lower[6:]).all()
    assert (found[:, SIZES] <= upper[6:]).all()
    np.testing.assert_allclose(np.linalg.norm(found[:, ROTATION], axis=1), 1, atol=1e-5)
    _, one_stage, _ = kernel.levenberg_marquardt(rows, target, STAGES[-1:], LIMITS, penalties=BOTH, threads=1)
    before = kernel.loss(rows, target, STAGES[-1][0], BOTH)
    assert one_stage <= before
    assert loss <= before or loss < 0.1


def test_tied_parts_keep_a_square_section() -> None:
    target = exact_target(row(size=(0.9, 0.5, 0.8), roundness=0.4)[None])
    start = np.array([row(size=(0.6, 0.6, 0.6), roundness=0.4)])
    tied, loss, _ = kernel.levenberg_marquardt(start, target, STAGES, LIMITS, tied=np.array([True]))
    assert tied[0, 7] == tied[0, 8]
    assert 0.55 < tied[0, 7] < 0.85
    _, free_loss, _ = kernel.levenberg_marquardt(start, target, STAGES, LIMITS)
    assert free_loss < 1e-6 < loss < kernel.loss(start, target, STAGES[-1][0])


def test_threads_do_not_change_a_bit() -> None:
    rows, target = random_rows(4, 0), exact_target(random_rows(4, 1), 8000)
    inside, weight = target.distance < 0, target.weight
    one: list | None = None
    for threads in (1, 2, 3):
        loss, gradient, matrix = kernel.normal_equations(rows, target, 40.0, BOTH, threads)
        results = [
            np.array(loss),
            gradient,
            matrix,
            *map(
                np.asarray,
                kernel.levenberg_marquardt(rows, target, STAGES[:2], LIMITS, penalties=BOTH, threads=threads),
            ),
            *kernel.fit_starts(rows, np.array([[0, 8000]] * 4), target, STAGES[:2], LIMITS, threads=threads),
            kernel.removal_counts(rows, target.points, inside, weight, threads),
        ]
        one = one or results
        for expected, found in zip(one, results, strict=True):
            np.testing.assert_array_equal(found, expected)


def test_starts_are_fitted_each_to_its_own_samples() -> None:
    starts, target = random_rows(3, 8), exact_target(random_rows(2, 9), 3000)
    ranges = np.array([[0, 1000], [1000, 3000], [500, 700]])
    found, losses = kernel.fit_starts(starts, ranges, target, STAGES, LIMITS)
    for i, (first, last) in enumerate(ranges):
        own = kernel.Target(*(a[first:last] for a in (target.points, target.distance, target.weight)))
        alone, loss, _ = kernel.levenberg_marquardt(starts[i : i + 1], own, STAGES, LIMITS)
        np.testing.assert_array_equal(found[i], alone[0])
        assert losses[i] == loss


@settings(max_examples=20)
@given(seed=st.integers(0, 1000), parts=st.integers(1, 6), minus=st.sets(st.integers(0, 5)))
def test_removal_counts_equal_counting_again(seed: int, parts: int, minus: set[int]) -> None:
    generator = np.random.default_rng(seed)
    rows = subtracting(random_rows(parts, seed), *(i for i in minus if i < parts))
    points = points_in_box(1000, seed)
    inside = generator.random(1000) < 0.4
    weight = generator.integers(1, 9, 1000) / 8  # sums of eighths are exact in any order
    expected = []
    for assembly in [*(np.delete(rows, i, axis=0) for i in range(parts)), rows]:
        occupied = kernel.evaluate(assembly, points) < 0 if len(assembly) else np.zeros(1000, bool)
        expected.append([weight[occupied & inside].sum(), weight[occupied | inside].sum()])
    np.testing.assert_array_equal(kernel.removal_counts(rows, points, inside, weight), expected)


def test_wrong_shapes_are_refused() -> None:
    points, values = np.zeros((4, 3), np.float32), np.zeros(4, np.float32)
    with pytest.raises(ValueError, match=r"weight must be \(4,\), got \(3,\)"):
        kernel.Target(points, values, values[:3])
    with pytest.raises(ValueError, match=r"background must be \(4,\), got \(2,\)"):
        kernel.Target(points, values, values, values[:2])
    with pytest.raises(ValueError, match="parameter rows must be"):
        kernel.loss(np.zeros((0, UNSIGNED)), kernel.Target(points, values, values), 10.0)
    with pytest.raises(ValueError, match=r"the field must be \(X, Y, Z\)"):
        kernel.decompose(np.zeros((4, 4)), 0.1, 3, 0.02, 0.0, 1)
