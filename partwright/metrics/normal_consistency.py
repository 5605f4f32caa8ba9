"""How well the directions of two surfaces agree."""

from __future__ import annotations

import numpy as np


def normal_consistency(
    first: np.ndarray, first_normals: np.ndarray, second: np.ndarray, second_normals: np.ndarray
) -> float:
    """`normal_consistency`: mean |cosine| between a point's normal and that of the nearest point of the other
    surface, both ways averaged (CAPRI-Net, section 4.2). 1 is best; unrelated surfaces give about 1/2.

    Samples of a surface with edges do not reach 1, since the nearest point may lie across an edge.

    first, second: (N, 3) and (M, 3) points; normals: unit vectors at them.
    """
    from scipy.spatial import cKDTree

    there = cKDTree(second).query(first)[1]
    back = cKDTree(first).query(second)[1]
    one = np.abs((first_normals * second_normals[there]).sum(axis=1)).mean()
    other = np.abs((second_normals * first_normals[back]).sum(axis=1)).mean()
    return float(one + other) / 2
