"""Quadrics as CAD formats can hold them: named solids that agree with them within the assembly's bounds.

Planes become boxes, cylinders and cones get an end, and what is outside of one is a box without it. Surfaces
that no named solid has (ellipsoids, elliptic cylinders, paraboloids ...) stay quadrics.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from partwright.assembly import Assembly, Node, Part, Similarity
from partwright.assembly.placed import placed_quadric
from partwright.assembly.similarity import rotation_matrix
from partwright.errors import NoSurfaceError
from partwright.fields import Box, Cone, Cylinder, Field, NormalForm, Sphere, normal_form

SAME = 1e-6  # of the assembly's size: curvatures that are smaller are flat
_ROOM = 1.02
_TURNED = 1e-9  # of a quaternion's vector: less is rounding


def with_closed_quadrics(assembly: Assembly) -> Assembly:
    """The same solid; its leaves are bounded, but for quadrics that no named solid replaces.

    Raises:
        NoSurfaceError: the assembly does not end.
    """
    if all(part.field.quadric() is None for part in assembly.parts):
        return assembly
    ball = Ball.around(assembly)

    def closed(node: Node) -> Node:
        if node.is_part:
            return ball.closed(node)
        node = _holes_subtracted(node, ball)
        children = node.children
        if node.operation == "difference":  # what has no surface takes nothing away
            children = (children[0], *(one for one in children[1:] if not ball.is_nothing(one)))
        return dataclasses.replace(node, children=tuple(map(closed, children)))

    return closed(assembly)  # type: ignore[return-value]  # an assembly stays one


def closes_alike(part: Part) -> bool:
    """Whether the solid that a repeated quadric is closed to does for its copies, too: spheres, and cylinders
    that are moved across their axis alone."""
    quadric = placed_quadric(part)
    if quadric is None or any(np.abs(move.rotation[1:]).max() > _TURNED for move in part.instances):
        return False
    form = normal_form(quadric)
    if form.complement or form.name not in ("sphere", "cylinder"):
        return False
    moves = np.array([move.translation for move in part.instances])
    along = np.abs(moves @ form.axes[:, 2])
    return form.name == "sphere" or bool((along <= SAME * np.linalg.norm(moves, axis=1)).all())


def _holes_subtracted(node: Assembly, ball: Ball) -> Assembly:
    """An intersection with the outside of a quadric is a difference: what CAD programs call a hole."""
    if node.operation != "intersection":
        return node
    holes = [child for child in node.children if ball.is_hole(child)]
    solids = tuple(child for child in node.children if child not in holes)
    if not holes or not solids:
        return node
    body = dataclasses.replace(node, children=solids, name="", blend=0.0, metadata={}, unit=None, up=None)
    inside = (
        dataclasses.replace(hole, field=own.complement())
        for hole in holes
        if hole.is_part and (own := hole.field.quadric()) is not None
    )
    return dataclasses.replace(node, children=(body, *inside), operation="difference")


@dataclasses.dataclass(frozen=True)
class Ball:
    """Around all of an assembly. centre: (3,)."""

    centre: np.ndarray
    radius: float

    @classmethod
    def around(cls, assembly: Assembly) -> Ball:
        """Raises NoSurfaceError where the assembly does not end."""
        box = assembly.bounds()
        if not np.isfinite(box).all():
            raise NoSurfaceError("nothing to export: the solid does not end; intersect it with its bounds")
        return cls(box.mean(axis=0), _ROOM * float(np.linalg.norm(np.ptp(box, axis=0)) / 2))

    def form(self, node: Node) -> NormalForm | None:
        """Of the quadric of a part, about the ball's centre; None of any other node."""
        quadric = node.field.quadric() if node.is_part else None
        if not node.is_part or quadric is None:
            return None
        place = np.array(node.translation) - self.centre
        return normal_form(quadric.moved(rotation_matrix(node.rotation), place), self.radius, SAME)

    def is_hole(self, node: Node) -> bool:
        """Whether the node is the outside of a curved quadric."""
        form = self.form(node)
        return form is not None and form.complement

    def is_nothing(self, node: Node) -> bool:
        """Whether the node is a quadric without surface, with no point inside."""
        form = self.form(node)
        return form is not None and form.name == "none" and not form.complement

    def closed(self, part: Part) -> Node:
        """A quadric as a named solid, or as a few; what is none, or no named solid is like, as it is."""
        form = self.form(part)
        if form is None or form.name not in _CLOSED:
            return part
        solids = [
            dataclasses.replace(part, field=field, translation=self._at(pose), rotation=pose.rotation)
            for field, pose in _CLOSED[form.name](form, self.radius)
        ]
        solid = solids[0] if len(solids) == 1 else Assembly(tuple(solids), name=part.name)
        if not form.complement:
            return solid
        around = Part(Box((2 * self.radius,) * 3), tuple(self.centre.tolist()), name=f"around {part.name}")
        return Assembly((around, solid), "difference")

    def _at(self, pose: Similarity) -> tuple[float, float, float]:
        x, y, z = (self.centre + np.array(pose.translation)).tolist()
        return x, y, z


Solids = list[tuple[Field, Similarity]]


def _pose(axes: np.ndarray, centre: np.ndarray) -> Similarity:
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = axes, centre
    return Similarity.from_matrix(matrix)


def _plane(form: NormalForm, radius: float) -> Solids:
    """The box's lid lies in the plane; its middle is as near to the ball's as can be."""
    w = form.axes[:, 2]
    height = float(form.centre @ w)
    depth = max(radius + height, 1e-3 * radius)
    return [(Box((2 * radius, 2 * radius, depth)), _pose(form.axes, (height - depth / 2) * w))]


def _parallel_planes(form: NormalForm, radius: float) -> Solids:
    u = form.axes[:, 0]
    size = (2 * float(form.radii[0]), 2 * radius, 2 * radius)
    return [(Box(size), _pose(form.axes, float(form.centre @ u) * u))]


def _cylinder(form: NormalForm, radius: float) -> Solids:
    w = form.axes[:, 2]
    foot = form.centre - float(form.centre @ w) * w
    return [(Cylinder(float(form.radii[0]), 2 * radius), _pose(form.axes, foot))]


def _sphere(form: NormalForm, _: float) -> Solids:
    return [(Sphere(float(form.radii[0])), _pose(form.axes, form.centre))]


def _cone(form: NormalForm, radius: float) -> Solids:
    """A cone for each nappe that reaches into the ball; the tip of a named cone is on top."""
    u, v, w = form.axes.T
    solids: Solids = []
    for up in (1.0, -1.0):
        height = radius - up * float(form.centre @ w)
        if height > 1e-9 * radius:
            axes = np.stack([u, -up * v, -up * w], axis=1)
            solids.append(
                (Cone(form.widening * height, height), _pose(axes, form.centre + up * height / 2 * w))
            )
    return solids


# name of the surface -> the named solids that agree with it in a ball about the origin
_CLOSED: dict[str, Callable[[NormalForm, float], Solids]] = {
    "plane": _plane,
    "parallel planes": _parallel_planes,
    "cylinder": _cylinder,
    "sphere": _sphere,
    "cone": _cone,
}
