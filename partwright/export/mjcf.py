"""MJCF, MuJoCo's format: one body, a native geom a part, the assembly's own mass and inertia.

In metres with Z up, as far as unit and up axis are known. Blends cannot be held and are dropped. MuJoCo
collides the convex hull of a mesh, so where no native geom is near enough the hull itself is written. What
collides as something else than it is has its own mesh in group 2, and what collides is in group 3. Mass and
inertia are those of the blended surface, overlaps counted once, not the sum over the geoms.
"""

from __future__ import annotations

import xml.etree.ElementTree as xml
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright.approximation.collision import TOLERANCE, Geometry
from partwright.approximation.ellipsoid import Ellipsoid
from partwright.errors import UnitError
from partwright.export.formats import Format, Holds
from partwright.export.identifiers import free_name
from partwright.export.links import Joint
from partwright.export.rigid_body import DENSITY, bodies, document, numbers, write_document
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.mass import MassProperties

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Assembly

GEOMS: tuple[type[Field], ...] = (Box, Cylinder, Sphere, Capsule, Ellipsoid)
SEEN, HIDDEN = "2", "3"  # groups of geoms: viewers show the first three
SMALLEST_INERTIA = 1e-14  # kg m2; MuJoCo's own limit is mjMINVAL, 1e-15


def write(
    assembly: Assembly,
    path: str | Path,
    density: float = DENSITY,
    tolerance: float = TOLERANCE,
    free_joint: bool = False,
    resolution: int = 24,
    links: bool = False,
    visuals: bool = True,
) -> None:
    """Write the model.

    density: in kg/m3. tolerance: how far a geom's surface may lie from its part's, as a share of the longest
    side, before a mesh stands for it. free_joint: whether the body may move; else it is fixed to the world.
    resolution: cells along a part that becomes a mesh. links: each child of the root is a body of its own, as
    `links_of` says. visuals: what collides as something else than it is has its own mesh to be seen, too.
    """
    made = bodies(assembly, links, GEOMS, density, tolerance, resolution, convex=True)
    for _, body in made:
        _check_size(body.properties, density)
    root = document("mujoco", assembly, density, model=assembly.name or "assembly")
    xml.SubElement(root, "compiler", angle="radian")
    asset, world = xml.Element("asset"), xml.Element("worldbody")
    elements: dict[str, xml.Element] = {}
    taken: set[str] = set()
    for link, body in made:
        below = elements[link.joint.parent] if link.joint else world
        element = elements[link.name] = xml.SubElement(below, "body", name=link.name)
        if link.joint:
            _add_joint(element, link.name, link.joint)
        elif free_joint:
            xml.SubElement(element, "freejoint")
        _add_inertial(element, body.properties, density)
        for geometry in body.geometries:
            _add_geom(asset, element, geometry, taken, visuals)
        for name, colour, mesh in body.visuals(resolution) if visuals else ():
            _add_visual(asset, element, name, colour, mesh, taken)
    if len(asset):
        root.append(asset)
    root.append(world)
    write_document(root, path, assembly, made)


def _check_size(properties: MassProperties, density: float) -> None:
    """MuJoCo refuses what hardly resists being turned."""
    smallest = float(np.linalg.eigvalsh(properties.inertia).min()) * density
    if smallest < SMALLEST_INERTIA:
        raise UnitError(
            f"the assembly is too small for MuJoCo: its inertia is {smallest:.2g} kg m2, expected at least "
            f"{SMALLEST_INERTIA:g}; is its unit right? If it is, scale the assembly up"
        )


def _add_inertial(body: xml.Element, properties: MassProperties, density: float) -> None:
    inertia = properties.inertia * density
    six = (*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2])
    mass = numbers([properties.mass(density)])
    xml.SubElement(body, "inertial", pos=numbers(properties.centre), mass=mass, fullinertia=numbers(six))


def _add_joint(body: xml.Element, name: str, joint: Joint) -> None:
    """A body's place in its parent's frame, and how it may move there."""
    body.set("pos", numbers(joint.origin))
    if joint.kind == "fixed":
        return
    kind = "slide" if joint.kind == "prismatic" else "hinge"
    about = {"name": f"{name} joint", "type": kind, "axis": numbers(joint.axis)}
    if joint.limits is not None:
        about |= {"limited": "true", "range": numbers(joint.limits)}
    xml.SubElement(body, "joint", about)


def _add_mesh(asset: xml.Element, name: str, mesh: trimesh.Trimesh) -> None:
    """In the file itself. MuJoCo centres it by its measure as a shell, for a thin hull has no volume."""
    vertices, faces = mesh.vertices.ravel(), mesh.faces.ravel()
    xml.SubElement(
        asset,
        "mesh",
        name=name,
        inertia="shell",
        vertex=numbers(vertices),
        face=" ".join(map(str, faces.tolist())),
    )


def _add_geom(asset: xml.Element, body: xml.Element, geom: Geometry, taken: set[str], visuals: bool) -> None:
    """What collides; where something else is to be seen in its place, of the group that viewers hide."""
    name = free_name(geom.name, taken)
    look = {"rgba": numbers([*geom.colour, 1.0])}
    if visuals and not geom.exact:
        look |= {"group": HIDDEN}
    if geom.part is None:
        assert geom.mesh is not None
        _add_mesh(asset, name, geom.mesh)
        xml.SubElement(body, "geom", {"name": name, "type": "mesh", "mesh": name} | look)
        return
    field = geom.part.field
    place = {"pos": numbers(geom.part.translation), "quat": numbers(geom.part.rotation)}
    size = numbers(geom_size(field))
    xml.SubElement(body, "geom", {"name": name, "type": field.kind, "size": size, **place} | look)


def _add_visual(
    asset: xml.Element,
    body: xml.Element,
    piece: str,
    colour: np.ndarray,
    mesh: trimesh.Trimesh,
    taken: set[str],
) -> None:
    """What is seen of a piece, and neither collides nor weighs."""
    name = free_name(f"{piece} visual", taken)
    _add_mesh(asset, name, mesh)
    about = {"name": name, "type": "mesh", "mesh": name, "rgba": numbers([*colour, 1.0])}
    apart = {"group": SEEN, "contype": "0", "conaffinity": "0", "mass": "0"}
    xml.SubElement(body, "geom", about | apart)


def geom_size(field: Field) -> tuple[float, ...]:
    """MuJoCo's `size` of one of `GEOMS`: half the sides, or radius and half the height."""
    match field:
        case Box(size=(x, y, z)):
            return x / 2, y / 2, z / 2
        case Cylinder(radius=radius, height=height) | Capsule(radius=radius, height=height):
            return radius, height / 2
        case Sphere(radius=radius):
            return (radius,)
        case Ellipsoid(radii=radii):
            return radii
    raise AssertionError(f"{field.kind} is not among GEOMS")


FORMAT = Format("MJCF", write, frozenset({Holds.NAMES, Holds.EXACT, Holds.LEARNED}), lengths="metres", up="z")
