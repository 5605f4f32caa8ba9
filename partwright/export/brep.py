"""Exact B-rep solids by OpenCASCADE, of the `cad` extra: analytic faces, no facets.

Two families cover every canonical solid and more: straight parts of round cross-section are their profile,
offset by the dilation, turned about the axis; prisms are their rounded rectangle, offset likewise.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from partwright.assembly import Assembly, Node, Part
from partwright.assembly.rows import as_superfrustum
from partwright.errors import MissingDependencyError, NoSurfaceError
from partwright.export.brep_solids import prism, revolved
from partwright.export.recognise import SAME
from partwright.fields import Field, Solid, SuperFrustum

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_SHORTEST_SIDE = 1e-3  # of the longest


def require_cad() -> None:
    """Raise MissingDependencyError unless OpenCASCADE's Python package is installed."""
    try:
        import OCP.TopoDS  # noqa: F401
    except ImportError as error:
        raise MissingDependencyError(
            "STEP needs OpenCASCADE; install it with: pip install 'partwright[cad]'"
        ) from error


def is_exact(field: Field) -> bool:
    """Whether `solid_of` builds the field's very surface."""
    if not isinstance(field, SuperFrustum | Solid):
        return False
    f = field.superfrustum()
    if f.bulge > SAME:
        return False
    return _turns(f) or _extrudes(f)


def solid_of(field: Field) -> TopoDS_Shape:
    """The field of `is_exact` as a solid in its own frame."""
    f = as_superfrustum(field)
    return revolved(f) if _turns(f) else prism(f)


def combined(node: Node) -> TopoDS_Shape:
    """The node's solids, of `is_exact` fields, joined by the boolean operations of its tree.

    Raises:
        NoSurfaceError: the operations leave nothing.
    """
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer

    if isinstance(node, Part):
        return placed(node)
    operation = {
        "union": BRepAlgoAPI_Fuse,
        "difference": BRepAlgoAPI_Cut,
        "intersection": BRepAlgoAPI_Common,
    }[node.operation]
    result = combined(node.children[0])
    for child in node.children[1:]:
        joined = operation(result, combined(child))
        if not joined.IsDone():
            raise NoSurfaceError(f"the {node.operation} with {_label(child)} failed; move it a little")
        result = joined.Shape()
    if len(node.children) > 1:
        unify = ShapeUpgrade_UnifySameDomain(result, True, True, False)
        unify.Build()
        result = unify.Shape()
    if not TopExp_Explorer(result, TopAbs_ShapeEnum.TopAbs_SOLID).More():
        raise NoSurfaceError(f"nothing to export: the {node.operation} of {_label(node)} is empty")
    return result


def placed(part: Part) -> TopoDS_Shape:
    """The part's solid in the part's place."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
    from OCP.gp import gp_Quaternion, gp_Trsf, gp_Vec

    w, x, y, z = part.rotation
    pose = gp_Trsf()
    pose.SetRotation(gp_Quaternion(x, y, z, w))
    pose.SetTranslationPart(gp_Vec(*part.translation))
    return BRepBuilderAPI_Transform(solid_of(part.field), pose, True).Shape()


def _label(node: Node) -> str:
    return repr(node.name) if node.name else "an assembly" if isinstance(node, Assembly) else "a part"


def _turns(f: SuperFrustum) -> bool:
    """Round, not flat, and its hole is either open along its whole length or closed."""
    width, middle = max(f.size[:2]), min(f.size[:2]) / 2
    is_round = abs(f.size[0] - f.size[1]) <= SAME * width and (1 - f.roundness) * middle <= SAME * width
    upright = f.size[2] > SAME * width or abs(f.taper - 1) <= SAME
    closed = not f.hollow
    open_throughout = min(1.0, f.taper) * middle * f.onion > f.dilation + SAME * width
    solid = f.dilation > 0 or (min(width, f.size[2]) > 0 and f.onion < 1)
    return is_round and upright and solid and (closed or open_throughout)


def _extrudes(f: SuperFrustum) -> bool:
    """A prism whose flat sides, where it has any, are long enough to be rounded one by one."""
    middle = min(f.size[:2]) / 2
    flat = (1 - f.roundness) * middle
    sides = flat <= SAME * middle or flat > _SHORTEST_SIDE * max(f.size)
    return abs(f.taper - 1) <= SAME and not f.hollow and sides and min(f.size) > _SHORTEST_SIDE * max(f.size)
