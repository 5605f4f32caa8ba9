"""MJCF, MuJoCo's format: one body, a native geom a part, the assembly's own mass and inertia.

In metres with Z up, as far as unit and up axis are known. Blends cannot be held and are dropped. MuJoCo
collides the convex hull of a mesh, so where no native geom is near enough the hull itself is written. Mass
and inertia are those of the blended surface, overlaps counted once, not the sum over the geoms.
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
from partwright.export.rigid_body import DENSITY, Body, numbers
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.meshing.mass import MassProperties

if TYPE_CHECKING:
    from partwright.assembly import Assembly

GEOMS: tuple[type[Field], ...] = (Box, Cylinder, Sphere, Capsule, Ellipsoid)
SMALLEST_INERTIA = 1e-14  # kg m2; MuJoCo's own limit is mjMINVAL, 1e-15


def write(
    assembly: Assembly,
    path: str | Path,
    density: float = DENSITY,
    tolerance: float = TOLERANCE,
    free_joint: bool = False,
    resolution: int = 24,
) -> None:
    """Write the model.

    density: in kg/m3. tolerance: how far a geom's surface may lie from its part's, as a share of the longest
    side, before a mesh stands for it. free_joint: whether the body may move; else it is fixed to the world.
    resolution: cells along a part that becomes a mesh.
    """
    made = Body.of(assembly, GEOMS, density, tolerance, resolution, convex=True)
    _check_size(made.properties, density)
    root = made.root("mujoco", model=made.name)
    xml.SubElement(root, "compiler", angle="radian")
    meshes = [geom for geom in made.geometries if geom.mesh is not None]
    asset = xml.SubElement(root, "asset") if meshes else root
    for geom in meshes:
        _add_mesh(asset, geom)
    body = xml.SubElement(xml.SubElement(root, "worldbody"), "body", name=made.name)
    if free_joint:
        xml.SubElement(body, "freejoint")
    _add_inertial(body, made.properties, density)
    for geom in made.geometries:
        _add_geom(body, geom)
    made.write(root, path)


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


def _add_mesh(asset: xml.Element, geom: Geometry) -> None:
    """In the file itself. MuJoCo centres it by its measure as a shell, for a thin hull has no volume."""
    assert geom.mesh is not None
    vertices, faces = geom.mesh.vertices.ravel(), geom.mesh.faces.ravel()
    xml.SubElement(
        asset,
        "mesh",
        name=geom.name,
        inertia="shell",
        vertex=numbers(vertices),
        face=" ".join(map(str, faces.tolist())),
    )


def _add_geom(body: xml.Element, geom: Geometry) -> None:
    rgba = numbers([*geom.colour, 1.0])
    if geom.part is None:
        xml.SubElement(body, "geom", name=geom.name, type="mesh", mesh=geom.name, rgba=rgba)
        return
    field = geom.part.field
    place = {"pos": numbers(geom.part.translation), "quat": numbers(geom.part.rotation)}
    size = numbers(geom_size(field))
    xml.SubElement(body, "geom", {"name": geom.name, "type": field.kind, "size": size, **place, "rgba": rgba})


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
