"""Voxel and distance grids to surfaces.

A binary grid knows its surface to half a voxel. Its stairs are smoothed by a filter that keeps curvature (a
Gaussian applied to what a first one left over, "twicing", Tukey 1977), and then every voxel's centre is put
back on its own side (as in Lempitsky 2010, "Surface extraction from binary volumes with higher-order
smoothness"), so that nothing thin is lost and occupancy at the centres is exactly what was given.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright.errors import GridError, NotFiniteError
from partwright.shapes.contour import contour, crossed_cells
from partwright.shapes.source import Piece, Source

MOST_CELLS = 1 << 27
_MOST_CROSSED = 1 << 21  # cells that the surface passes; each takes a kilobyte while it is repaired
_PAD = 4  # voxels around what is inside
_WIDTH = 1.0  # voxels: the Gaussian's
_LEAST = 0.02  # how far a voxel's centre stays on its own side, where the step is from -1 to 1
_THIN = 0.5  # the same for a wall of one voxel, which thereby comes out one voxel thick


def source_of_grid(
    name: str,
    grid: NDArray[Any],
    kind: str | None = None,
    origin: ArrayLike = (0.0, 0.0, 0.0),
    spacing: ArrayLike = 1.0,
) -> Source:
    """Surface of a grid (nx, ny, nz) whose value [i, j, k] belongs to origin + spacing * (i, j, k).

    kind "occupancy": true, nonzero or above 0.5 is inside. kind "sdf": signed distance, negative inside (or
    outside, where the border says so). None: by the values; floats with a negative among them are distances.
    Raises GridError for a grid of another form or without a surface, NotFiniteError for NaN or infinity.
    """
    place, step = _placement(name, origin, spacing)
    _check_form(name, grid)
    kind = kind or ("sdf" if grid.dtype.kind in "if" and grid.min() < 0 else "occupancy")
    notes: list[str] = []
    field = _distances(name, grid, notes) if kind == "sdf" else _filled(name, grid)
    inside = field < 0
    if not inside.any() or inside.all():
        raise GridError(
            f"{name}: {'every' if inside.any() else 'no'} voxel of the {_size(grid)} {kind} grid is inside; "
            "a shape with empty space around it was expected"
        )
    crossed = int(crossed_cells(inside).sum())
    if crossed > _MOST_CROSSED:
        raise GridError(
            f"{name}: the surface passes {crossed:,} cells of the {_size(grid)} grid, as noise does; at most "
            f"{_MOST_CROSSED:,} are drawn. Smooth the grid, or make it coarser"
        )
    if _border(inside).any():
        notes.append("the shape reaches the border of its grid and was closed there")
    field, first = _cropped(field, inside)
    binary = kind == "occupancy" and bool((np.abs(field) == 0.5).all())
    if binary:
        field = _smooth(field < 0)
    vertices, faces = contour(field, place + step * first, step)
    made = "smoothed" if binary else "drawn where it passes its level"
    notes.insert(0, f"the surface comes from a grid of {_size(grid)} voxels ({kind}), {made}")
    return Source(name, (Piece(name, vertices, faces),), repairs=tuple(notes))


def _size(grid: NDArray[Any]) -> str:
    return " x ".join(str(n) for n in grid.shape)


def _placement(
    name: str, origin: ArrayLike, spacing: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    try:
        place = np.broadcast_to(np.asarray(origin, dtype=np.float64), 3)
        step = np.broadcast_to(np.asarray(spacing, dtype=np.float64), 3)
    except (ValueError, TypeError) as error:
        raise GridError(f"{name}: origin and spacing must be one or three numbers: {error}") from error
    if not (np.isfinite(place).all() and np.isfinite(step).all() and (step > 0).all()):
        raise GridError(f"{name}: origin {place} and spacing {step} must be finite, and spacing above 0")
    return place, step


def _check_form(name: str, grid: NDArray[Any]) -> None:
    if grid.ndim != 3 or min(grid.shape) < 2:
        raise GridError(f"{name}: an array of shape {grid.shape} was given; expected a grid (nx, ny, nz)")
    if grid.size > MOST_CELLS:
        raise GridError(f"{name}: a grid of {_size(grid)} voxels is too large; at most {MOST_CELLS} are read")
    if grid.dtype.kind not in "biuf":
        raise GridError(f"{name}: a grid of {grid.dtype} was given; expected booleans or numbers")
    if grid.dtype.kind == "f" and not np.isfinite(grid).all():
        raise NotFiniteError(f"{name}: the grid holds NaN or infinity; all values must be finite")


def _filled(name: str, grid: NDArray[Any]) -> NDArray[np.float32]:
    """Occupancy as 0.5 - occupancy: whole numbers are inside unless 0, floats inside above 0.5."""
    if grid.dtype.kind != "f":
        return np.where(grid, np.float32(-0.5), np.float32(0.5))
    if grid.min() < 0 or grid.max() > 1:
        raise GridError(
            f"{name}: an occupancy grid with values from {grid.min():g} to {grid.max():g} was given; "
            "expected 0 (empty) to 1 (full), or distances of both signs"
        )
    return np.float32(0.5) - grid.astype(np.float32)


def _distances(name: str, grid: NDArray[Any], notes: list[str]) -> NDArray[np.float32]:
    if grid.dtype.kind not in "if":
        raise GridError(f"{name}: signed distances of type {grid.dtype} were given; expected signed numbers")
    field = grid.astype(np.float32)
    if np.mean(_border(field < 0)) > 0.5:
        notes.append("distances are positive inside here; their sign was turned")
        return -field
    return field


def _border(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    sides = [np.take(inside, end, axis=axis).ravel() for axis in range(3) for end in (0, -1)]
    return np.concatenate(sides)


def _cropped(
    field: NDArray[np.float32], inside: NDArray[np.bool_]
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """What is inside with empty voxels all around it, and the index of its first voxel in the grid.

    Voxels beyond the border are as far outside as those at the border are inside: the wall runs between.
    """
    ranges = [np.flatnonzero(inside.any(axis=tuple(k for k in range(3) if k != axis))) for axis in range(3)]
    first = np.array([r[0] for r in ranges]) - _PAD
    stop = np.array([r[-1] for r in ranges]) + 1 + _PAD
    kept = tuple(slice(max(a, 0), b) for a, b in zip(first, stop, strict=True))
    missing = [
        (max(-a, 0), max(b - n, 0))
        for a, b, n in zip(first.tolist(), stop.tolist(), field.shape, strict=True)
    ]
    padded = np.pad(field[kept], missing, mode="edge")
    beyond = np.pad(np.zeros(field[kept].shape, dtype=bool), missing, constant_values=True)
    return np.where(beyond, np.abs(padded), padded), first


def _smooth(inside: NDArray[np.bool_]) -> NDArray[np.float32]:
    """A field about -1 inside and 1 outside whose zero level is the smoothed surface of the voxels."""
    from scipy.ndimage import gaussian_filter

    side = np.where(inside, np.float32(-1), np.float32(1))
    rest = side - gaussian_filter(side, _WIDTH, mode="nearest")
    rest -= gaussian_filter(rest, _WIDTH, mode="nearest")
    least = np.where(_one_voxel_thin(inside), np.float32(_THIN), np.float32(_LEAST))
    return side * np.maximum(side * (side - rest), least)


def _one_voxel_thin(inside: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels whose two neighbours along some axis are both of the other kind."""
    thin = np.zeros_like(inside)
    for axis in range(3):
        middle, low, high = (
            tuple(s if k == axis else slice(None) for k in range(3))
            for s in (slice(1, -1), slice(None, -2), slice(2, None))
        )
        thin[middle] |= (inside[low] != inside[middle]) & (inside[high] != inside[middle])
    return thin
