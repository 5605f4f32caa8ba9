"""A Blender script: one object a part in a collection, coloured, with its parameters as custom properties;
quadrics, which rarely end, come as the convexes that they bound.

The script holds each part's mesh in the part's own frame, so that an object's location and rotation are the
part's. A second collection holds the surface of the whole: an object that follows the parts through a boolean
modifier each; where parts blend, a remesh modifier skins it and a smooth modifier rounds its joints. Maps of
parts are pictures within the script, those that are alike one.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from partwright.approximation.atomic_nodes import is_atomic
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.palette import palette
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import comment, free_name
from partwright.export.texturing import own_colour, own_mesh, textured, whole_mesh
from partwright.fields import Pipe
from partwright.shapes import METRES, canonical_unit

if TYPE_CHECKING:
    import trimesh

_DIGITS = 6  # of mesh coordinates
_VOXELS = 256  # of a blended skin along the longest side
_PARAMETERS = ("size", "roundness", "dilation", "taper", "bulge", "onion")


@dataclass(frozen=True)
class _Solid:
    """One object: what the script knows of it, its mesh, and of a part with a map the coordinates (F, 3, 2)
    of its faces' corners, the picture, a PNG, and that of its normals, if it has one."""

    entry: dict[str, Any]
    surface: trimesh.Trimesh
    corners: np.ndarray | None = None
    png: bytes = b""
    relief: bytes = b""

    @property
    def mesh(self) -> tuple[list[list[float]], list[list[int]]]:
        """Vertices and faces."""
        digits = f".{_DIGITS}g"
        vertices = [[float(format(x, digits)) for x in vertex] for vertex in self.surface.vertices.tolist()]
        return vertices, self.surface.faces.tolist()

    @property
    def coordinates(self) -> list[list[float]]:
        """u and v of the corners of all faces."""
        assert self.corners is not None
        return self.corners.reshape(-1, 2).round(5).tolist()


def write(assembly: Assembly, path: str | Path, resolution: int = 24) -> None:
    """Write the script; `resolution` is the number of cells along each part's mesh.

    Raises:
        NoSurfaceError: no part has a surface at this resolution.
        SettingError: the assembly's unit is unknown.
        OutputError: the file cannot be written.
    """
    solids: dict[str, _Solid] = {}
    tree = _tree(assembly.expanded(), assembly, resolution, solids)
    if not solids:
        raise NoSurfaceError("nothing to export: no part has a surface at this resolution")
    colours = (palette(len(solids)) / 255).round(4).tolist()
    parts = [
        {"name": name, "colour": colour} | solid.entry
        for (name, solid), colour in zip(solids.items(), colours, strict=True)
    ]
    every = [png for solid in solids.values() for png in (solid.png, solid.relief) if png]
    pictures = list(dict.fromkeys(every))
    mapped = [(name, solid, pictures.index(solid.png)) for name, solid in solids.items() if solid.png]
    reliefs = {name: pictures.index(solid.relief) for name, solid in solids.items() if solid.relief}
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
        f"TREE = {_literal(tree)}",
        "",
        files("partwright.export").joinpath("blender_scene.txt").read_text("utf-8"),
        "# name: (vertices, faces)",
        "MESHES = {",
        *(f"    {_literal(name)}: {_literal(solid.mesh)}," for name, solid in solids.items()),
        "}",
        "",
        "# name: (u, v) of the corners of its faces, and a number in PICTURES",
        "MAPS = {",
        *(f"    {_literal(name)}: ({_literal(solid.coordinates)}, {i})," for name, solid, i in mapped),
        "}",
        "",
        "# name: a number in PICTURES, of parts with a normal map at the same places",
        f"RELIEFS = {_literal(reliefs)}",
        "",
        "# PNG, in base 64",
        "PICTURES = [",
        *(f"    {_literal(base64.b64encode(png).decode('ascii'))}," for png in pictures),
        "]",
        "",
        "main()",
        "",
    ]
    write_bytes(path, "\n".join(lines).encode())


def _longest(assembly: Assembly) -> float:
    return float(np.ptp(assembly.bounds(), axis=0).max())


def _tree(node: Node, assembly: Assembly, resolution: int, solids: dict[str, _Solid]) -> Any:
    """The node by the names of its solids, which are put into `solids`; None where it has no volume."""
    if is_atomic(node) or isinstance(node, Part):
        try:
            solid = _atomic(node, assembly) if is_atomic(node) else _part(cast(Part, node), resolution)
        except NoSurfaceError:
            return None  # it only blends, or nothing of it lies within the assembly
        name = free_name(node.name or "convex", set(solids))
        solids[name] = solid
        return name
    children = [_tree(child, assembly, resolution, solids) for child in node.children]
    if children[0] is None and node.operation == "difference":
        return None
    kept = [child for child in children if child is not None]
    return (node.operation, kept) if kept else None


def _part(part: Part, resolution: int) -> _Solid:
    """In the part's own frame, with its parameters where they are numbers."""
    entry: dict[str, Any] = {
        "location": list(part.translation),
        "rotation": list(part.rotation),
        "kind": part.field.kind,
        "blend": part.blend,
    }
    f = part.field.superfrustum()
    if f is not None:
        entry |= {name: list(v) if isinstance(v := getattr(f, name), tuple) else v for name in _PARAMETERS}
    if isinstance(part.field, Pipe):
        entry |= {"radius": part.field.radius, "thickness": part.field.thickness}
    return _looking(entry, own_mesh(part, resolution), part)


def _atomic(node: Node, assembly: Assembly) -> _Solid:
    """Quadrics that bound one convex, in the assembly's frame; their coefficients by name."""
    fields = ((part.name, part.field.quadric()) for part in node.parts)
    quadrics = {name: list(own.coefficients) for name, own in fields if own is not None}
    entry = {"location": [0.0] * 3, "rotation": [1.0, 0.0, 0.0, 0.0], "kind": "convex", "blend": 0.0}
    return _looking(entry | quadrics, whole_mesh(node, assembly), node.parts[0], placed=True)


def _looking(entry: dict[str, Any], mesh: trimesh.Trimesh, part: Part, placed: bool = False) -> _Solid:
    """With the part's map, or its own colour, where it has one. The mesh stays closed, as booleans need it:
    coordinates that differ at a vertex are those of corners."""
    if (own := own_colour(part)) is not None:
        entry = entry | {"colour": (own / 255).round(4).tolist()}
    found = textured(mesh, part, placed)
    if found is None:
        return _Solid(entry, mesh)
    import trimesh as tm

    vertices, number = np.unique(np.asarray(found.mesh.vertices), axis=0, return_inverse=True)
    faces = np.asarray(found.mesh.faces)
    whole = tm.Trimesh(vertices, number.reshape(-1)[faces], process=False)
    return _Solid(entry, whole, found.uv[faces], found.png, found.relief_png)


def _literal(value: Any) -> str:
    """A Python literal on one line, ASCII only."""
    return ascii(value)


FORMAT = Format(
    "Blender",
    write,
    frozenset({Holds.NAMES, Holds.PARAMETERS, Holds.SUBTRACTION, Holds.BLENDS, Holds.LEARNED, Holds.MAPS}),
)
