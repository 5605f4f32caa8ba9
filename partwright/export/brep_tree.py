"""Trees of B-rep solids: each node's boolean operation, its volume compared with that of the exact mesh."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.closed_quadrics import Ball
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.similarity import NO_ROTATION
from partwright.errors import NoSurfaceError
from partwright.export.brep import solid_of, volume_and_area
from partwright.export.brep_booleans import operated
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_facets import faceted
from partwright.export.brep_quadrics import quadric_solid
from partwright.meshing import has_exact_mesh, mesh_csg

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_OVERLAP = 0.02  # of a union's volume: more of it twice, and facets stand for the union
_CHORD = 5e-5  # of the longest side: how far an exact mesh may lie from its surface
_SAME_MESH = 5e-3  # share of the volume by which what stands for an exact mesh may have less


@dataclass
class Compromises:
    """Names of what OpenCASCADE could not do: `apart`, united with the rest; `faceted`, built at all;
    `moved`, joined where it was, and how far it moved."""

    apart: list[str] = field(default_factory=list)
    faceted: list[str] = field(default_factory=list)
    moved: list[tuple[list[str], float]] = field(default_factory=list)


def combined(node: Node, ball: Ball, made: Compromises) -> TopoDS_Shape:
    """The node's solids, of `built` fields, joined by the boolean operations of its tree.

    ball: holds all of the node; quadrics that do not end are closed off outside of it.
    made: learns of what OpenCASCADE gets wrong. What it cannot unite stays a solid of its own, as long as
    that hardly overlaps the rest; where an operation fails, flat facets of its exact mesh stand for it.

    Raises:
        NoSurfaceError: the operations leave nothing, or OpenCASCADE cannot do them, nor has the node an exact
            mesh.
    """
    within = Compromises()
    try:
        solid = _combined(node, ball, within)
    except NoSurfaceError as error:
        if not has_exact_mesh(node) or not np.isfinite(node.bounds()).all():
            raise
        try:
            solid = faceted(node)
        except NoSurfaceError:
            raise error from None
        within = Compromises(faceted=[part.name for part in node.parts])
    made.apart += within.apart
    made.faceted += within.faceted
    made.moved += within.moved
    return solid


def _combined(node: Node, ball: Ball, made: Compromises) -> TopoDS_Shape:
    if isinstance(node, Part):
        return placed(node, ball)
    united = node.operation == "union"
    solids = [
        combined(child, ball, made) if united or isinstance(child, Part) else _combined(child, ball, made)
        for child in node.children
    ]
    right = _exact_volume(node)
    try:
        solid, distance = operated(node.operation, solids, right, _label(node))
        result = _unified(node, solid)
        if distance:
            made.moved.append(([part.name for part in node.parts], distance))
        return result
    except NoSurfaceError:
        if not united:
            raise
    return _joined(node, solids, right, made)


def _joined(
    node: Assembly, solids: Sequence[TopoDS_Shape], right: float | None, made: Compromises
) -> TopoDS_Shape:
    """A union of all that can be united; the rest stays beside it, as long as that hardly overlaps."""
    result, left, joined = solids[0], [], [node.children[0]]
    for child, solid in zip(node.children[1:], solids[1:], strict=True):
        so_far = _exact_volume(Assembly((*joined, child))) if right is not None else None
        try:
            result, distance = operated("union", (result, solid), so_far, _label(child))
        except NoSurfaceError:
            left.append(solid)
            made.apart.append(child.name or _label(child))
            continue
        joined.append(child)
        if distance:
            made.moved.append(([part.name for part in child.parts], distance))
    whole = [_unified(node, result), *left]
    volume = sum(volume_and_area(one)[0] for one in whole)
    if right is not None and not (1 - _SAME_MESH) * right < volume < (1 + _OVERLAP) * right:
        raise NoSurfaceError(f"OpenCASCADE fails at the union of {_label(node)}; move its parts a little")
    return _side_by_side(whole)


def _exact_volume(node: Assembly) -> float | None:
    """By its exact mesh; None where it has none, or no end."""
    if not has_exact_mesh(node) or not np.isfinite(node.bounds()).all():
        return None
    try:
        longest = float(np.ptp(np.array(node.bounds()), axis=0).max())
        return float(mesh_csg(node, _CHORD * longest).volume)
    except NoSurfaceError as error:
        raise NoSurfaceError(f"nothing to export: the {node.operation} of {_label(node)} is empty") from error


def _unified(node: Assembly, solid: TopoDS_Shape) -> TopoDS_Shape:
    """Faces of one surface made one.

    Raises:
        NoSurfaceError: nothing is left.
    """
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    if len(node.children) > 1:
        unify = ShapeUpgrade_UnifySameDomain(solid, True, True, False)
        with suppress(*opencascade_errors()):  # then the faces stay several
            unify.Build()
            solid = unify.Shape()
    if not TopExp_Explorer(solid, TopAbs_ShapeEnum.TopAbs_SOLID).More():
        raise NoSurfaceError(f"nothing to export: the {node.operation} of {_label(node)} is empty")
    return solid


def _side_by_side(solids: list[TopoDS_Shape]) -> TopoDS_Shape:
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Compound

    if len(solids) == 1:
        return solids[0]
    builder, compound = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(compound)
    for solid in solids:
        builder.Add(compound, solid)
    return compound


def placed(part: Part, ball: Ball) -> TopoDS_Shape:
    """The part's solid in the part's place."""
    form = ball.form(part)
    if form is not None:
        return _moved(quadric_solid(form, ball.radius), NO_ROTATION, ball.centre.tolist())
    return _moved(solid_of(part.field), part.rotation, part.translation)


def _moved(shape: TopoDS_Shape, rotation: Sequence[float], place: Sequence[float]) -> TopoDS_Shape:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Quaternion, gp_Trsf, gp_Vec

    w, x, y, z = rotation
    pose = gp_Trsf()
    pose.SetRotation(gp_Quaternion(x, y, z, w))
    pose.SetTranslationPart(gp_Vec(*place))
    return BRepBuilderAPI_Transform(shape, pose, True).Shape()


def _label(node: Node) -> str:
    return repr(node.name) if node.name else "an assembly" if isinstance(node, Assembly) else "a part"
