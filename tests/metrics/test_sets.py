"""Sets of shapes: distances that are known, and sets that are alike, apart, and all the same."""

from __future__ import annotations

import numpy as np
import pytest

from partwright.errors import SettingError
from partwright.metrics.sets import chamfer_matrix, set_scores


def spheres(radii: np.ndarray, seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    directions = rng.standard_normal((len(radii), 150, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    return list(radii[:, None, None] * directions)


def test_chamfer_of_a_moved_point() -> None:
    a, b = np.zeros((1, 3)), np.array([[3.0, 4.0, 0.0]])
    np.testing.assert_allclose(chamfer_matrix([a, b], [a]), [[0.0], [50.0]])
    np.testing.assert_allclose(chamfer_matrix([a, b]), [[0.0, 50.0], [50.0, 0.0]])


def test_sets_that_are_alike_apart_and_all_the_same() -> None:
    rng = np.random.default_rng(0)
    real = spheres(rng.uniform(0.5, 1.0, 40), 1)
    alike = set_scores(spheres(rng.uniform(0.5, 1.0, 40), 2), real)
    assert alike.nearest_accuracy == pytest.approx(0.5, abs=0.17)
    assert alike.coverage > 0.45
    apart = set_scores(spheres(rng.uniform(1.5, 2.0, 40), 3), real)
    assert apart.nearest_accuracy == 1.0
    assert apart.mmd > 20 * alike.mmd
    same = set_scores(spheres(np.full(40, 0.75), 4), real)
    assert same.coverage < 0.5 * alike.coverage
    assert set_scores(real, real).mmd == 0.0
    assert set_scores(real[:20], real, chamfer_matrix(real)) == set_scores(real[:20], real)
    with pytest.raises(SettingError, match="1 made and 40 real shapes"):
        set_scores(real[:1], real)
