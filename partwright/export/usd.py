"""USD: an Xform and a Mesh a part under its own name, coloured, its parameters as custom data.

The numbers are the assembly's own; `metersPerUnit` and `upAxis` say what they mean. USD knows Y and Z up
only: an assembly of another up axis is turned to Z. Of a difference each part is shown as what is left of it;
subtracted parts are there with the purpose "guide", which renderers leave out. An intersection is one mesh.
Copies, of a part or of a group, are instances. Maps are pictures beside the file; those that are alike are
one.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from partwright import __version__
from partwright.approximation.atomic_nodes import check_ends, is_atomic, is_operation
from partwright.approximation.pieces import nothing_to_export
from partwright.approximation.separation import separated, subtracted_names
from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.assembly.palette import palette
from partwright.atomic_io import write_bytes
from partwright.errors import NoSurfaceError
from partwright.export.axes import to_metres_z_up
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import file_name, free_name
from partwright.export.shared_groups import shared
from partwright.export.texturing import own_colour, own_mesh, textured, whole_mesh
from partwright.export.usd_physics import add_physics, body_of, check_physics
from partwright.export.usd_prims import (
    define_mesh,
    define_normals,
    define_texture,
    define_xform,
    exported,
    place,
    to_linear,
)
from partwright.shapes import METRES, canonical_unit, canonical_up
from partwright.textures.maps import without_maps

_AXES = {"y": "Y", "z": "Z"}
_NO_SURFACE = "no surface of its own at this resolution"
_UNKNOWN_UNIT = "the length unit is unknown: metersPerUnit is USD's way of saying nothing, 1"


def write(
    assembly: Assembly,
    path: str | Path,
    resolution: int = 32,
    physics: str | None = None,
    density: float | None = None,
    tolerance: float | None = None,
    free_joint: bool = False,
) -> None:
    """Write .usda as text, .usdc and .usd in binary; resolution: cells along each part.

    physics: "usd" for colliders, too. density (kg/m3), tolerance, free_joint (the body may move): as of MJCF.

    Raises:
        NothingToExportError: no part has a surface.
        NoSurfaceError: the assembly does not end.
        SettingError: there is no such physics, or an option that needs it.
    """
    from pxr import Usd, UsdGeom

    check_physics(physics, density, tolerance, free_joint)
    check_ends(assembly)
    stage = Usd.Stage.CreateInMemory()
    up = canonical_up(assembly.up) if assembly.up else "z"
    UsdGeom.SetStageUpAxis(stage, _AXES.get(up, "Z"))
    UsdGeom.SetStageMetersPerUnit(stage, METRES[canonical_unit(assembly.unit)] if assembly.unit else 1.0)
    stage.SetMetadata("comment", f"Partwright {__version__}")
    writer = _Writer(stage, assembly, resolution, Path(path).stem)
    writer.add(assembly, "", subtracted=False)
    if not writer.meshes:
        raise nothing_to_export(assembly)
    root = stage.GetPrimAtPath("/").GetAllChildren()[0]
    stage.SetDefaultPrim(root)
    if up not in _AXES:
        place(root, Similarity(rotation=to_metres_z_up(assembly).rotation))
    if physics is not None:
        body = body_of(assembly, density, tolerance)
        add_physics(stage, root, body, free_joint)
        body.write_report(path)
    for name, data in writer.images.items():
        write_bytes(Path(path).parent / name, data)
    write_bytes(path, exported(stage, Path(path).suffix.lower()))


class _Writer:
    """Adds prims to a stage."""

    def __init__(self, stage: Any, assembly: Assembly, resolution: int, stem: str) -> None:
        self.stage, self.assembly, self.resolution, self.stem = stage, assembly, resolution, stem
        self.images: dict[str, bytes] = {}  # by the names of their files
        self.meshes = 0  # that are shown
        linear = to_linear(palette(len(assembly)) / 255.0)
        self.colours = dict(zip((p.name for p in assembly.parts), linear, strict=True))
        for part in assembly.parts:
            if (own := own_colour(part)) is not None:
                self.colours[part.name] = to_linear(own / 255.0)

    def add(self, node: Node, parent: str, *, subtracted: bool) -> Any:
        """A node below another, as a prim. A difference shows what is left of it; what it subtracts is a
        guide."""
        if is_atomic(node) or is_operation(node, "intersection"):
            return self._add_whole(node, parent, subtracted)
        prim = define_xform(self.stage, parent, node.name or "assembly")
        if isinstance(node, Part):
            self._add_part(prim, node, parent, subtracted)
            return prim
        about: dict[str, Any] = {"operation": node.operation, "blend": node.blend, **dict(node.metadata)}
        if node is self.assembly and node.unit is None:
            about["note"] = _UNKNOWN_UNIT
        prim.SetCustomData({"partwright": _plain(about)})
        below = str(prim.GetPath())
        if not is_operation(node, "difference"):
            self._add_all(node.children, below, self.add, subtracted)
            return prim
        self._add_all(list(separated(node)), below, self._add_piece, subtracted)
        self._add_all(node.children[1:], below, self.add, subtracted=True)
        return prim

    def _add_all(self, nodes: Sequence[Node], parent: str, add: Callable[..., Any], subtracted: bool) -> None:
        """Nodes below another, groups that are copies of others as instances of them."""
        from pxr import Vt

        for each in shared(nodes):
            prim = add(each.node, parent, subtracted=subtracted)
            for copy, move in each.copies:
                made = define_xform(self.stage, parent, copy.name or prim.GetName())
                names = Vt.StringArray([part.name for part in copy.parts])
                made.SetCustomData({"partwright": {"copy_of": prim.GetName(), "copied_parts": names}})
                self._refer(made, prim, move)

    def _add_piece(self, piece: Node, parent: str, *, subtracted: bool) -> Any:
        """One of the solids that a difference leaves."""
        if is_operation(piece, "difference"):
            return self._add_whole(piece, parent, subtracted)
        return self.add(piece, parent, subtracted=subtracted)

    def _refer(self, copy: Any, prim: Any, pose: Similarity) -> None:
        """Make a prim an instance of another, in a place of its own."""
        place(copy, pose)
        copy.GetReferences().AddInternalReference(prim.GetPath())
        copy.SetInstanceable(True)

    def _add_whole(self, node: Node, parent: str, subtracted: bool) -> Any:
        """One mesh in the assembly's own frame, in the colour of what is left of it or comes first."""
        parts = (node,) if isinstance(node, Part) else node.parts
        prim = define_xform(self.stage, parent, node.name or ("convex" if is_atomic(node) else "cut"))
        about: dict[str, Any] = {} if isinstance(node, Part) else {"operation": node.operation}
        taken = subtracted_names(node)
        about["parts"] = {p.name: _about(p, (p.name in taken) != subtracted) for p in parts}
        try:
            mesh = whole_mesh(node, self.assembly)
        except NoSurfaceError:
            about["note"] = _NO_SURFACE
        else:
            self._add_mesh(prim, mesh, parts[0], subtracted, placed=True)
        prim.SetCustomData({"partwright": _plain(about)})
        return prim

    def _add_part(self, prim: Any, part: Part, parent: str, subtracted: bool) -> None:
        about = _about(part, subtracted)
        pose = part.pose
        try:
            mesh = own_mesh(part, self.resolution)
        except NoSurfaceError:
            mesh, about["note"] = None, _NO_SURFACE
        prim.SetCustomData({"partwright": _plain(about)})
        place(prim, pose)
        if mesh is None:
            return
        self._add_mesh(prim, mesh, part, subtracted)
        for i, move in enumerate(part.instances, start=2):
            copy = define_xform(self.stage, parent, f"{part.name}_{i}")
            copy.SetCustomData({"partwright": {"copy_of": part.name}})
            self._refer(copy, prim, move @ pose)

    def _add_mesh(self, below: Any, mesh: Any, part: Part, subtracted: bool, placed: bool = False) -> None:
        """In the part's map, or its colour; placed: the mesh is where the part is, not in its frame."""
        from pxr import UsdGeom

        self.meshes += not subtracted
        path = f"{below.GetPath()}/mesh"
        found = None if subtracted else textured(mesh, part, placed)
        if found is not None:
            prim = define_mesh(self.stage, path, found.mesh)
            relief = None
            if found.relief is not None:
                relief = self._picture(f"{part.name}_normals", found.relief_png)
                define_normals(prim, found.mesh.vertex_attributes["NORMAL"])
            picture = self._picture(part.name, found.png)
            define_texture(prim, f"{below.GetPath()}/material", found.uv, picture, relief)
        else:
            prim = define_mesh(self.stage, path, mesh, self.colours[part.name])
        if subtracted:
            prim.CreatePurposeAttr(UsdGeom.Tokens.guide)
            prim.CreateVisibilityAttr(UsdGeom.Tokens.invisible)  # some viewers show guides

    def _picture(self, part: str, data: bytes) -> str:
        """The name of the file that has it; parts whose maps are alike share one."""
        same = next((name for name, known in self.images.items() if known == data), None)
        if same is None:
            same = f"{free_name(file_name(f'{self.stem}_{part}'), {name[:-4] for name in self.images})}.png"
            self.images[same] = data
        return same


def _about(part: Part, subtracted: bool) -> dict[str, Any]:
    own = {"field": part.field.to_dict(), "blend": part.blend, "metadata": without_maps(part.metadata)}
    return own | ({"role": "subtracted"} if subtracted else {})


def _plain(values: Mapping[str, Any]) -> dict[str, Any]:
    """As USD's dictionaries take them: lists of numbers become arrays, lists of lists JSON; what is
    empty is left out."""
    from pxr import Vt

    def one(value: Any) -> Any:
        if isinstance(value, Mapping):
            return _plain(value)
        if isinstance(value, list) and any(isinstance(entry, list) for entry in value):
            return json.dumps(value)  # no dictionary of USD holds rows of several lengths
        return Vt.DoubleArray(value) if isinstance(value, list) else value

    return {key.replace(":", "_"): one(value) for key, value in values.items() if value != {}}


FORMAT = Format(
    "USD",
    write,
    frozenset({Holds.NAMES, Holds.GROUPS, Holds.COPIES, Holds.PARAMETERS, Holds.LEARNED, Holds.MAPS}),
    most=10_000,
    needs=("pxr", "usd"),
)
