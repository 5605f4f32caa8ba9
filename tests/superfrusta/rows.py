"""Parameter rows whose surface is known, and exact targets for a fit to find them again."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from partwright.fields import kernel
from partwright.fields.columns import PROPORTIONS, ROTATION, SIZE, TRANSLATION, UNSIGNED, Column

TURNED = (1.0, 0.2, 0.1, -0.1)


def row(
    centre=(0.0, 0.0, 0.0),
    rotation=(1.0, 0.0, 0.0, 0.0),
    size=(1.0, 1.0, 1.0),
    roundness=0.0,
    dilation=0.0,
    taper=1.0,
    bulge=0.0,
    onion=0.0,
    blend=0.02,
) -> np.ndarray:
    """One row (17,) with a unit quaternion, added."""
    unit = np.array(rotation) / np.linalg.norm(rotation)
    return np.array([*centre, *unit, *size, roundness, dilation, taper, bulge, onion, blend, 1.0], np.float32)


def subtracting(rows: np.ndarray, *which: int) -> np.ndarray:
    """The rows with their signs (M, 17), those of these indices subtracted."""
    signs = np.where(np.isin(np.arange(len(rows)), which), -1.0, 1.0)
    return np.hstack([rows[:, :UNSIGNED], signs[:, None]]).astype(np.float32)


def ball(radius: float, centre=(0.0, 0.0, 0.0)) -> np.ndarray:
    """A ball, made the way the fit could make it: almost no core, all dilation."""
    return row(centre, size=(0.004, 0.004, 0.004), roundness=1.0, dilation=radius - 0.002, blend=1e-3)


def box(size: tuple[float, float, float], centre=(0.0, 0.0, 0.0), blend: float = 1e-3) -> np.ndarray:
    return row(centre, size=size, blend=blend)


def points_in_box(count: int, seed: int = 0, half: float = 1.0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-half, half, (count, 3)).astype(np.float32)


def exact_target(rows: np.ndarray, count: int = 6000, seed: int = 0) -> kernel.Target:
    """Signed distances of an assembly at uniform points, as a fit's target with weights that sum to 1."""
    points = points_in_box(count, seed)
    return kernel.Target(
        points, kernel.evaluate(rows, points, threads=1), np.full(count, 1 / count, np.float32)
    )


def disturbed(one: np.ndarray) -> np.ndarray:
    """The row moved, turned, resized and reshaped, all within the ranges."""
    moved = one.copy()
    moved[TRANSLATION] += (0.04, -0.03, 0.03)
    turned = Rotation.from_quat(one[ROTATION], scalar_first=True) * Rotation.from_rotvec((0.1, -0.08, 0.1))
    moved[ROTATION] = turned.as_quat(scalar_first=True)
    moved[SIZE] *= (1.1, 0.92, 0.9)
    moved[PROPORTIONS] += (
        -0.2 if one[Column.ROUNDNESS] > 0.5 else 0.2,
        0.02,
        0.15,
        0.1,
        -0.1 if one[Column.ONION] > 0.1 else 0.0,
    )
    return moved


def random_rows(parts: int, seed: int) -> np.ndarray:
    """Rows (M, 17) well inside the ranges, so that everything has a derivative."""
    generator = np.random.default_rng(seed)
    made = []
    for _ in range(parts):
        size = generator.uniform(0.3, 0.9, 3)
        made.append(
            row(
                generator.uniform(-0.4, 0.4, 3),
                generator.normal(size=4),
                size,
                *generator.uniform((0.2, 0.01, 0.6, 0.1, 0.1, 0.02), (0.8, 0.05, 1.4, 0.3, 0.5, 0.1)),
            )
        )
    return np.array(made, np.float32)
