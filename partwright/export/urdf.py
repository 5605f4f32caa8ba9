"""URDF: one link of boxes, cylinders and spheres, meshes beside it where none is near, and an inertial block.

In metres with Z up, as far as unit and up axis are known. A capsule, which URDF lacks, is a cylinder and two
spheres. Blends cannot be held and are dropped. Mass and inertia are those of the blended surface.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.collision import TOLERANCE, Geometry
from partwright.assembly.similarity import rotation_matrix
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import free_name
from partwright.export.link_meshes import write_link_meshes
from partwright.export.links import Joint
from partwright.export.rigid_body import DENSITY, bodies, document, numbers, write_document
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.mass import MassProperties

if TYPE_CHECKING:
    from partwright.assembly import Assembly

SOLIDS: tuple[type[Field], ...] = (Box, Cylinder, Sphere, Capsule)
_AXES = "xyz"
Shape = tuple[str, dict[str, str], np.ndarray, np.ndarray]  # element, attributes, centre and rotation
_ENOUGH = "1000"  # N, Nm, m/s or rad/s: assemblies know none


def write(
    assembly: Assembly,
    path: str | Path,
    density: float = DENSITY,
    tolerance: float = TOLERANCE,
    free_joint: bool = False,
    resolution: int = 32,
    links: bool = False,
    visuals: bool = True,
) -> None:
    """Write the robot, and an STL beside it (FILE_part.stl) for each part that no solid is near to.

    density: in kg/m3. tolerance: how far a solid's surface may lie from its part's, as a share of the longest
    side. free_joint: whether a floating joint ties it to a link "world"; else the link is the root.
    resolution: cells along a part that becomes a mesh. links: each child of the root is a link, as `links_of`
    says. visuals: what collides as something else than it is is seen as its own mesh.
    """
    made = bodies(assembly, links, SOLIDS, density, tolerance, resolution, convex=False)
    root = document("robot", assembly, density, name=assembly.name or "assembly")
    meshes = write_link_meshes(made, Path(path), resolution, visuals)
    taken = {link.name for link, _ in made}  # readers keep links and shapes in one table of names
    for link, body in made:
        element = xml.SubElement(root, "link", name=link.name)
        _add_inertial(element, body.properties, density)
        seen, files = meshes.seen[link.name], meshes.files[link.name]
        apart = {name for name, _ in seen}
        for geometry in body.geometries:
            shapes = _shapes(geometry, files)
            name = free_name(geometry.name, taken)
            _add_shapes(element, geometry, shapes, name, both=geometry.piece not in apart)
        for name, colour in seen:
            shape = ("mesh", {"filename": files[name]}, np.zeros(3), np.eye(3))
            _add_shape(element, "visual", free_name(f"{name} visual", taken), shape, name, colour)
    for link, _ in made:
        if link.joint:
            _add_joint(root, link.name, link.joint)
    if free_joint:
        _add_free_joint(root, made[0][0].name)
    write_document(root, path, assembly, made)


def roll_pitch_yaw(rotation: np.ndarray) -> tuple[float, float, float]:
    """Angles about the fixed x, y and z axes of a (3, 3) rotation, in that order, as URDF has them."""
    across = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], across)
    if across < 1e-9:  # x points along z: only roll and yaw together are known
        return math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    return math.atan2(rotation[2, 1], rotation[2, 2]), pitch, yaw


def _add_inertial(link: xml.Element, properties: MassProperties, density: float) -> None:
    inertial = xml.SubElement(link, "inertial")
    xml.SubElement(inertial, "origin", xyz=numbers(properties.centre), rpy="0 0 0")
    xml.SubElement(inertial, "mass", value=numbers([properties.mass(density)]))
    inertia = properties.inertia * density
    entries = {f"i{_AXES[i]}{_AXES[j]}": numbers([inertia[i, j]]) for i in range(3) for j in range(i, 3)}
    xml.SubElement(inertial, "inertia", entries)


def _add_shapes(link: xml.Element, geometry: Geometry, shapes: list[Shape], name: str, both: bool) -> None:
    """both: it is also what is seen."""
    for i, shape in enumerate(shapes, 1):
        for role in ("visual", "collision") if both else ("collision",):
            own = name if i == 1 else f"{name}/{i}"
            _add_shape(link, role, own, shape, geometry.name, geometry.colour)


def _add_shape(
    link: xml.Element,
    role: str,
    name: str,
    shape: Shape,
    material: str,
    colour: np.ndarray,
) -> None:
    kind, sizes, centre, rotation = shape
    element = xml.SubElement(link, role, name=name)
    xml.SubElement(element, "origin", xyz=numbers(centre), rpy=numbers(roll_pitch_yaw(rotation)))
    xml.SubElement(xml.SubElement(element, "geometry"), kind, sizes)
    if role == "visual":
        look = xml.SubElement(element, "material", name=material)
        xml.SubElement(look, "color", rgba=numbers([*colour, 1.0]))


def _add_joint(root: xml.Element, name: str, joint: Joint) -> None:
    """Its limits of force and speed are none; URDF demands numbers for them."""
    element = xml.SubElement(root, "joint", name=f"{name} joint", type=joint.kind)
    xml.SubElement(element, "parent", link=joint.parent)
    xml.SubElement(element, "child", link=name)
    xml.SubElement(element, "origin", xyz=numbers(joint.origin), rpy="0 0 0")
    if joint.kind == "fixed":
        return
    xml.SubElement(element, "axis", xyz=numbers(joint.axis))
    if joint.limits is not None:
        lower, upper = (numbers([limit]) for limit in joint.limits)
        xml.SubElement(element, "limit", lower=lower, upper=upper, effort=_ENOUGH, velocity=_ENOUGH)


def _shapes(geometry: Geometry, files: dict[str, str]) -> list[Shape]:
    """URDF's elements for it."""
    if geometry.part is None:
        return [("mesh", {"filename": files[geometry.name]}, np.zeros(3), np.eye(3))]
    centre, rotation = np.array(geometry.part.translation), rotation_matrix(geometry.part.rotation)
    match geometry.part.field:
        case Box(size=size):
            return [("box", {"size": numbers(size)}, centre, rotation)]
        case Sphere(radius=radius):
            return [("sphere", {"radius": numbers([radius])}, centre, rotation)]
        case Cylinder(radius=radius, height=height):
            sizes = {"radius": numbers([radius]), "length": numbers([height])}
            return [("cylinder", sizes, centre, rotation)]
        case Capsule(radius=radius, height=height):
            sizes, ball = (
                {"radius": numbers([radius]), "length": numbers([height])},
                {"radius": numbers([radius])},
            )
            half = rotation[:, 2] * height / 2
            ends = [("sphere", ball, centre + side * half, rotation) for side in (1, -1)]
            return [("cylinder", sizes, centre, rotation), *ends]
    raise AssertionError(f"{geometry.part.field.kind} is not among SOLIDS")


def _add_free_joint(root: xml.Element, name: str) -> None:
    xml.SubElement(root, "link", name="world")
    joint = xml.SubElement(root, "joint", name="free", type="floating")
    xml.SubElement(joint, "parent", link="world")
    xml.SubElement(joint, "child", link=name)


FORMAT = Format("URDF", write, frozenset({Holds.NAMES, Holds.EXACT, Holds.LEARNED}), lengths="metres", up="z")
