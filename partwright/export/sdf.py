"""SDFormat: a model of native solids, meshes beside it where none is near, and its own mass and inertia.

In metres with Z up, as far as unit and up axis are known. Capsules and ellipsoids, which it has since version
1.8, are native. Blends cannot be held and are dropped. Mass and inertia are those of the blended surface.
"""

from __future__ import annotations

import xml.etree.ElementTree as xml
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.collision import TOLERANCE, Geometry
from partwright.approximation.ellipsoid import Ellipsoid
from partwright.assembly.similarity import rotation_matrix
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import free_name
from partwright.export.link_meshes import write_link_meshes
from partwright.export.links import Joint
from partwright.export.rigid_body import DENSITY, bodies, document, numbers, write_document
from partwright.export.urdf import roll_pitch_yaw
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.mass import MassProperties

if TYPE_CHECKING:
    from partwright.assembly import Assembly

VERSION = "1.9"
SOLIDS: tuple[type[Field], ...] = (Box, Cylinder, Sphere, Capsule, Ellipsoid)
_AXES = "xyz"


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
    """Write the model, and an STL beside it (FILE_part.stl) for each part that no solid is near to.

    The options are those of URDF; without free_joint the model is static.
    """
    made = bodies(assembly, links, SOLIDS, density, tolerance, resolution, convex=False)
    meshes = write_link_meshes(made, Path(path), resolution, visuals)
    root = document("sdf", assembly, density, version=VERSION)
    model = xml.SubElement(root, "model", name=assembly.name or "assembly")
    _say(model, "static", "false" if free_joint else "true")
    places = {made[0][0].name: np.zeros(3)}  # of links in the model
    for link, body in made:
        element = xml.SubElement(model, "link", name=link.name)
        if link.joint:
            places[link.name] = places[link.joint.parent] + link.joint.origin
            _say(element, "pose", numbers([*places[link.name], 0.0, 0.0, 0.0]))
        _add_inertial(element, body.properties, density)
        seen, files = meshes.seen[link.name], meshes.files[link.name]
        apart, taken = {name for name, _ in seen}, set[str]()
        for geometry in body.geometries:
            name = free_name(geometry.name, taken)
            both = geometry.piece not in apart
            for role in ("visual", "collision") if both else ("collision",):
                _add_shape(element, role, name, geometry, files.get(geometry.name, ""))
        for name, colour in seen:
            made_of = Geometry(name, colour, None, None, name, ())
            _add_shape(element, "visual", free_name(name, taken), made_of, files[name])
    for link, _ in made:
        if link.joint:
            _add_joint(model, link.name, link.joint)
    write_document(root, path, assembly, made)


def _add_inertial(link: xml.Element, properties: MassProperties, density: float) -> None:
    inertial = xml.SubElement(link, "inertial")
    _say(inertial, "pose", numbers([*properties.centre, 0.0, 0.0, 0.0]))
    _say(inertial, "mass", numbers([properties.mass(density)]))
    tensor, inertia = xml.SubElement(inertial, "inertia"), properties.inertia * density
    for i in range(3):
        for j in range(i, 3):
            _say(tensor, f"i{_AXES[i]}{_AXES[j]}", numbers([inertia[i, j]]))


def _add_shape(link: xml.Element, role: str, name: str, geometry: Geometry, file: str) -> None:
    element = xml.SubElement(link, role, name=name)
    if geometry.part is not None:
        angles = roll_pitch_yaw(rotation_matrix(geometry.part.rotation))
        _say(element, "pose", numbers([*geometry.part.translation, *angles]))
    holder = xml.SubElement(element, "geometry")
    if geometry.part is None:
        _say(xml.SubElement(holder, "mesh"), "uri", file)
    else:
        kind, sizes = _solid(geometry.part.field)
        solid = xml.SubElement(holder, kind)
        for key, values in sizes.items():
            _say(solid, key, numbers(values))
    if role == "visual":
        material = xml.SubElement(element, "material")
        for light in ("ambient", "diffuse"):
            _say(material, light, numbers([*np.asarray(geometry.colour), 1.0]))


def _solid(field: Field) -> tuple[str, dict[str, Sequence[float]]]:
    """SDFormat's element for one of `SOLIDS`, and its numbers."""
    match field:
        case Box(size=size):
            return "box", {"size": size}
        case Sphere(radius=radius):
            return "sphere", {"radius": [radius]}
        case Cylinder(radius=radius, height=height):
            return "cylinder", {"radius": [radius], "length": [height]}
        case Capsule(radius=radius, height=height):
            return "capsule", {"radius": [radius], "length": [height]}
        case Ellipsoid(radii=radii):
            return "ellipsoid", {"radii": radii}
    raise AssertionError(f"{field.kind} is not among SOLIDS")


def _add_joint(model: xml.Element, name: str, joint: Joint) -> None:
    element = xml.SubElement(model, "joint", name=f"{name} joint", type=joint.kind)
    _say(element, "parent", joint.parent)
    _say(element, "child", name)
    if joint.kind == "fixed":
        return
    axis = xml.SubElement(element, "axis")
    _say(axis, "xyz", numbers(joint.axis))
    if joint.limits is not None:
        limit = xml.SubElement(axis, "limit")
        for key, value in zip(("lower", "upper"), joint.limits, strict=True):
            _say(limit, key, numbers([value]))


def _say(parent: xml.Element, tag: str, text: str) -> xml.Element:
    element = xml.SubElement(parent, tag)
    element.text = text
    return element


FORMAT = Format(
    "SDFormat", write, frozenset({Holds.NAMES, Holds.EXACT, Holds.LEARNED}), lengths="metres", up="z"
)
