"""Trees of B-rep solids: each node's boolean operation, its volume compared with that of the exact mesh, or
of the field where there is none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.closed_quadrics import Ball
from partwright.assembly import Assembly, Node, Part
from partwright.assembly.similarity import NO_ROTATION
from partwright.errors import NoSurfaceError
from partwright.export.brep import solid_of
from partwright.export.brep_booleans import Repairs, operated, operated_on_moved
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_facets import faceted
from partwright.export.brep_quadrics import quadric_solid
from partwright.export.brep_topology import side_by_side, solids_of, volume_and_area, volume_of
from partwright.fields import Sphere
from partwright.meshing import has_exact_mesh, mesh_csg
from partwright.meshing.sampled_volume import sampled_volume

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_OVERLAP = 0.02  # of a union's volume: more of it twice, and facets stand for the union
_CHORD = 5e-5  # of the longest side: how far an exact mesh may lie from its surface
_SAME_MESH = 5e-3  # share of the volume by which what stands for an exact mesh may have less
_SAME_SOLID = 1e-4  # share of volume and area that a solid keeps when its faces become fewer


@dataclass
class Compromises:
    """Names of what OpenCASCADE could not do: `apart`, united with the rest; `faceted`, built at all;
    `moved`, joined where it was, and how far it moved. rough: whether tolerances are wide at once.
    repairs: what pays for further tries, of all that is tried for one export."""

    rough: bool = False
    repairs: Repairs = field(default_factory=Repairs)
    apart: list[str] = field(default_factory=list)
    faceted: list[str] = field(default_factory=list)
    moved: list[tuple[list[str], float]] = field(default_factory=list)


def combined(node: Node, ball: Ball, made: Compromises) -> TopoDS_Shape:
    """The node's solids, of `built` fields, joined by the boolean operations of its tree.

    ball: holds all of the node; quadrics that do not end are closed off outside of it.
    made: learns of what OpenCASCADE gets wrong. Flat facets stand for what it cannot join; what it cannot
    unite even so stays a solid of its own, as long as that hardly overlaps the rest, and where an operation
    fails for good, facets of its exact mesh stand for all of it.

    Raises:
        NoSurfaceError: the operations leave nothing, or OpenCASCADE cannot do them, nor has the node an exact
            mesh.
    """
    within = Compromises(made.rough, made.repairs)
    try:
        solid = _combined(node, ball, within)
    except NoSurfaceError as error:
        if not has_exact_mesh(node) or not np.isfinite(node.bounds()).all():
            raise
        try:
            solid = faceted(node)
        except NoSurfaceError:
            raise error from None
        within = Compromises(made.rough, made.repairs, faceted=[part.name for part in node.parts])
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
    try:
        return _unified(node, _operated(node, solids, _volume(node), made))
    except NoSurfaceError:
        if has_exact_mesh(node):
            raise
    return _unified(node, _operated(node, solids, None, made))  # what the file lacks then is told at the end


def _operated(
    node: Assembly, solids: Sequence[TopoDS_Shape], right: float | None, made: Compromises
) -> TopoDS_Shape:
    """All at once, or one after another where that goes wrong. right: the volume, where it is known."""
    try:
        return operated(node.operation, solids, right, _label(node), made.repairs, made.rough)
    except NoSurfaceError:
        return _stepwise(node, solids, right, made)


def _stepwise(
    node: Assembly, solids: Sequence[TopoDS_Shape], right: float | None, made: Compromises
) -> TopoDS_Shape:
    """One operand after another, each checked by itself, so that what one fails at costs no other.

    Those that fail are moved a little when all others are there. What a union does not take then stands
    beside it, without what that holds already; a difference takes it as flat facets.

    Raises:
        NoSurfaceError: a difference or an intersection fails for one, or too much of a union would overlap.
    """
    steps = _Steps(node, solids, right is not None, made)
    if len(solids) > 2:  # of two, that is what was tried
        steps.join(_as_it_is)
    if right is not None:
        steps.join(_moved_a_little)
    if node.operation != "union":
        steps.join(_as_facets)
        if steps.waiting:
            raise NoSurfaceError(
                f"OpenCASCADE fails at the {node.operation} of {_label(node)}; move its parts a little"
            )
        whole = [steps.result]
    else:
        whole = [steps.result, *map(steps.rest, steps.waiting)]
    volume = sum(volume_of(one) for one in whole)
    if right is not None and not (1 - _SAME_MESH) * right < volume < (1 + _OVERLAP) * right:
        raise NoSurfaceError(
            f"OpenCASCADE fails at the {node.operation} of {_label(node)}; move its parts a little"
        )
    return side_by_side(whole)


_Way = Callable[["_Steps", Node, "TopoDS_Shape", float | None], "TopoDS_Shape"]


class _Steps:
    """What of a node is joined so far, and what is waiting. known: whether volumes are."""

    def __init__(
        self, node: Assembly, solids: Sequence[TopoDS_Shape], known: bool, made: Compromises
    ) -> None:
        self.operation, self.known, self.made = node.operation, known, made
        self.result, self.joined = solids[0], [node.children[0]]
        self.waiting = list(zip(node.children[1:], solids[1:], strict=True))
        self._expected = _volume(Assembly((node.children[0],))) if known else None

    def join(self, way: _Way) -> None:
        """All that can be joined in this way; the others go on waiting."""
        failed = []
        for child, solid in self.waiting:
            try:
                self._joined(way, child, solid)
            except NoSurfaceError:
                failed.append((child, solid))
        self.waiting = failed

    def _joined(self, way: _Way, child: Node, solid: TopoDS_Shape) -> None:
        expected = volume = None
        if self._expected is not None:
            expected = _volume(Assembly((*self.joined, child), self.operation))
            assert expected is not None
            # By how much this step changes it; what earlier ones are off is not its fault.
            volume = expected + volume_of(self.result) - self._expected
        self.result = way(self, child, solid, volume)
        self._expected = expected
        self.joined.append(child)

    def rest(self, waiting: tuple[Node, TopoDS_Shape]) -> TopoDS_Shape:
        """What of a child of a union the others do not hold, to stand beside them; or all of it."""
        child, solid = waiting
        self.made.apart.append(child.name or _label(child))
        rest = Assembly((child, *self.joined), "difference")
        self.joined.append(child)
        if not self.known:
            return solid
        with suppress(NoSurfaceError):
            pair = (solid, self.result)
            return operated("difference", pair, _volume(rest), _label(child), self.made.repairs)
        with suppress(NoSurfaceError):
            whole = faceted(rest, fine=True)
            self.made.faceted += [part.name for part in child.parts]
            return whole
        return solid


def _as_it_is(steps: _Steps, child: Node, solid: TopoDS_Shape, volume: float | None) -> TopoDS_Shape:
    made = steps.made
    pair = (steps.result, solid)
    return operated(steps.operation, pair, volume, _label(child), made.repairs, made.rough)


def _moved_a_little(steps: _Steps, child: Node, solid: TopoDS_Shape, volume: float | None) -> TopoDS_Shape:
    made = steps.made
    assert volume is not None
    result, distance = operated_on_moved(
        steps.operation, (steps.result, solid), volume, _label(child), made.repairs, made.rough
    )
    made.moved.append(([part.name for part in child.parts], distance))
    return result


def _as_facets(steps: _Steps, child: Node, solid: TopoDS_Shape, volume: float | None) -> TopoDS_Shape:
    if not has_exact_mesh(child) or not np.isfinite(child.bounds()).all():
        raise NoSurfaceError(f"{_label(child)} has no exact mesh")
    pair = (steps.result, faceted(child, fine=True))
    result = operated(steps.operation, pair, volume, _label(child), steps.made.repairs)
    steps.made.faceted += [part.name for part in child.parts]
    return result


def volume_off(
    nodes: Sequence[Node], volume: float, solids: Sequence[TopoDS_Shape], made: Compromises
) -> float:
    """By which share the volume of all is off what it is to be, 0 as far as it may be.

    That is the volume of their exact meshes, which facets follow less closely, and a union with solids that
    stand apart may have more of; of those that have none, what their fields enclose; of those that are built
    as one solid, that of the solid as it was made.
    """
    right = 0.0
    for node, solid in zip(nodes, solids, strict=True):
        own = _volume(node) if isinstance(node, Assembly) and len(node) > 1 else None
        right += volume_of(solid) if own is None else own
    off = volume / right - 1
    less, more = (_OVERLAP if rough else _SAME_MESH for rough in (made.faceted, made.faceted or made.apart))
    return 0.0 if -less <= off <= more else off


@lru_cache(maxsize=64)  # of the whole it is asked for again with each file that is read
def _volume(node: Node) -> float | None:
    """By its exact mesh, or by points where it has none; None where it has no end."""
    if not np.isfinite(node.bounds()).all():
        return None
    if not has_exact_mesh(node):
        return sampled_volume(node)
    try:
        longest = float(np.ptp(np.array(node.bounds()), axis=0).max())
        return float(mesh_csg(node, _CHORD * longest).volume)
    except NoSurfaceError as error:
        raise NoSurfaceError(f"nothing to export: the {node.operation} of {_label(node)} is empty") from error


def _unified(node: Assembly, solid: TopoDS_Shape) -> TopoDS_Shape:
    """Faces of one surface made one, unless that loses some: OpenCASCADE may, and calls the rest valid.

    Raises:
        NoSurfaceError: nothing is left.
    """
    from OCP.BRepBuilderAPI import BRepBuilderAPI_Copy
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain

    if len(node.children) > 1:
        # Of a copy: where it fails it leaves the given edges changed, and a volume that is another.
        unify = ShapeUpgrade_UnifySameDomain(BRepBuilderAPI_Copy(solid).Shape(), True, True, False)
        with suppress(*opencascade_errors()):  # then the faces stay several
            unify.Build()
            fewer = unify.Shape()
            kept = np.allclose(volume_and_area(fewer), volume_and_area(solid), rtol=_SAME_SOLID, atol=0)
            if kept and (BRepCheck_Analyzer(fewer).IsValid() or not BRepCheck_Analyzer(solid).IsValid()):
                solid = fewer
    if next(solids_of(solid), None) is None:
        raise NoSurfaceError(f"nothing to export: the {node.operation} of {_label(node)} is empty")
    return solid


def placed(part: Part, ball: Ball) -> TopoDS_Shape:
    """The part's solid in the part's place."""
    form = ball.form(part)
    if form is not None:
        return _moved(quadric_solid(form, ball.radius), NO_ROTATION, ball.centre.tolist())
    # A ball is the same however it is turned; copies around a ring have their poles and seams in the edges
    # of what they meet if turned with it, and OpenCASCADE loses faces there.
    turn = NO_ROTATION if isinstance(part.field, Sphere) else part.rotation
    return _moved(solid_of(part.field), turn, part.translation)


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
