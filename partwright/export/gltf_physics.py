"""Rigid bodies in glTF: KHR_implicit_shapes, a release candidate, and KHR_physics_rigid_bodies, a draft.

Shapes stand along +Y in glTF, where those of assemblies stand along z. A cylinder has two radii there and a
capsule, too: frusta, cones and round cones are native. A hull is a mesh of a node outside of the scene, which
is not drawn and which its collider refers to.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from partwright.approximation.round_cone import RoundCone
from partwright.assembly.similarity import quaternion_product
from partwright.export.rigid_body import Body
from partwright.fields import Box, Capsule, Cone, Cylinder, Field, Frustum, Sphere

SHAPES: tuple[type[Field], ...] = (Box, Cylinder, Cone, Frustum, Sphere, Capsule, RoundCone)
IMPLICIT, RIGID = "KHR_implicit_shapes", "KHR_physics_rigid_bodies"
_Y_TO_Z = (math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0)  # the axis of glTF's shapes onto ours


def add_body(tree: dict[str, Any], name: str, body: Body, hulls: dict[str, str], moves: bool) -> None:
    """Make the node `name` of a glTF document the body, with a node below it for each collider.

    hulls: the name of a geometry -> that of the node with its mesh. moves: it has a mass and may move; else
    it stands still.
    """
    nodes = tree["nodes"]
    index = {node.get("name"): i for i, node in enumerate(nodes)}
    aside = {index[hull] for hull in hulls.values()}
    for entry, key in (*((node, "children") for node in nodes), *((one, "nodes") for one in tree["scenes"])):
        if key in entry:
            entry[key] = [child for child in entry[key] if child not in aside]
    owner = nodes[index[name]]
    if moves:
        owner.setdefault("extensions", {})[RIGID] = {"motion": motion(body)}
    shapes: list[dict[str, Any]] = []
    for geometry in body.geometries:
        made: dict[str, Any] = {"name": f"{geometry.name} collider"}
        if geometry.part is None:
            about = {"node": index[hulls[geometry.name]], "convexHull": True}
        else:
            form, turn = shape(geometry.part.field), geometry.part.rotation
            if form["type"] not in ("box", "sphere"):
                turn = quaternion_product(turn, _Y_TO_Z)
            w, x, y, z = np.clip(turn, -1, 1).tolist()  # glTF takes no 1 + 2e-16
            made |= {"translation": list(geometry.part.translation), "rotation": [x, y, z, w]}
            if form not in shapes:
                shapes.append(form)
            about = {"shape": shapes.index(form)}
        made["extensions"] = {RIGID: {"collider": {"geometry": about}}}
        owner.setdefault("children", []).append(len(nodes))
        nodes.append(made)
    used = [RIGID] + ([IMPLICIT] if shapes else [])
    tree["extensionsUsed"] = sorted({*tree.get("extensionsUsed", ()), *used})
    if shapes:
        tree.setdefault("extensions", {})[IMPLICIT] = {"shapes": shapes}


def shape(field: Field) -> dict[str, Any]:
    """One of `SHAPES` as a shape of KHR_implicit_shapes."""
    match field:
        case Box(size=size):
            return {"type": "box", "box": {"size": list(size)}}
        case Sphere(radius=radius):
            return {"type": "sphere", "sphere": {"radius": radius}}
        case Cylinder(radius=radius, height=height):
            return _round("cylinder", radius, radius, height)
        case Cone(radius=radius, height=height):
            return _round("cylinder", radius, 0.0, height)
        case Frustum(bottom_radius=bottom, top_radius=top, height=height):
            return _round("cylinder", bottom, top, height)
        case Capsule(radius=radius, height=height):
            return _round("capsule", radius, radius, height)
        case RoundCone(bottom_radius=bottom, top_radius=top, height=height):
            return _round("capsule", bottom, top, height)
    raise AssertionError(f"{field.kind} is not among SHAPES")


def _round(kind: str, bottom: float, top: float, height: float) -> dict[str, Any]:
    return {"type": kind, kind: {"height": height, "radiusBottom": bottom, "radiusTop": top}}


def motion(body: Body) -> dict[str, Any]:
    """Mass in kg, centre in metres, and the principal moments with the rotation from their axes."""
    moments, orientation = principal_inertia(body)
    w, x, y, z = orientation
    return {
        "mass": body.properties.mass(body.density),
        "centerOfMass": body.properties.centre.tolist(),
        "inertiaDiagonal": moments.tolist(),
        "inertiaOrientation": [x, y, z, w],
    }


def principal_inertia(body: Body) -> tuple[np.ndarray, tuple[float, float, float, float]]:
    """Principal moments (3,), and the quaternion (w, x, y, z) from their axes to the body's."""
    from partwright.assembly import Similarity

    moments, axes = np.linalg.eigh(body.properties.inertia * body.density)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    pose = np.eye(4)
    pose[:3, :3] = axes
    return np.maximum(moments, moments.max() * 1e-12), Similarity.from_matrix(pose).rotation
