"""3MF, for printers: the blended surface as one object, or a named, coloured object a part.

Z is up, as far as the up axis is known. The unit is the assembly's own; 3MF must name one, so where it is
unknown the file says millimetres, which is 3MF's default, and its description that nobody knows.
"""

from __future__ import annotations

import dataclasses
import io
import xml.etree.ElementTree as xml
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from partwright import __version__
from partwright.approximation.pieces import piece_meshes, whole_surface
from partwright.assembly import Assembly
from partwright.atomic_io import write_bytes
from partwright.export.axes import to_metres_z_up
from partwright.export.formats import Format, Holds
from partwright.shapes import canonical_unit

if TYPE_CHECKING:
    import trimesh

UNITS = {"um": "micron", "mm": "millimeter", "cm": "centimeter", "m": "meter", "in": "inch", "ft": "foot"}
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_TYPES = (
    f'<Types xmlns="{_PACKAGE}/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    "</Types>"
)
_RELATIONS = (
    f'<Relationships xmlns="{_PACKAGE}/relationships"><Relationship Id="model" Target="/3D/3dmodel.model" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
_GREY = np.full(3, 0.7)
_Object = tuple[str, np.ndarray, "trimesh.Trimesh"]


def write(assembly: Assembly, path: str | Path, by_part: bool = False, resolution: int | None = None) -> None:
    """Write the package.

    by_part: an object a part, each closed by itself, instead of one for the blended surface.
    resolution: cells along the longest side, 128 if not given; with by_part along each part, 32.
    """
    unit = canonical_unit(assembly.unit) if assembly.unit else "mm"
    turn = dataclasses.replace(to_metres_z_up(assembly), scale=1.0)
    objects = _objects(assembly.transformed(turn), by_part, resolution)
    model = _model(assembly, UNITS[unit], objects)
    xml.indent(model)
    files = {
        "[Content_Types].xml": _TYPES.encode(),
        "_rels/.rels": _RELATIONS.encode(),
        "3D/3dmodel.model": xml.tostring(model, encoding="utf-8", xml_declaration=True),
    }
    package = io.BytesIO()
    with zipfile.ZipFile(package, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():  # at a fixed date, so that the same assembly gives the same bytes
            archive.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
    write_bytes(path, package.getvalue())


def _objects(assembly: Assembly, by_part: bool, resolution: int | None) -> list[_Object]:
    """Name, colour and mesh of each."""
    if by_part:
        found = piece_meshes(assembly, resolution or 32)
        return [(piece.name, piece.colour, mesh) for piece, mesh in found]
    return [(assembly.name or "assembly", _GREY, whole_surface(assembly, resolution or 128))]


def _model(assembly: Assembly, unit: str, objects: list[_Object]) -> xml.Element:
    model = xml.Element("model", {"unit": unit, "xml:lang": "en-US", "xmlns": _CORE})
    about = {"Title": assembly.name, "Application": f"Partwright {__version__}"}
    if assembly.unit is None:
        about["Description"] = f"The length unit is unknown; {unit} is the format's default."
    for name, text in about.items():
        if text:
            xml.SubElement(model, "metadata", name=name).text = text
    resources, build = xml.SubElement(model, "resources"), xml.SubElement(model, "build")
    materials = xml.SubElement(resources, "basematerials", id="1")
    for i, (name, colour, mesh) in enumerate(objects):
        code = "#" + bytes(np.round(255 * colour).astype(np.uint8)).hex().upper()
        xml.SubElement(materials, "base", name=name, displaycolor=code)
        about = {"id": str(i + 2), "name": name, "type": "model", "pid": "1", "pindex": str(i)}
        _add_mesh(xml.SubElement(resources, "object", about), mesh)
        xml.SubElement(build, "item", objectid=str(i + 2))
    return model


def _add_mesh(parent: xml.Element, mesh: trimesh.Trimesh) -> None:
    element = xml.SubElement(parent, "mesh")
    for kind, single, keys, rows in (
        ("vertices", "vertex", "xyz", mesh.vertices),
        ("triangles", "triangle", ("v1", "v2", "v3"), mesh.faces),
    ):
        group = xml.SubElement(element, kind)
        for row in np.asarray(rows).tolist():
            xml.SubElement(group, single, dict(zip(keys, map(repr, row), strict=True)))


FORMAT = Format("3MF", write, frozenset({Holds.BLENDS, Holds.LEARNED}), up="z", units=tuple(UNITS))
