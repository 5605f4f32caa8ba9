"""Poses of parts: where a part is, which way it is turned, and how large it is along its own axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Poses:
    """A pose a row (PartSDF, section 3.1): local point = R^T (x - translation) / scale.

    translation (P, 3); rotation (P, 4) unit quaternions (w, x, y, z), local to world; scale (P, 3)
    half-lengths along the local axes. Unit frame.
    """

    translation: NDArray[np.float32]
    rotation: NDArray[np.float32]
    scale: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.translation)

    @classmethod
    def identity(cls, count: int) -> Poses:
        """`count` poses that change nothing."""
        zero, one = np.zeros((count, 3), np.float32), np.ones((count, 3), np.float32)
        return cls(zero, np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)), one)

    @classmethod
    def joined(cls, poses: Sequence[Poses]) -> Poses:
        """All rows, one after another."""
        return cls(
            np.concatenate([p.translation for p in poses]),
            np.concatenate([p.rotation for p in poses]),
            np.concatenate([p.scale for p in poses]),
        )


def mean_rotation(quaternions: NDArray[np.floating]) -> NDArray[np.float64]:
    """The unit quaternion (4,), w >= 0, whose squared chordal distances to (N, 4) are least.

    q and -q count as the same rotation: the largest eigenvector of sum q q^T (Markley et al. 2007).
    """
    q = np.asarray(quaternions, dtype=np.float64)
    mean = np.linalg.eigh(q.T @ q)[1][:, -1]
    return mean if mean[0] >= 0 else -mean


def mean_pose(poses: Poses) -> Poses:
    """One row: mean place, mean rotation, geometric mean of the half-lengths."""
    return Poses(
        poses.translation.mean(axis=0, dtype=np.float64, keepdims=True).astype(np.float32),
        mean_rotation(poses.rotation)[None].astype(np.float32),
        np.exp(np.log(poses.scale.astype(np.float64)).mean(axis=0, keepdims=True)).astype(np.float32),
    )


def average_poses(present: NDArray[np.bool_], poses: list[Poses]) -> Poses:
    """The average pose of each part (P rows) over the shapes that have it.

    present (S, P): which parts the S shapes have, each at least once; poses: one of P rows a shape.
    """
    stacked = [np.stack([getattr(p, name) for p in poses]) for name in ("translation", "rotation", "scale")]
    means = [
        mean_pose(Poses(*(values[present[:, part], part] for values in stacked)))
        for part in range(present.shape[1])
    ]
    return Poses.joined(means)
