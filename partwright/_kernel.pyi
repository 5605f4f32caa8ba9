"""Signatures of the compiled kernel; a test compares both; partwright.fields.kernel documents."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

class Column(IntEnum):
    TX = 0
    TY = 1
    TZ = 2
    QW = 3
    QX = 4
    QY = 5
    QZ = 6
    SX = 7
    SY = 8
    SZ = 9
    ROUNDNESS = 10
    DILATION = 11
    TAPER = 12
    BULGE = 13
    ONION = 14
    BLEND = 15
    SIGN = 16

class Tangent(IntEnum):
    TX = 0
    TY = 1
    TZ = 2
    WX = 3
    WY = 4
    WZ = 5
    SX = 6
    SY = 7
    SZ = 8
    ROUNDNESS = 9
    DILATION = 10
    TAPER = 11
    BULGE = 12
    ONION = 13
    BLEND = 14

_F = NDArray[np.float32]
_D = NDArray[np.float64]
_B = NDArray[np.uint8]
_I = NDArray[np.int64]

def evaluate(rows: _F, points: _F, threads: int) -> _F: ...
def evaluate_parts(rows: _F, points: _F, threads: int) -> _F: ...
def covered(rows: _F, points: _F, threads: int) -> NDArray[np.bool_]: ...
def occupancy_sums(occupied: _B, inside: _B, weight: _F, split: int, threads: int) -> _D: ...
def gradients(rows: _F, points: _F, upstream: _F, threads: int) -> _D: ...
def normal_equations(
    rows: _F, live: _B, points: _F, distance: _F, weight: _F, background: _F,
    beta: float, overlap: float, blending: float, threads: int,
) -> tuple[float, _D, _D]: ...  # fmt: skip
def loss(
    rows: _F, points: _F, distance: _F, weight: _F, background: _F,
    beta: float, overlap: float, blending: float, threads: int,
) -> float: ...  # fmt: skip
def levenberg_marquardt(
    rows: _F, free: _B, tied: _B, points: _F, distance: _F, weight: _F, background: _F,
    stages: _F, overlap: float, blending: float, limits: _F, threads: int,
) -> tuple[_F, float, int]: ...  # fmt: skip
def fit_starts(
    starts: _F, first: _I, last: _I, free: _B, tied: _B, points: _F, distance: _F, weight: _F, background: _F,
    stages: _F, overlap: float, blending: float, limits: _F, threads: int,
) -> tuple[_F, _D]: ...  # fmt: skip
def removal_counts(rows: _F, points: _F, inside: _B, weight: _F, threads: int) -> _D: ...
def decompose(
    field: _F, spacing: float, regions: int, fraction: float, least_depth: float, least_voxels: float
) -> tuple[NDArray[np.int32], list[float]]: ...
def profile_distances(corners: _D, starts: _I, counts: _B, points: _D, threads: int) -> _D: ...
def profile_gradients(
    corners: _D, starts: _I, counts: _B, points: _D, upstream: _D, threads: int
) -> tuple[_D, _D]: ...
def convex_hull(points: _D, plain: bool) -> tuple[_I, float]: ...
def split_hull_volumes(vertices: _D, faces: _I, edges: _I, planes: _D, slack: float) -> _D: ...
def volumes_beyond(vertices: _D, faces: _I, areas: _D, normal: _D, offsets: _D) -> _D: ...
def read_grid(values: _F, origin: _D, spacing: float, points: _D) -> _D: ...
def circle_through(points: _D) -> tuple[float, float, float, float]: ...
def open_line(points: _D, tolerance: float) -> _I: ...
def connected(groups: _I, nodes: int) -> _I: ...

class TriangleTree:
    def __init__(self, vertices: _D, faces: _I) -> None: ...
    def squared_distances(self, points: _D, threads: int) -> _D: ...
    def windings(self, points: _D, threads: int) -> NDArray[np.int32]: ...

def networks_distances(
    local: _F, weights: list[_F], shifts: list[_F], scale: _F, room: _F, unit: _F, reach: float, octaves: int,
    threads: int,
) -> _F: ...  # fmt: skip
def networks_gradients(
    local: _F, weights: list[_F], shifts: list[_F], scale: _F, room: _F, unit: _F, reach: float, octaves: int,
    upstream: _F, threads: int, learning: bool,
) -> tuple[_F, _F, list[_F], list[_F]]: ...  # fmt: skip
