"""Colliders beside what a GLB shows: as rigid bodies of its extensions, or under the names of an engine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.approximation.collision import TOLERANCE
from partwright.export.axes import to_gltf
from partwright.export.collider_meshes import collider_mesh
from partwright.export.engine_names import KINDS, collider_names, plain_name
from partwright.export.glb_physics import KHR
from partwright.export.gltf_physics import SHAPES, add_body
from partwright.export.identifiers import free_name
from partwright.export.rigid_body import DENSITY, Body

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly

_CELLS = 24  # along a part that becomes a hull
Postprocess = Callable[[dict[str, Any]], None]


def collider_body(
    assembly: Assembly, physics: str, density: float | None = None, tolerance: float | None = None
) -> Body:
    """The colliders in metres with Y up, of kinds that the physics knows.

    Raises:
        NothingToExportError: no piece has a volume.
    """
    kinds = SHAPES if physics == KHR else KINDS[physics]
    return Body.of(
        assembly,
        kinds,
        DENSITY if density is None else density,
        TOLERANCE if tolerance is None else tolerance,
        _CELLS,
        convex=True,
        frame=to_gltf,
    )


def add_rigid_body(scene: trimesh.Scene, name: str, body: Body, moves: bool, taken: set[str]) -> Postprocess:
    """Add the hulls' meshes; what is returned makes the node `name` the body once there is a document."""
    hulls = {}
    for geometry in body.geometries:
        if geometry.part is None:
            node = hulls[geometry.name] = free_name(f"{geometry.name} hull", taken)
            scene.add_geometry(collider_mesh(geometry), node, node, "world")
    return lambda tree: add_body(tree, name, body, hulls, moves)


def add_named_colliders(
    scene: trimesh.Scene, engine: str, body: Body, shown: Mapping[tuple[str, ...], str]
) -> Postprocess:
    """Add colliders as siblings of what they are of, in its frame, so that they move as it does.

    shown: names of the parts of a node with a mesh -> the node's name. Of a repeated part the first copy has
    colliders, for the mesh is the same. What is returned gives nodes and meshes names that engines keep.
    """
    first = {geometry.parts: geometry.piece for geometry in reversed(body.geometries)}
    placed = [
        (shown[geometry.parts], geometry)
        for geometry in body.geometries
        if geometry.parts in shown and geometry.piece == first[geometry.parts]
    ]
    taken: set[str] = set()
    plain = {name: free_name(plain_name(name), taken) for name in scene.graph.nodes}
    names = collider_names(engine, [(plain[name], geometry) for name, geometry in placed])
    for (owner, geometry), name in zip(placed, names, strict=True):
        parent = scene.graph.transforms.parents[owner]
        world, _ = scene.graph.get(owner)
        mesh = collider_mesh(geometry, np.linalg.inv(world))
        local = scene.graph.transforms.edge_data[(parent, owner)].get("matrix", np.eye(4))
        scene.add_geometry(mesh, name, name, parent, local)

    def rename(tree: dict[str, Any]) -> None:
        for entry in (*tree["nodes"], *tree["meshes"]):
            entry["name"] = plain.get(entry["name"], entry["name"])

    return rename
