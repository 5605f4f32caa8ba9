"""GLB: one named, coloured node a part, with the part's parameters in the node's `extras`.

glTF is in metres with Y up, so the root of the scene converts; where the assembly knows no unit or up axis
its numbers stay as they are, and `asset.extras` says so. Each part is meshed in its own frame and placed by
its node, so that a far place costs no digits and a node turns about the part's own origin. The copies of a
repeated part are nodes below the part's own, named leg/2, leg/3 ..., and share its mesh; a group that is a
copy of another is a node with its move, and nodes below it share the other's meshes. An intersection of
quadrics (a convex of CAPRI-Net's) is one node, since its leaves alone have no end; its `extras` list them.
glTF knows no booleans: of a difference each part is shown as what is left of it, and what is subtracted is
there without a mesh, for its parameters. Nor does it know blends: `joined` writes the surface that parts make
together, shared out among their nodes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright import __version__
from partwright.approximation.atomic_nodes import check_ends, is_atomic, is_operation
from partwright.approximation.pieces import require_some
from partwright.approximation.separation import separated, subtracted_names
from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.assembly.file_text import instance_dict
from partwright.assembly.palette import palette
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError, SettingError
from partwright.export.axes import to_gltf
from partwright.export.formats import Format, Holds
from partwright.export.glb_joined import add_patches
from partwright.export.glb_physics import KHR, check_physics
from partwright.export.identifiers import free_name
from partwright.export.shared_groups import Shared, shared
from partwright.export.texturing import own_colour, own_mesh, textured, whole_mesh
from partwright.textures.maps import without_maps

if TYPE_CHECKING:
    import trimesh

_VERTICES, _INDICES = 34962, 34963  # glTF's targets of buffer views
_PART, _WHOLE = 32, 128  # cells along a part, and along the whole
_SUBTRACTED = {"role": "subtracted"}


def write(
    assembly: Assembly,
    path: str | Path,
    resolution: int | None = None,
    physics: str | None = None,
    density: float | None = None,
    tolerance: float | None = None,
    free_joint: bool = False,
    joined: bool = False,
) -> None:
    """Write the parts.

    resolution: the number of cells along each part, 32 if not given; joined: along the whole, 128.
    joined: the one surface that the parts make, blends and all; a part's node has what of it is the part's.

    physics: colliders, too: "khr" as rigid bodies of KHR_physics_rigid_bodies, "unreal" or "godot" as meshes
    under the names that these engines know. density, free_joint: of "khr", which may then move. tolerance: as
    of MJCF.

    Raises:
        NothingToExportError: no part has a surface.
        NoSurfaceError: the assembly does not end.
        SettingError: there is no such physics, a density or joint without it, or joined with it.
    """
    check_physics(physics, density, free_joint)
    if joined and physics is not None:
        raise SettingError("joined: parts of one surface have no colliders; leave out joined or physics")
    # Engines find colliders by the names of nodes, so nodes that share a mesh would be without.
    made = _scene(assembly, resolution, bodily=physics == KHR, joined=joined, sharing=physics in (None, KHR))
    collide = None
    if physics is not None:
        from partwright.export.glb_colliders import add_named_colliders, add_rigid_body, collider_body

        body = collider_body(assembly, physics, density, tolerance)
        if physics == KHR:
            collide = add_rigid_body(made.scene, made.body, body, free_joint, made.taken)
        else:
            collide = add_named_colliders(made.scene, physics, body, made.shown)
        body.write_report(path)
    write_bytes(path, _document(made, collide))


def document(assembly: Assembly) -> bytes:
    """What `write` writes where nothing else is asked for.

    Raises:
        what `Format.check` and `write` raise.
    """
    FORMAT.check(assembly, {})
    return _document(_scene(assembly))


def _scene(
    assembly: Assembly,
    resolution: int | None = None,
    *,
    bodily: bool = False,
    joined: bool = False,
    sharing: bool = True,
) -> _Scene:
    check_ends(assembly)
    cells = resolution or (_WHOLE if joined else _PART)
    made = _Scene(assembly, cells, bodily, joined, sharing)
    require_some(assembly, list(made.scene.geometry))
    return made


def _document(made: _Scene, collide: Callable[[dict[str, Any]], None] | None = None) -> bytes:
    """The file's bytes; collide: what is done to its tree in the end."""
    from trimesh.exchange.gltf import export_glb

    def describe(tree: dict[str, Any]) -> None:
        tree["asset"]["generator"] = f"Partwright {__version__}"
        tree["asset"]["extras"] = _about(made.assembly)
        _name_attributes(tree)
        _say_targets(tree)
        if collide is not None:
            collide(tree)

    return bytes(export_glb(made.scene, include_normals=False, tree_postprocessor=describe))


def _name_attributes(tree: dict[str, Any]) -> None:
    """Normals and tangents by the names that glTF has for them."""
    for primitive in (one for mesh in tree.get("meshes", ()) for one in mesh["primitives"]):
        for name in ("NORMAL", "TANGENT"):
            if f"_{name}" in primitive["attributes"]:
                primitive["attributes"][name] = primitive["attributes"].pop(f"_{name}")


def _say_targets(tree: dict[str, Any]) -> None:
    """Which buffer views hold vertices and which indices: the glTF validator asks for it."""
    for primitive in (one for mesh in tree.get("meshes", ()) for one in mesh["primitives"]):
        accessors = {_VERTICES: primitive["attributes"].values(), _INDICES: (primitive["indices"],)}
        for target, indices in accessors.items():
            for index in indices:
                tree["bufferViews"][tree["accessors"][index]["bufferView"]]["target"] = target


def _about(assembly: Assembly) -> dict[str, Any]:
    about: dict[str, Any] = {"unit": assembly.unit, "up": assembly.up, "operation": assembly.operation}
    if assembly.unit is None:
        about["note"] = "the length unit is unknown: coordinates are as in the input, not in metres"
    return about | ({"metadata": dict(assembly.metadata)} if assembly.metadata else {})


class _Scene:
    """Adds nodes to a scene."""

    def __init__(
        self,
        assembly: Assembly,
        resolution: int,
        bodily: bool = False,
        joined: bool = False,
        sharing: bool = True,
    ) -> None:
        """bodily: all is below a node `body`, in metres. joined: nodes have parts of the one surface.
        sharing: groups that are copies of one another share meshes."""
        import trimesh

        self.scene = trimesh.Scene(base_frame="world")
        self.assembly, self.resolution, self.sharing = assembly, resolution, sharing
        self.shown: dict[tuple[str, ...], str] = {}  # parts of which a node has the mesh -> its name
        self.colours = dict(zip((p.name for p in assembly.parts), palette(len(assembly)), strict=True))
        self.taken = {"world", *self.colours}
        self.body = free_name("body", self.taken) if bodily else "world"
        if bodily:
            self.scene.graph.update(frame_to=self.body, frame_from="world")
        pose = to_gltf(assembly).matrix()
        if joined:
            add_patches(self.scene, assembly, resolution, pose, self._patch, self._looking)
        else:
            self.add(assembly, self.body, pose, {})

    def add(self, node: Node, parent: str, pose: np.ndarray, extras: dict[str, Any]) -> str:
        """A node below another, and its name. A difference holds what is left of it, and what it subtracts
        without mesh."""
        if is_atomic(node) or is_operation(node, "intersection"):
            return self._add_whole(node, parent, pose, extras)
        if isinstance(node, Part):
            return self._add_part(node, parent, pose, extras)
        name = free_name(node.name or "assembly", self.taken)
        about = extras | {"operation": node.operation, "blend": node.blend}
        self.scene.graph.update(frame_to=name, frame_from=parent, matrix=pose, metadata=about)
        subtracts = is_operation(node, "difference")
        children = list(separated(node)) if subtracts else node.children
        for each in shared(children) if self.sharing else map(Shared, children):
            add = self._add_whole if is_operation(each.node, "difference") and subtracts else self.add
            like = add(each.node, name, np.eye(4), {})
            for copy, move in each.copies:
                leaves = dict(zip((part.name for part in each.node.parts), copy.parts, strict=True))
                self._add_copy(like, name, leaves, (copy.name, move))
        for cutter in node.children[1:] if subtracts else ():
            back = subtracted_names(cutter)
            for part in (cutter,) if isinstance(cutter, Part) else cutter.parts:
                placed = part.pose.matrix()
                about = _extras(part) | ({} if part.name in back else _SUBTRACTED)
                self.scene.graph.update(frame_to=part.name, frame_from=name, matrix=placed, metadata=about)
        return name

    def _add_copy(
        self, like: str, parent: str, leaves: Mapping[str, Part], moved: tuple[str, Similarity] | None = None
    ) -> None:
        """A node, and all below it, like one that is there, with its meshes.

        leaves: by the name of a leaf, the one of the copy in its place. moved: of the copy's own node, its
        name and move.
        """
        graph = self.scene.graph.transforms
        edge = graph.edge_data[(graph.parents[like], like)]
        about, matrix = _as_of(edge.get("metadata", {}), like, leaves), edge.get("matrix", np.eye(4))
        wanted = re.sub(r"_\d+$", "", like)
        if moved is not None:
            wanted, matrix = moved[0] or wanted, moved[1].matrix() @ matrix
            about |= {"role": "copy"}
        own_name = leaves[like].name if like in leaves else ""  # which copies of a repeated part share
        there = not own_name or own_name in self.scene.graph.nodes
        name = free_name(own_name or wanted, self.taken) if there else own_name
        mesh = graph.node_data[like].get("geometry")
        own = {} if mesh is None else {"geometry": mesh}
        self.scene.graph.update(frame_to=name, frame_from=parent, matrix=matrix, metadata=about, **own)
        for child in list(graph.children.get(like, ())):
            self._add_copy(child, name, leaves)

    def _add_part(self, part: Part, parent: str, pose: np.ndarray, extras: dict[str, Any]) -> str:
        own = part.pose
        about = _extras(part) | extras
        try:
            mesh = own_mesh(part, self.resolution)
        except NoSurfaceError:  # it only shows where it blends
            self._add_bare(part.name, parent, pose @ own.matrix(), about)
            return part.name
        mesh = self._looking(mesh, part)
        self.scene.add_geometry(mesh, part.name, part.name, parent, pose @ own.matrix(), metadata=about)
        self.shown[(part.name,)] = part.name
        for i, move in enumerate(part.instances, start=2):
            copy = free_name(f"{part.name}/{i}", self.taken)
            within = own.inverse().conjugate(move).matrix()
            about = {"role": "copy"}
            self.scene.graph.update(
                frame_to=copy, frame_from=part.name, matrix=within, geometry=part.name, metadata=about
            )
        return part.name

    def _add_whole(self, node: Node, parent: str, pose: np.ndarray, extras: dict[str, Any]) -> str:
        """One mesh in the assembly's own frame, in the colour of what is left of it or comes first."""
        parts = (node,) if isinstance(node, Part) else node.parts
        operation = "intersection" if isinstance(node, Part) else node.operation
        taken = subtracted_names(node)
        about = extras | {
            "operation": operation,
            "parts": [{"name": p.name} | _extras(p) | _role(p.name, taken) for p in parts],
        }
        name = self._name_of_whole(node)
        try:
            mesh = self._looking(whole_mesh(node, self.assembly), parts[0], placed=True)
        except NoSurfaceError:
            self._add_bare(name, parent, pose, about)
        else:
            self.scene.add_geometry(mesh, name, name, parent, pose, metadata=about)
            self.shown.setdefault(tuple(p.name for p in parts), name)
        return name

    def _looking(self, mesh: trimesh.Trimesh, part: Part, placed: bool = False) -> trimesh.Trimesh:
        """The mesh in the part's map, or in its colour; placed: it is where the part is, not in its frame."""
        found = textured(mesh, part, placed)
        if found is None:
            own = own_colour(part)
            return coloured(mesh, self.colours[part.name] if own is None else own)
        found.mesh.visual = with_image(found.uv, found.image, found.relief)
        known = found.mesh.vertex_attributes
        for name in list(known):  # as trimesh writes those that it does not know
            known[f"_{name}"] = np.asarray(known.pop(name), np.float32)
        return found.mesh

    def _name_of_whole(self, node: Node) -> str:
        """A part that was cut keeps its name; of a repeated one, the first copy does."""
        if isinstance(node, Part):
            return node.name
        first = node.children[0]
        cut = node.operation == "difference" and isinstance(first, Part)
        if cut and first.name not in self.scene.graph.nodes:
            return first.name
        return free_name(node.name or ("convex" if is_atomic(node) else node.operation), self.taken)

    def _patch(self, part: Part, copy: int) -> tuple[str, dict[str, Any]]:
        if copy:
            return free_name(f"{part.name}/{copy + 1}", self.taken), {"role": "copy"}
        return part.name, _extras(part)

    def _add_bare(self, name: str, parent: str, pose: np.ndarray, about: dict[str, Any]) -> None:
        about = about | {"note": "no surface of its own at this resolution"}
        self.scene.graph.update(frame_to=name, frame_from=parent, matrix=pose, metadata=about)


def _role(name: str, subtracted: frozenset[str]) -> dict[str, Any]:
    return _SUBTRACTED if name in subtracted else {}


def _as_of(about: Mapping[str, Any], name: str, leaves: Mapping[str, Part]) -> dict[str, Any]:
    """What a node says, said of a copy's leaves instead."""
    if "parts" in about:
        own = [(leaves[entry["name"]], entry) for entry in about["parts"]]
        return {**about, "parts": [{**entry, "name": leaf.name, **_extras(leaf)} for leaf, entry in own]}
    return dict(about) | (_extras(leaves[name]) if name in leaves else {})


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
    known = without_maps(part.metadata)
    return own | ({"metadata": known} if known else {})


def with_image(uv: np.ndarray, image: Any, relief: Any = None) -> Any:
    """A matt look: an image (PIL, sRGB) at texture coordinates (V, 2) from its lower left; relief: a normal
    map there."""
    from trimesh.visual import TextureVisuals
    from trimesh.visual.material import PBRMaterial

    material = PBRMaterial(
        baseColorTexture=image, normalTexture=relief, metallicFactor=0.0, roughnessFactor=0.7
    )
    return TextureVisuals(uv=uv, material=material)


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


FORMAT = Format(
    "GLB",
    write,
    frozenset({Holds.NAMES, Holds.GROUPS, Holds.COPIES, Holds.PARAMETERS, Holds.LEARNED, Holds.MAPS}),
    lengths="metres",
    up="y",
)
