"""GLB: one named, coloured node a part, with the part's parameters in the node's `extras`.

glTF is in metres with Y up, so the root of the scene converts; where the assembly knows no unit or up axis
its numbers stay as they are, and `asset.extras` says so. Each part is meshed in its own frame and placed by
its node, so that a far place costs no digits and a node turns about the part's own origin. The copies of a
repeated part are nodes below the part's own, named leg/2, leg/3 ..., and share its mesh. An intersection of
quadrics (a convex of CAPRI-Net's) is one node, since its leaves alone have no end; its `extras` list them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright import __version__
from partwright.approximation.atomic_nodes import atomic_mesh, is_atomic
from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.assembly.file_text import instance_dict
from partwright.assembly.palette import palette
from partwright.assembly.similarity import NO_ROTATION
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError
from partwright.export.identifiers import free_name
from partwright.meshing import mesh_part
from partwright.shapes import METRES, canonical_unit, canonical_up

if TYPE_CHECKING:
    import trimesh

_VERTICES, _INDICES = 34962, 34963  # glTF's targets of buffer views
_HALF = math.sqrt(0.5)
# up axis -> the rotation that turns it to +Y
_TO_Y_UP = {
    "y": NO_ROTATION,
    "-y": (0.0, 1.0, 0.0, 0.0),
    "z": (_HALF, -_HALF, 0.0, 0.0),
    "-z": (_HALF, _HALF, 0.0, 0.0),
    "x": (_HALF, 0.0, 0.0, _HALF),
    "-x": (_HALF, 0.0, 0.0, -_HALF),
}


def write(assembly: Assembly, path: str | Path, resolution: int = 32) -> None:
    """Write the parts; `resolution` is the number of cells along each part."""
    from trimesh.exchange.gltf import export_glb

    def describe(tree: dict[str, Any]) -> None:
        tree["asset"]["generator"] = f"Partwright {__version__}"
        tree["asset"]["extras"] = _about(assembly)
        _say_targets(tree)

    data = export_glb(_scene(assembly, resolution), include_normals=False, tree_postprocessor=describe)
    write_bytes(path, data)


def _say_targets(tree: dict[str, Any]) -> None:
    """Which buffer views hold vertices and which indices: the glTF validator asks for it."""
    for primitive in (one for mesh in tree.get("meshes", ()) for one in mesh["primitives"]):
        accessors = {_VERTICES: primitive["attributes"].values(), _INDICES: (primitive["indices"],)}
        for target, indices in accessors.items():
            for index in indices:
                tree["bufferViews"][tree["accessors"][index]["bufferView"]]["target"] = target


def to_gltf(assembly: Assembly) -> Similarity:
    """From the assembly's own units and axes to metres and Y up, as far as they are known."""
    scale = METRES[canonical_unit(assembly.unit)] if assembly.unit else 1.0
    return Similarity(scale, _TO_Y_UP[canonical_up(assembly.up)] if assembly.up else NO_ROTATION)


def _about(assembly: Assembly) -> dict[str, Any]:
    about: dict[str, Any] = {"unit": assembly.unit, "up": assembly.up, "operation": assembly.operation}
    if assembly.unit is None:
        about["note"] = "the length unit is unknown: coordinates are as in the input, not in metres"
    return about | ({"metadata": dict(assembly.metadata)} if assembly.metadata else {})


def _scene(assembly: Assembly, resolution: int) -> trimesh.Scene:
    import trimesh

    scene = trimesh.Scene(base_frame="world")
    colours = dict(zip((p.name for p in assembly.parts), palette(len(assembly)), strict=True))
    taken = {"world", *colours}

    def add_copies(part: Part) -> None:
        own = Similarity(1.0, part.rotation, part.translation)
        for i, move in enumerate(part.instances, start=2):
            copy = free_name(f"{part.name}/{i}", taken)
            within = own.inverse().conjugate(move).matrix()
            extras = {"role": "copy"}
            scene.graph.update(
                frame_to=copy, frame_from=part.name, matrix=within, geometry=part.name, metadata=extras
            )

    def add_atomic(node: Node, parent: str, pose: np.ndarray, about: dict[str, Any]) -> None:
        """A leaf or an intersection, its mesh in the assembly's own frame."""
        parts = (node,) if isinstance(node, Part) else node.parts
        name = free_name(node.name or "convex", taken) if isinstance(node, Assembly) else node.name
        about = about | {"operation": "intersection", "parts": [{"name": p.name} | _extras(p) for p in parts]}
        try:
            mesh = coloured(atomic_mesh(node, assembly), colours[parts[0].name])
        except NoSurfaceError:
            scene.graph.update(frame_to=name, frame_from=parent, matrix=pose, metadata=about)
        else:
            scene.add_geometry(mesh, name, name, parent, pose, metadata=about)

    def add(node: Node, parent: str, pose: np.ndarray, role: str) -> None:
        extras: dict[str, Any] = {"role": role} if role else {}
        if is_atomic(node):
            add_atomic(node, parent, pose, extras)
            return
        if isinstance(node, Part):
            placed = pose @ Similarity(1.0, node.rotation, node.translation).matrix()
            mesh = _local_mesh(node, resolution)
            about = _extras(node) | extras
            if mesh is None:
                about["note"] = "no surface of its own at this resolution"
                scene.graph.update(frame_to=node.name, frame_from=parent, matrix=placed, metadata=about)
            else:
                mesh = coloured(mesh, colours[node.name])
                scene.add_geometry(mesh, node.name, node.name, parent, placed, metadata=about)
                add_copies(node)
            return
        name = free_name(node.name or "assembly", taken)
        extras |= {"operation": node.operation, "blend": node.blend}
        scene.graph.update(frame_to=name, frame_from=parent, matrix=pose, metadata=extras)
        for i, child in enumerate(node.children):
            add(child, name, np.eye(4), "subtracted" if node.operation == "difference" and i else "")

    add(assembly, "world", to_gltf(assembly).matrix(), "")
    return scene


def _local_mesh(part: Part, resolution: int) -> trimesh.Trimesh | None:
    """The part in its own frame; None for one without volume, which only shows where it blends."""
    try:
        return mesh_part(Part(part.field), resolution)
    except NoSurfaceError:
        return None


def _extras(part: Part) -> dict[str, Any]:
    """The part as in an assembly file, but for the name: lengths are in the assembly's unit."""
    own = {
        "field": part.field.to_dict(),
        "translation": list(part.translation),
        "rotation": list(part.rotation),
        "blend": part.blend,
    }
    if part.instances:
        own["instances"] = [instance_dict(move) for move in part.instances]
    return own | ({"metadata": dict(part.metadata)} if part.metadata else {})


def coloured(mesh: trimesh.Trimesh, colour: np.ndarray) -> trimesh.Trimesh:
    """The mesh with a matt material of this sRGB colour (3,) uint8."""
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    srgb = colour / 255.0  # glTF's factors are linear
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    rgba = [*np.round(255 * linear).astype(int).tolist(), 255]
    material = PBRMaterial(baseColorFactor=rgba, metallicFactor=0.0, roughnessFactor=0.7)
    mesh.visual = TextureVisuals(material=material)
    return mesh
