"""A rod with a screw thread, as a closed body."""

from __future__ import annotations

import math

import numpy as np
from manifold3d import Manifold

from partwright.meshing.manifolds import closed

RADIUS, PITCH, LENGTH = 0.4, 0.12, 1.2
INNER = RADIUS - 0.6134 * PITCH


def threaded(
    pitch: float = PITCH, around: int = 60, along: int = 16, ends: float = 1.0, starts: int = 1
) -> Manifold:
    """A rod with the ISO profile: crests an eighth of the pitch wide, roots a quarter.

    starts: ridges that wind beside one another, each as steep as the pitch says.
    ends: of the depth, that there is at the ends, where it runs out over two turns.
    """
    rows = round(LENGTH / abs(pitch) * along)
    turns, heights = np.arange(around) / around, np.linspace(-LENGTH / 2, LENGTH / 2, rows + 1)
    phase = np.mod(starts * (heights[:, None] / pitch - turns), 1.0)
    share = np.clip((np.abs(2 * phase - 1) - 1 / 8) / (5 / 8), 0.0, 1.0)
    near = np.clip((LENGTH / 2 - np.abs(heights[:, None])) / (2 * abs(pitch)), 0.0, 1.0)
    radius = RADIUS - share * (ends + (1 - ends) * near) * (RADIUS - INNER)
    ring = 2 * math.pi * np.broadcast_to(turns, radius.shape)
    walls = np.stack([radius * np.cos(ring), radius * np.sin(ring), heights[:, None] + 0 * ring], axis=-1)
    vertices = np.concatenate([walls.reshape(-1, 3), [(0, 0, -LENGTH / 2), (0, 0, LENGTH / 2)]])
    k, j = np.divmod(np.arange(rows * around), around)
    right = (j + 1) % around
    a, b, c, d = k * around + j, k * around + right, (k + 1) * around + j, (k + 1) * around + right
    # Along the thread, as a CAD program would lay them.
    pairs = [(a, b, d), (a, d, c)] if pitch > 0 else [(a, b, c), (b, d, c)]
    rim, last = np.arange(around), rows * around
    low, high = len(vertices) - 2, len(vertices) - 1
    turned = np.roll(rim, -1)
    caps = [(turned, rim, np.full(around, low)), (last + rim, last + turned, np.full(around, high))]
    faces = np.concatenate([np.column_stack(corners) for corners in [*pairs, *caps]])
    return closed(vertices, faces)
