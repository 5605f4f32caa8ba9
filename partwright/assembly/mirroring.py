"""Mirror images of groups: each leaf the same solid, or the mirror image of its profile, in a rigid pose."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.similarity import Similarity, quaternion_product
from partwright.errors import ParameterError
from partwright.fields import Extrusion, Field, Pipe, Quadric, Revolution, SuperFrustum
from partwright.fields.profile import Profile
from partwright.fields.solids import Solid

if TYPE_CHECKING:
    from partwright.assembly.checks import Quaternion
    from partwright.assembly.tree import Assembly, Node, Part

_HALF_TURNS: dict[str, Quaternion] = {
    "x": (0.0, 1.0, 0.0, 0.0),
    "y": (0.0, 0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 0.0, 1.0),
}


def mirrored(group: Assembly, axis: str = "x", at: float = 0.0, suffix: str = "_mirrored") -> Assembly:
    """The mirror image in the plane where the coordinate x, y or z is `at`; leaves are called NAME_mirrored.

    Raises:
        ParameterError: there is no such axis, or a leaf is a learned part, which cannot be mirrored.
    """
    if axis not in _HALF_TURNS:
        raise ParameterError(f"axis: expected x, y or z, got {axis!r}")
    return _image(group, axis, at, suffix)


def _image(group: Assembly, axis: str, at: float, suffix: str) -> Assembly:
    def one(node: Node) -> Node:
        return _leaf(node, axis, at, suffix) if node.is_part else _image(node, axis, at, suffix)

    return dataclasses.replace(group, children=tuple(map(one, group.children)))


def _leaf(part: Part, axis: str, at: float, suffix: str) -> Part:
    """A mirror M is minus a half turn, and so is the field's own in y, D: the pose M R D is one of turns."""
    half = _HALF_TURNS[axis]
    field, turn = _in_y(part.field, part.name)
    rotation = quaternion_product(quaternion_product(half, part.rotation), _HALF_TURNS["y"])
    back = (-half[0], half[1], half[2], half[3])  # minus the half turn's inverse, the same rotation
    instances = tuple(
        Similarity(
            1.0,
            quaternion_product(quaternion_product(half, move.rotation), back),
            _across(move(np.array(_across(np.zeros(3), axis, at))), axis, at),
        )
        for move in part.instances
    )
    return dataclasses.replace(
        part,
        field=field,
        translation=_across(np.array(part.translation), axis, at),
        rotation=quaternion_product(rotation, turn),
        instances=instances,
        name=f"{part.name}{suffix}",
    )


def _across(place: np.ndarray, axis: str, at: float) -> tuple[float, float, float]:
    result = np.array(place, dtype=np.float64)
    i = "xyz".index(axis)
    result[i] = 2 * at - result[i]
    x, y, z = result.tolist()
    return x, y, z


def _in_y(field: Field, name: str) -> tuple[Field, Quaternion]:
    """The field mirrored in its own y, and a turn that comes before its pose."""
    straight = (1.0, 0.0, 0.0, 0.0)
    if isinstance(field, SuperFrustum | Solid):  # symmetric there
        return field, straight
    if isinstance(field, Extrusion):
        return dataclasses.replace(field, profile=_upside_down(field.profile)), straight
    if isinstance(field, Revolution):
        half = -math.radians(field.angle) / 2
        return field, (math.cos(half), 0.0, 0.0, math.sin(half))
    if isinstance(field, Pipe):
        return dataclasses.replace(field, path=tuple((x, -y, z, r) for x, y, z, r in field.path)), straight
    if isinstance(field, Quadric):
        a, b, c, d, e, f, g, xy, yz, zx = field.coefficients
        return Quadric((a, b, c, d, -e, f, g, -xy, -yz, zx)), straight
    raise ParameterError(
        f"{name}: a part of kind {field.kind} cannot be mirrored; make copies of it by turns"
    )


def _upside_down(profile: Profile) -> Profile:
    loops = [tuple((x, -y, -bulge) for x, y, bulge in loop) for loop in profile.loops]
    return Profile.of_loops(loops)
