"""What formats of rigid bodies share: one body, its geometries, mass and inertia."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as xml
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.approximation.change import Change
from partwright.approximation.collision import Geometry, geometries
from partwright.approximation.pieces import piece_mesh, pieces
from partwright.atomic_io import write_bytes
from partwright.export.axes import to_metres_z_up, unknowns
from partwright.export.export_report import write_report
from partwright.export.links import Link, links_of, placed
from partwright.fields import Field
from partwright.meshing.mass import MassProperties, check_density, mass_properties
from partwright.shapes import METRES, canonical_unit

if TYPE_CHECKING:
    import numpy as np
    import trimesh

    from partwright.assembly import Assembly, Similarity

DENSITY = 1000.0  # kg/m3: water


@dataclass(frozen=True)
class Body:
    """An assembly as a robotics format takes it; `properties` are those of the blended surface."""

    assembly: Assembly
    geometries: list[Geometry]
    changes: list[Change]
    properties: MassProperties
    density: float
    metres: bool
    """Whether it is in metres, as far as the assembly's unit is known; else in the assembly's own unit."""
    local: Assembly
    """The assembly in the format's unit and axes."""
    place: Similarity
    """From the assembly's own frame to the format's."""

    @classmethod
    def of(
        cls,
        assembly: Assembly,
        kinds: Sequence[type[Field]],
        density: float,
        tolerance: float,
        resolution: int,
        *,
        convex: bool,
        frame: Callable[[Assembly], Similarity] = to_metres_z_up,
    ) -> Body:
        """The arguments are those of `geometries`; density: in kg/m3. frame: from the assembly's axes to the
        format's.

        Raises:
            ParameterError: the density is not a positive number, or the tolerance none of at least 0.
            NothingToExportError: no piece has a volume.
        """
        check_density(density)
        place = frame(assembly)
        local = assembly.transformed(place)
        found, changes = geometries(
            local, kinds, tolerance, resolution, convex=convex, length=1 / place.scale
        )
        metres = assembly.unit is None or place.scale == METRES[canonical_unit(assembly.unit)]
        return cls(assembly, found, changes, mass_properties(local), density, metres, local, place)

    def visuals(self, resolution: int) -> list[tuple[str, np.ndarray, trimesh.Trimesh]]:
        """Name, colour and own mesh of each piece that collides as something else than it is."""
        other = {geometry.piece for geometry in self.geometries if not geometry.exact}
        return [
            (piece.name, piece.colour, piece_mesh(piece, resolution, lean=True))
            for piece in pieces(self.local, separate=True)
            if piece.name in other
        ]

    def write_report(self, path: str | Path) -> None:
        """FILE.report.json, where something was changed."""
        write_body_report(path, self.assembly, [(Link("", self.assembly, None), self)])


def bodies(
    assembly: Assembly,
    links: bool,
    kinds: Sequence[type[Field]],
    density: float,
    tolerance: float,
    resolution: int,
    *,
    convex: bool,
) -> list[tuple[Link, Body]]:
    """A body for each link, a parent before its children; joints are in metres with Z up.

    Raises:
        What `links_of` and `Body.of` raise.
    """
    result = []
    for link in links_of(assembly, links):
        body = Body.of(link.assembly, kinds, density, tolerance, resolution, convex=convex)
        joint = placed(link.joint, body.place) if link.joint else None
        result.append((dataclasses.replace(link, joint=joint), body))
    return result


def document(tag: str, assembly: Assembly, density: float, **attributes: str) -> xml.Element:
    """An XML document's root, with what is to be known of it as comments."""
    root = xml.Element(tag, attributes)
    for text in (f"Partwright {__version__}; density {density:g} kg/m3", *unknowns(assembly)):
        root.append(xml.Comment(f" {text} "))
    return root


def write_document(
    root: xml.Element, path: str | Path, assembly: Assembly, made: Sequence[tuple[Link, Body]]
) -> None:
    """Write the document, and FILE.report.json where something was changed."""
    xml.indent(root)
    write_bytes(path, xml.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
    write_body_report(path, assembly, made)


def write_body_report(path: str | Path, assembly: Assembly, made: Sequence[tuple[Link, Body]]) -> None:
    """FILE.report.json, where something was changed: with the mass of the body, or of each link."""
    changes = [change for _, body in made for change in body.changes]
    unit = "m" if assembly.unit else None
    masses = {link.name: body.properties.to_dict(unit, body.density) for link, body in made if body.metres}
    more: dict[str, Any] = {}
    if masses:
        more["mass_properties"] = masses if len(made) > 1 else next(iter(masses.values()))
    write_report(assembly, path, changes, unknowns(assembly), **more)


def numbers(values: Iterable[float]) -> str:
    """As XML attributes hold them."""
    return " ".join(f"{value:.9g}" for value in values)
