"""A Blender script: one object a part in a collection, coloured, with its parameters as custom properties.

The script holds each part's mesh in the part's own frame, so that an object's location and rotation are the
part's. A second collection holds the surface of the whole: an object that follows the parts through a boolean
modifier each; where parts blend, a remesh modifier skins it and a smooth modifier rounds its joints.
"""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.assembly.palette import palette
from partwright.assembly.rows import as_superfrustum
from partwright.errors import NoSurfaceError
from partwright.export.identifiers import comment
from partwright.meshing import mesh_part
from partwright.shapes import METRES, canonical_unit
from partwright.writing import write_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator

    import trimesh

_DIGITS = 6  # of mesh coordinates, relative to the part's size
_VOXELS = 256  # of a blended skin along the longest side
_ENTRIES = ("size", "roundness", "dilation", "taper", "bulge", "onion")


def write(assembly: Assembly, path: str | Path, resolution: int = 32) -> None:
    """Write the script; `resolution` is the number of cells along each part's mesh.

    Raises:
        NoSurfaceError: no part has a surface at this resolution.
        SettingError: the assembly's unit is unknown.
        OutputError: the file cannot be written.
    """
    expanded = assembly.expanded()
    colours = dict(zip((part.name for part in expanded.parts), palette(len(expanded)).tolist(), strict=True))
    parts = [entry for part in expanded.parts for entry in _entry(part, colours[part.name], resolution)]
    if not parts:
        raise NoSurfaceError("nothing to export: no part has a surface at this resolution")
    there = {entry["name"] for entry in parts}
    lines = [
        f"# {comment(assembly.name) or 'Assembly'}: {len(parts)} parts, for Blender 3.4 or later.",
        "# Run it by: blender -P FILE, or from Blender's text editor.",
        "",
        f"NAME = {json.dumps(assembly.name or 'Assembly')}",
        f"UNIT = {json.dumps(assembly.unit)}  # of all numbers below",
        f"SMALLEST_VOXEL = {_longest(assembly) / _VOXELS:.6g}  # of the blended skin",
        f"METRES_PER_UNIT = {METRES[canonical_unit(assembly.unit)] if assembly.unit else 1.0!r}",
        "",
        "# Lengths in UNIT; rotation is a quaternion (w, x, y, z); the mesh is in the part's own frame.",
        "PARTS = [",
        *(f"    {_literal(entry)}," for entry in parts),
        "]",
        "",
        "# (operation, children): a child is a part's name, or a pair like this one.",
        f"TREE = {_literal(_tree(expanded, there))}",
        "",
        files("partwright.export").joinpath("blender_scene.txt").read_text("utf-8"),
    ]
    write_bytes(path, "\n".join(lines).encode())


def _longest(assembly: Assembly) -> float:
    return float(np.ptp(assembly.bounds(), axis=0).max())


def _entry(part: Part, colour: list[int], resolution: int) -> Iterator[dict[str, Any]]:
    """Nothing for a part without volume, which only shows where it blends."""
    try:
        mesh = mesh_part(Part(part.field), resolution)
    except NoSurfaceError:
        return
    f = as_superfrustum(part.field)
    yield {
        "name": part.name,
        "colour": [round(channel / 255, 4) for channel in colour],
        "location": list(part.translation),
        "rotation": list(part.rotation),
        "kind": part.field.kind,
        "blend": part.blend,
        **{name: list(v) if isinstance(v := getattr(f, name), tuple) else v for name in _ENTRIES},
        "vertices": _vertices(mesh),
        "faces": mesh.faces.tolist(),
    }


def _vertices(mesh: trimesh.Trimesh) -> list[list[float]]:
    return [[float(f"{x:.{_DIGITS}g}") for x in vertex] for vertex in mesh.vertices.tolist()]


def _tree(node: Node, there: set[str]) -> Any:
    if isinstance(node, Part):
        return node.name if node.name in there else None
    children = [_tree(child, there) for child in node.children]
    if children[0] is None and node.operation == "difference":
        return None
    kept = [child for child in children if child is not None]
    return (node.operation, kept) if kept else None


def _literal(value: Any) -> str:
    """A Python literal on one line, ASCII only."""
    return ascii(value)
