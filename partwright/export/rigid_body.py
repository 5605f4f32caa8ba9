"""What formats of rigid bodies share: one body, its geometries, mass and inertia."""

from __future__ import annotations

import xml.etree.ElementTree as xml
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from partwright import __version__
from partwright.approximation.change import Change
from partwright.approximation.collision import Geometry, geometries
from partwright.atomic_io import write_bytes
from partwright.export.axes import to_metres_z_up, unknowns
from partwright.export.export_report import write_report
from partwright.fields import Field
from partwright.meshing.mass import MassProperties, check_density, mass_properties
from partwright.shapes import METRES, canonical_unit

if TYPE_CHECKING:
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
    metres: bool = True
    """Whether it is in metres, as far as the assembly's unit is known; else in the assembly's own unit."""

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
        return cls(assembly, found, changes, mass_properties(local), density, metres)

    @property
    def name(self) -> str:
        return self.assembly.name or "assembly"

    def root(self, tag: str, **attributes: str) -> xml.Element:
        """The document's root, with what is to be known of it as comments."""
        root = xml.Element(tag, attributes)
        about = f"Partwright {__version__}; density {self.density:g} kg/m3"
        for text in (about, *unknowns(self.assembly)):
            root.append(xml.Comment(f" {text} "))
        return root

    def write(self, root: xml.Element, path: str | Path) -> None:
        """Write the document, and FILE.report.json where something was changed."""
        xml.indent(root)
        write_bytes(path, xml.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
        self.write_report(path)

    def write_report(self, path: str | Path) -> None:
        """FILE.report.json, where something was changed."""
        unit = "m" if self.assembly.unit else None
        mass = {"mass_properties": self.properties.to_dict(unit, self.density)} if self.metres else {}
        write_report(self.assembly, path, self.changes, unknowns(self.assembly), **mass)


def numbers(values: Iterable[float]) -> str:
    """As XML attributes hold them."""
    return " ".join(f"{value:.9g}" for value in values)
