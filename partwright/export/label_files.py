"""Face labels out: a segmented mesh with its labels beside it (`partwright segment`)."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Similarity
from partwright.assembly.palette import palette
from partwright.atomic_io import write_bytes
from partwright.errors import UnsupportedFormatError
from partwright.export.axes import to_gltf, to_metres_z_up
from partwright.export.formats import FORMATS
from partwright.export.glb import coloured
from partwright.export.identifiers import free_name
from partwright.export.usd_prims import define_mesh, define_xform, exported, place, to_linear
from partwright.shapes import METRES, canonical_unit, canonical_up
from partwright.shapes.labels import labels_path

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly

USD = (".usda", ".usdc", ".usd")
SUFFIXES = (".ply", ".glb", *USD)
_FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("colour", "u1", 3), ("label", "<i4")])


def check_suffix(path: str | Path) -> None:
    """Raise unless segments can be written to a file of that name.

    Raises:
        UnsupportedFormatError: its suffix is none of `SUFFIXES`.
        MissingDependencyError: USD needs a package that is not installed.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in SUFFIXES:
        raise UnsupportedFormatError(
            f"cannot write segments to {Path(path).name}: use one of {', '.join(SUFFIXES)}"
        )
    if suffix in USD:
        FORMATS[suffix].check_needs()


def write_segments(
    path: str | Path,
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    labels: NDArray[Any],
    paths: Sequence[tuple[str, ...]],
    assembly: Assembly,
) -> None:
    """Write faces in one colour a label, and `labels_path` with `labels` and `names`.

    paths: what each label means, (PART,) or (COARSE, PART). A .ply keeps order and number of the faces, with
    the label as a property of each; a .glb and USD have a node a coarse label, and below it one a part, in
    metres and Y up as far as the assembly's unit and up axis are known, USD in its own.

    Raises:
        UnsupportedFormatError: the suffix is another.
        OutputError: it cannot be written.
    """
    check_suffix(path)
    names = ["/".join(each) for each in paths]
    suffix = Path(path).suffix.lower()
    if suffix == ".ply":
        data = _ply(vertices, faces, labels, names, assembly.unit)
    elif suffix == ".glb":
        data = _glb(_segments(vertices, faces, labels, paths), assembly)
    else:
        data = _usd(_segments(vertices, faces, labels, paths), assembly, suffix)
    write_bytes(path, data)
    about = {"faces": len(labels), "names": names, "labels": labels.tolist()}
    write_bytes(labels_path(path), (json.dumps(about) + "\n").encode())


@dataclass(frozen=True)
class _Segment:
    path: tuple[str, ...]
    mesh: trimesh.Trimesh
    colour: NDArray[Any]
    """(3,) uint8, sRGB."""


def _segments(
    vertices: NDArray[Any], faces: NDArray[Any], labels: NDArray[Any], paths: Sequence[tuple[str, ...]]
) -> list[_Segment]:
    """What of the labels any face has."""
    import trimesh

    colours, result = palette(len(paths)), []
    for label in np.unique(labels):
        mesh = trimesh.Trimesh(vertices, faces[labels == label], process=False)
        mesh.remove_unreferenced_vertices()
        result.append(_Segment(paths[label], mesh, colours[label]))
    return result


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


def _glb(segments: Sequence[_Segment], assembly: Assembly) -> bytes:
    """A node a coarse label, with one for each of its parts below it."""
    import trimesh
    from trimesh.exchange.gltf import export_glb

    scene = trimesh.Scene(base_frame="world")
    frame, taken = to_gltf(assembly).matrix(), {"world"}
    groups: dict[str, str] = {}
    for segment in segments:
        parent, pose = "world", frame
        if len(segment.path) > 1:
            coarse = segment.path[0]
            if coarse not in groups:
                groups[coarse] = free_name(coarse, taken)
                scene.graph.update(frame_to=groups[coarse], frame_from="world", matrix=frame)
            parent, pose = groups[coarse], np.eye(4)
        name = free_name("/".join(segment.path), taken)
        scene.add_geometry(coloured(segment.mesh, segment.colour), name, name, parent, pose)
    return export_glb(scene, include_normals=False)


def _usd(segments: Sequence[_Segment], assembly: Assembly, suffix: str) -> bytes:
    """An Xform a coarse label, with a Mesh for each of its parts below it; names are display names, too."""
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.CreateInMemory()
    up = canonical_up(assembly.up) if assembly.up else "z"
    UsdGeom.SetStageUpAxis(stage, "Y" if up == "y" else "Z")
    UsdGeom.SetStageMetersPerUnit(stage, METRES[canonical_unit(assembly.unit)] if assembly.unit else 1.0)
    root = define_xform(stage, "", assembly.name or "segments")
    stage.SetDefaultPrim(root)
    if up not in ("y", "z"):
        place(root, Similarity(rotation=to_metres_z_up(assembly).rotation))
    groups: dict[str, str] = {}
    for segment in segments:
        parent = str(root.GetPath())
        if len(segment.path) > 1:
            coarse = segment.path[0]
            if coarse not in groups:
                groups[coarse] = str(define_xform(stage, parent, coarse).GetPath())
            parent = groups[coarse]
        prim = define_xform(stage, parent, segment.path[-1])
        define_mesh(stage, f"{prim.GetPath()}/mesh", segment.mesh, to_linear(segment.colour / 255))
    return exported(stage, suffix)
