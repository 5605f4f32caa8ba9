"""Trees of B-rep solids: the boolean operations of OpenCASCADE, each result checked.

Where surfaces nearly touch, OpenCASCADE may lose a solid, or a cut, and say nothing. So volumes are compared:
with what an operation can give at all, and with the exact mesh where a node has one.
"""

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
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_facets import faceted
from partwright.export.brep_quadrics import quadric_solid
from partwright.meshing import has_exact_mesh, mesh_csg

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_LOST = 1e-4  # of the larger volume: what an operation may lose by rounding
_FUZZY = (0.0, 1e-5, 1e-3)  # tolerances of operations, of the cube root of the volume
_OVERLAP = 0.02  # of a union's volume: more of it twice, and facets stand for the union
_SAME_MESH = 5e-3  # share of the volume by which an exact mesh may differ from what it stands for
_ORDERS = 4  # of operands, beside the given one and its reverse


@dataclass
class Compromises:
    """Names of what OpenCASCADE could not do: `apart`, united with the rest; `faceted`, built at all."""

    apart: list[str] = field(default_factory=list)
    faceted: list[str] = field(default_factory=list)


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
        if isinstance(node, Part) or not has_exact_mesh(node):
            raise
        try:
            solid = faceted(node)
        except NoSurfaceError:
            raise error from None
        within = Compromises(faceted=[part.name for part in node.parts])
    made.apart += within.apart
    made.faceted += within.faceted
    return solid


def _combined(node: Node, ball: Ball, made: Compromises) -> TopoDS_Shape:
    if isinstance(node, Part):
        return placed(node, ball)
    if node.operation != "union":
        return _ordered(node, [_combined(child, ball, made) for child in node.children])
    result, left = combined(node.children[0], ball, made), []
    for child in node.children[1:]:
        solid = combined(child, ball, made)
        try:
            result = _operated("union", result, solid, _label(child))
        except NoSurfaceError:
            left.append(solid)
            made.apart.append(child.name or _label(child))
    solids = [_unified(node, result), *left]
    right = _exact_volume(node) if left else None
    if right is not None and sum(volume_and_area(one)[0] for one in solids) > (1 + _OVERLAP) * right:
        raise NoSurfaceError(f"OpenCASCADE fails at the union of {_label(node)}; move its parts a little")
    return _side_by_side(solids)


def _ordered(node: Assembly, solids: list[TopoDS_Shape]) -> TopoDS_Shape:
    """The difference or intersection, its operands in one order after another until its volume is right.

    Where quadrics touch at a slant, OpenCASCADE may leave one of them out, and say nothing.
    """
    right = _exact_volume(node)
    count, first = len(solids), int(node.operation == "difference")
    shuffled = [first + np.random.default_rng(seed).permutation(count - first) for seed in range(_ORDERS)]
    error = f"OpenCASCADE gets the {node.operation} of {_label(node)} wrong; move it a little"
    for order in (range(first, count), range(count - 1, first - 1, -1), *shuffled):
        chain = [*range(first), *order]
        result = solids[chain[0]]
        try:
            for i in chain[1:]:
                result = _operated(node.operation, result, solids[i], _label(node.children[i]))
            result = _unified(node, result)
        except NoSurfaceError as failure:
            error = str(failure)
            continue
        if right is None or abs(volume_and_area(result)[0] / right - 1) < _SAME_MESH:
            return result
    raise NoSurfaceError(error)


def _exact_volume(node: Assembly) -> float | None:
    """By its exact mesh; None where it has none, or no end."""
    if not has_exact_mesh(node) or not np.isfinite(node.bounds()).all():
        return None
    try:
        return float(mesh_csg(node).volume)
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


def _operated(operation: str, first: TopoDS_Shape, second: TopoDS_Shape, label: str) -> TopoDS_Shape:
    """The boolean operation, ever more tolerant until it is valid and its volume one that it can have.

    Where surfaces nearly touch, OpenCASCADE may lose a whole solid and say nothing.
    """
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.collections import List_TopoDS_Shape as Shapes

    a, b = volume_and_area(first)[0], volume_and_area(second)[0]
    low, high = {"union": (max(a, b), a + b), "difference": (a - b, a), "intersection": (0.0, min(a, b))}[
        operation
    ]
    slack = _LOST * max(a, b)
    for tolerance in _FUZZY:
        work = {"union": BRepAlgoAPI_Fuse, "difference": BRepAlgoAPI_Cut, "intersection": BRepAlgoAPI_Common}[
            operation
        ]()
        arguments, tools = Shapes(), Shapes()
        arguments.Append(first)
        tools.Append(second)
        work.SetArguments(arguments)
        work.SetTools(tools)
        work.SetFuzzyValue(tolerance * max(a, b) ** (1 / 3))
        work.Build()
        done = work.IsDone() and BRepCheck_Analyzer(work.Shape()).IsValid()
        if done and low - slack <= volume_and_area(work.Shape())[0] <= high + slack:
            return work.Shape()
    raise NoSurfaceError(f"OpenCASCADE fails at the {operation} with {label}; move it a little")


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
