"""Whatever comes in, by what it is: a mesh file, points, a grid, or the same in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.errors import GridError, NeedsSurfaceError, UnsupportedFormatError
from partwright.shapes.array_files import read_binvox, read_npy, read_npz, read_xyz
from partwright.shapes.collada import read_collada
from partwright.shapes.loading import READ_BY_TRIMESH, read_mesh, source_of_mesh
from partwright.shapes.point_cloud import source_of_points
from partwright.shapes.source import Source, unique_names
from partwright.shapes.step_process import STEP_SUFFIXES, read_step
from partwright.shapes.threemf import read_threemf
from partwright.shapes.voxels import source_of_grid

if TYPE_CHECKING:
    import trimesh

MESH_SUFFIXES = (*READ_BY_TRIMESH, ".3mf", ".dae")
PICTURE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".gif", ".tif", ".tiff")
_UNIT_NORMAL = (0.9, 1.1)  # lengths between which the columns behind the coordinates are normals, not colours


def read_source(path: Path) -> Source:
    """Read a file by its suffix, one of `SUFFIXES`.

    Raises UnsupportedFormatError, UnreadableFileError, EmptyShapeError, NeedsSurfaceError, NotFiniteError,
    FlatShapeError, GridError, or MissingDependencyError where a format takes a package that is not installed.
    """
    suffix = path.suffix.lower()
    if suffix in PICTURE_SUFFIXES:
        raise UnsupportedFormatError(
            f"{path}: is a picture; a generator must make a mesh of it first (partwright fit "
            "--via GENERATOR), or a model of its family find parts in it ("
            "partwright parts reconstruct MODEL PICTURE)"
        )
    if suffix not in _READERS:
        raise UnsupportedFormatError(
            f"{path}: '{suffix}' is not a format that is read; expected one of {', '.join(SUFFIXES)}. "
            "Export the shape to one of these (STL or OBJ work for CAD models)"
        )
    return _READERS[suffix](path)


def source_of(thing: trimesh.Trimesh | tuple[Any, Any] | NDArray[Any]) -> Source:
    """A Trimesh, (vertices (V, 3), faces (F, 3)), points (N, 3) or (N, 6), or a grid (nx, ny, nz).

    Raises what `read_source` raises for files of the same content.
    """
    return _source_of_array("array", thing) if isinstance(thing, np.ndarray) else source_of_mesh(thing)


def _read_collada(path: Path) -> Source:
    source = read_collada(path)
    return replace(source, pieces=tuple(unique_names(iter(source.pieces))))


def _read_npy(path: Path) -> Source:
    return _source_of_array(path.stem, read_npy(path))


def _read_npz(path: Path) -> Source:
    """`points` with or without `normals`; `sdf` or `occupancy` with or without `origin` and `spacing`."""
    arrays = read_npz(path)
    if "points" in arrays:
        points, normals = _three_columns(path.stem, arrays["points"]), arrays.get("normals")
        if normals is not None and normals.shape != points.shape:
            raise NeedsSurfaceError(
                f"{path}: normals {normals.shape} and points {points.shape} must have the same shape"
            )
        return source_of_points(path.stem, points, normals)
    placement = {key: arrays[key] for key in ("origin", "spacing") if key in arrays}
    for kind in ("sdf", "occupancy"):
        if kind in arrays:
            return source_of_grid(path.stem, arrays[kind], kind, **placement)
    if len(arrays) == 1:
        return _source_of_array(path.stem, next(iter(arrays.values())))
    raise GridError(
        f"{path}: holds {', '.join(sorted(arrays)) or 'no arrays'}; expected points (and normals), sdf or "
        "occupancy (and origin and spacing), or a single array"
    )


def _read_binvox(path: Path) -> Source:
    filled, origin, size = read_binvox(path)
    return source_of_grid(path.stem, filled, "occupancy", origin, size)


def _read_xyz(path: Path) -> Source:
    return _source_of_array(path.stem, read_xyz(path))


def _source_of_array(name: str, array: NDArray[Any]) -> Source:
    if array.ndim == 3:
        return source_of_grid(name, array)
    if array.ndim != 2 or array.shape[1] < 3 or array.dtype.kind not in "biuf":
        raise GridError(
            f"{name}: an array of {array.dtype} and shape {array.shape} was given; expected points (N, 3), "
            "points with normals (N, 6), or a grid (nx, ny, nz)"
        )
    normals = _normals_among(array[:, 3:])
    source = source_of_points(name, array[:, :3], normals)
    if array.shape[1] > 3 and normals is None:
        note = "the columns behind the coordinates are no unit normals and were not used"
        return replace(source, repairs=(*source.repairs, note))
    return source


def _normals_among(columns: NDArray[Any]) -> NDArray[Any] | None:
    """The three columns (N, 3) that are unit normals: the first or the last; colours are none."""
    for candidate in (columns[:, :3], columns[:, -3:]):
        if candidate.shape[1] == 3:
            length = np.linalg.norm(candidate.astype(np.float64), axis=1)
            if _UNIT_NORMAL[0] < np.quantile(length, 0.1) and np.quantile(length, 0.9) < _UNIT_NORMAL[1]:
                return candidate
    return None


def _three_columns(name: str, points: NDArray[Any]) -> NDArray[Any]:
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "biuf":
        raise NeedsSurfaceError(f"{name}: points of shape {points.shape} were given; expected (N, 3) numbers")
    return points


_READERS: dict[str, Callable[[Path], Source]] = {
    **dict.fromkeys(READ_BY_TRIMESH, read_mesh),
    ".3mf": read_threemf,
    ".dae": _read_collada,
    **dict.fromkeys(STEP_SUFFIXES, read_step),
    ".xyz": _read_xyz,
    ".npy": _read_npy,
    ".npz": _read_npz,
    ".binvox": _read_binvox,
}
SUFFIXES = tuple(_READERS)
