"""A Blender script: one object a part in a collection, coloured, with its parameters as custom properties.

The script holds each part's mesh in the part's own frame, so that an object's location and rotation are the
part's. A second collection holds the surface of the whole: an object that follows the parts through a boolean
modifier each; where parts blend, a remesh modifier skins it and a smooth modifier rounds its joints.
"""

from __future__ import annotations

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

_DIGITS = 6  # of mesh coordinates
_VOXELS = 256  # of a blended skin along the longest side
_PARAMETERS = ("size", "roundness", "dilation", "taper", "bulge", "onion")


def write(assembly: Assembly, path: str | Path, resolution: int = 24) -> None:
    """Write the script; `resolution` is the number of cells along each part's mesh.

    Raises:
        NoSurfaceError: no part has a surface at this resolution.
        SettingError: the assembly's unit is unknown.
        OutputError: the file cannot be written.
    """
    expanded = assembly.expanded()
    colours = dict(zip((part.name for part in expanded.parts), palette(len(expanded)).tolist(), strict=True))
    meshes = {part.name: mesh for part in expanded.parts for mesh in _mesh(part, resolution)}
    if not meshes:
        raise NoSurfaceError("nothing to export: no part has a surface at this resolution")
    parts = [_entry(part, colours[part.name]) for part in expanded.parts if part.name in meshes]
    lines = [
        f"# {comment(assembly.name) or 'Assembly'}: {len(parts)} parts, for Blender 3.4 or later.",
        "# Run it by: blender -P FILE, or from Blender's text editor.",
        "",
        f"NAME = {_literal(assembly.name or 'Assembly')}",
        f"UNIT = {_literal(assembly.unit)}  # of all numbers below",
        f"SMALLEST_VOXEL = {_longest(assembly) / _VOXELS:.6g}  # of the blended skin",
        f"METRES_PER_UNIT = {METRES[canonical_unit(assembly.unit)] if assembly.unit else 1.0!r}",
        "",
        "# Lengths in UNIT; rotation is a quaternion (w, x, y, z). The meshes are last.",
        "PARTS = [",
        *(f"    {_literal(entry)}," for entry in parts),
        "]",
        "",
        "# (operation, children): a child is a part's name, or a pair like this one.",
        f"TREE = {_literal(_tree(expanded, set(meshes)))}",
        "",
        files("partwright.export").joinpath("blender_scene.txt").read_text("utf-8"),
        "# name: (vertices, faces)",
        "MESHES = {",
        *(f"    {_literal(name)}: {_literal(mesh)}," for name, mesh in meshes.items()),
        "}",
        "",
        "main()",
        "",
    ]
    write_bytes(path, "\n".join(lines).encode())


def _longest(assembly: Assembly) -> float:
    return float(np.ptp(assembly.bounds(), axis=0).max())


def _mesh(part: Part, resolution: int) -> Iterator[tuple[list[list[float]], list[list[int]]]]:
    """Vertices and faces in the part's own frame; nothing for a part without volume, which only blends."""
    try:
        mesh = mesh_part(Part(part.field), resolution)
    except NoSurfaceError:
        return
    digits = f".{_DIGITS}g"
    vertices = [[float(format(x, digits)) for x in vertex] for vertex in mesh.vertices.tolist()]
    yield vertices, mesh.faces.tolist()


def _entry(part: Part, colour: list[int]) -> dict[str, Any]:
    f = as_superfrustum(part.field)
    return {
        "name": part.name,
        "colour": [round(channel / 255, 4) for channel in colour],
        "location": list(part.translation),
        "rotation": list(part.rotation),
        "kind": part.field.kind,
        "blend": part.blend,
        **{name: list(v) if isinstance(v := getattr(f, name), tuple) else v for name in _PARAMETERS},
    }


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
