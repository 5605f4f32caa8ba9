"""Face labels out: a segmented mesh with its labels beside it (`partwright segment`)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.assembly.palette import palette
from partwright.atomic_io import write_bytes
from partwright.errors import UnsupportedFormatError
from partwright.export.glb import coloured, to_gltf
from partwright.shapes.labels import labels_path

if TYPE_CHECKING:
    from partwright.assembly import Assembly

SUFFIXES = (".ply", ".glb")
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("colour", "u1", 3), ("label", "<i4")])


def check_suffix(path: str | Path) -> None:
    """Raise UnsupportedFormatError unless segments can be written to a file of that name."""
    if Path(path).suffix.lower() not in SUFFIXES:
        raise UnsupportedFormatError(
            f"cannot write segments to {Path(path).name}: use one of {', '.join(SUFFIXES)}"
        )


def write_segments(
    path: str | Path,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    labels: NDArray[Any],
    names: Sequence[str],
    assembly: Assembly,
) -> None:
    """Write faces in one colour a label, and `labels_path` with `labels` and `names`.

    A .ply keeps order and number of the faces, with the label as a property of each; a .glb has a named node
    label, in metres and Y up as far as the assembly's unit and up axis are known.

    Raises:
        UnsupportedFormatError: the suffix is another.
        OutputError: it cannot be written.
    """
    check_suffix(path)
    is_ply = Path(path).suffix.lower() == ".ply"
    write_bytes(
        path,
        _ply(vertices, faces, labels, names, assembly.unit)
        if is_ply
        else _glb(vertices, faces, labels, names, assembly),
    )
    about = {"faces": len(labels), "names": list(names), "labels": labels.tolist()}
    write_bytes(labels_path(path), (json.dumps(about) + "\n").encode())


def _ply(
    vertices: NDArray[Any],
    corners: NDArray[Any],
    labels: NDArray[Any],
    names: Sequence[str],
    unit: str | None,
) -> bytes:
    faces = np.empty(len(labels), dtype=_FACE)
    faces["count"], faces["corners"], faces["label"] = 3, corners, labels
    faces["colour"] = palette(len(names))[labels]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment unit {unit or 'unknown'}",
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        *(f"property uchar {colour}" for colour in ("red", "green", "blue")),
        "property int label",
        "end_header\n",
    ]
    return "\n".join(header).encode() + vertices.astype("<f8").tobytes() + faces.tobytes()


def _glb(
    vertices: NDArray[Any],
    faces: NDArray[Any],
    labels: NDArray[Any],
    names: Sequence[str],
    assembly: Assembly,
) -> bytes:
    import trimesh
    from trimesh.exchange.gltf import export_glb

    scene = trimesh.Scene(base_frame="world")
    colours = palette(len(names))
    for label in np.unique(labels):
        mesh = trimesh.Trimesh(vertices, faces[labels == label], process=False)
        mesh.remove_unreferenced_vertices()
        mesh = coloured(mesh, colours[label])
        scene.add_geometry(mesh, names[label], names[label], transform=to_gltf(assembly).matrix())
    return export_glb(scene, include_normals=False)
