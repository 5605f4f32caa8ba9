"""URDF: one link of boxes, cylinders and spheres, meshes beside it where none is near, and an inertial block.

In metres with Z up, as far as unit and up axis are known. A capsule, which URDF lacks, is a cylinder and two
spheres. Blends cannot be held and are dropped. Mass and inertia are those of the blended surface.
"""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.collision import TOLERANCE, Geometry
from partwright.assembly.names import unique_names
from partwright.assembly.similarity import rotation_matrix
from partwright.atomic_io import write_bytes
from partwright.export.formats import Format, Holds
from partwright.export.rigid_body import DENSITY, Body, numbers
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.mass import MassProperties

if TYPE_CHECKING:
    from partwright.assembly import Assembly

SOLIDS: tuple[type[Field], ...] = (Box, Cylinder, Sphere, Capsule)
_AXES = "xyz"


def write(
    assembly: Assembly,
    path: str | Path,
    density: float = DENSITY,
    tolerance: float = TOLERANCE,
    free_joint: bool = False,
    resolution: int = 32,
) -> None:
    """Write the robot, and an STL beside it (FILE_part.stl) for each part that no solid is near to.

    density: in kg/m3. tolerance: how far a solid's surface may lie from its part's, as a share of the longest
    side. free_joint: whether a floating joint ties it to a link "world"; else the link is the root.
    resolution: cells along a part that becomes a mesh.
    """
    body = Body.of(assembly, SOLIDS, density, tolerance, resolution, convex=False)
    root = body.root("robot", name=body.name)
    link = xml.SubElement(root, "link", name=body.name)
    _add_inertial(link, body.properties, density)
    files = _write_meshes([geometry for geometry in body.geometries if geometry.part is None], Path(path))
    for geometry in body.geometries:
        _add_geometry(link, geometry, files)
    if free_joint:
        _add_free_joint(root, body.name)
    body.write(root, path)


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


def _add_geometry(link: xml.Element, geometry: Geometry, files: dict[str, str]) -> None:
    for i, (kind, sizes, centre, rotation) in enumerate(_shapes(geometry, files)):
        for role in ("visual", "collision"):
            element = xml.SubElement(link, role, name=geometry.name if i == 0 else f"{geometry.name}/{i + 1}")
            xml.SubElement(element, "origin", xyz=numbers(centre), rpy=numbers(roll_pitch_yaw(rotation)))
            xml.SubElement(xml.SubElement(element, "geometry"), kind, sizes)
            if role == "visual":
                material = xml.SubElement(element, "material", name=geometry.name)
                xml.SubElement(material, "color", rgba=numbers([*geometry.colour, 1.0]))


def _shapes(
    geometry: Geometry, files: dict[str, str]
) -> list[tuple[str, dict[str, str], np.ndarray, np.ndarray]]:
    """URDF's elements for it: name, attributes, centre and rotation."""
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


def _write_meshes(geometries: list[Geometry], path: Path) -> dict[str, str]:
    """STL files beside `path`: the name of the piece -> that of its file."""
    from trimesh.exchange.stl import export_stl

    plain = [re.sub(r"[^\w.-]", "_", geometry.name, flags=re.ASCII) for geometry in geometries]
    files = {}
    for geometry, name in zip(geometries, unique_names(plain, plain), strict=True):
        files[geometry.name] = f"{path.stem}_{name}.stl"
        write_bytes(path.with_name(files[geometry.name]), export_stl(geometry.mesh))
    return files


def _add_free_joint(root: xml.Element, name: str) -> None:
    xml.SubElement(root, "link", name="world")
    joint = xml.SubElement(root, "joint", name="free", type="floating")
    xml.SubElement(joint, "parent", link="world")
    xml.SubElement(joint, "child", link=name)


FORMAT = Format("URDF", write, frozenset({Holds.NAMES, Holds.EXACT, Holds.LEARNED}), lengths="metres", up="z")
