"""What a fit returns, and the files it writes."""

from __future__ import annotations

import dataclasses
import json
import re
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright.assembly import Assembly
from partwright.atomic_io import finishing, replacing_files, write_bytes
from partwright.fitting.ahead import Ahead
from partwright.fitting.report import check_density_of, masses
from partwright.methods import CurvePoint
from partwright.shapes import Shape

if TYPE_CHECKING:
    import trimesh

    from partwright.cleaning import Cleaned
    from partwright.metrics import Scores

# Of an earlier result with a curve: one without it removes them.
CURVE_FILES = re.compile(r"curve_\d{2,}\.json|curve\.png")
FILES = ("assembly.json", "parts.glb", "surface.ply", "report.json", "preview.png")
CURVE_SIZES = (1, 2, 4, 8, 16, 32, 64)


@dataclass(frozen=True)
class Result:
    """What a fit returns.

    assembly: in the shape's own units and place. outcome: "converged", "budget_reached", "target_reached" or
    "interrupted". report: what report.json holds. surface: the blended surface's mesh, in the shape's units.
    curve: assemblies of falling size, whose parts name their parent in the next smaller one by
    `metadata["parent"]`. clean: what `clean=True` found, with `.relations`.
    """

    shape: Shape
    assembly: Assembly
    outcome: str
    scores: Scores
    surface: trimesh.Trimesh
    report: dict[str, Any]
    curve: tuple[CurvePoint, ...] = ()
    clean: Cleaned | None = None
    ahead: Ahead | None = field(default=None, repr=False, compare=False)
    """What `save` will write, begun already."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user should be told about the result, a sentence each; empty where it is good."""
        return tuple(self.report["warnings"])

    def with_density(self, density: float) -> Result:
        """The result whose report has the mass and its inertia, in kilograms and metres; density in kg/m3.

        Raises:
            SettingError: it is no density, or the shape's length unit is unknown.
        """
        check_density_of(density, self.shape.unit)
        weighed = {"mass_properties": masses(self.surface, self.shape, density)}
        return dataclasses.replace(self, report=self.report | weighed)

    def save(self, folder: str | Path) -> None:
        """Write assembly.json, parts.glb, surface.ply, report.json and preview.png, all or none.

        The report's seconds then say how long that took, too.

        Raises:
            OutputError: they cannot be written there.
        """
        from partwright.export.ply import write_mesh

        started = time.perf_counter()
        with finishing(), replacing_files(folder, CURVE_FILES) as staging:
            ahead = self._ahead()
            self.assembly.save(staging / "assembly.json")
            write_mesh(self.surface, staging / "surface.ply", self.assembly.unit)
            ahead.write(staging)
            if self.curve:
                self._save_curve(staging)
            self._count_writing(time.perf_counter() - started)
            write_bytes(staging / "report.json", (json.dumps(self.report, indent=2) + "\n").encode())

    def _ahead(self) -> Ahead:
        if self.ahead is not None and self.ahead.is_of(self.shape, self.assembly, self.surface):
            return self.ahead
        ahead = Ahead(self.shape, self.assembly)
        ahead.draw(self.surface)
        return ahead

    def _count_writing(self, spent: float) -> None:
        """Among the seconds, in place of those of an earlier `save`."""
        seconds: dict[str, float] = self.report["seconds"]
        before = seconds.pop("all") - seconds.pop("writing", 0.0)
        seconds |= {"writing": round(spent, 3), "all": round(before + spent, 3)}

    def _save_curve(self, folder: Path) -> None:
        """curve_NN.json for sizes that double, and a picture of them."""
        from partwright.render import curve_sheet

        shown = [p for p in self.curve if p.parts in CURVE_SIZES or p is self.curve[0]][::-1]
        for point in shown:
            point.assembly.save(folder / f"curve_{point.parts:02d}.json")
        captions = [f"{p.parts} part{'s' * (p.parts != 1)}, IoU {p.iou:.3f}" for p in shown]
        assemblies = [dataclasses.replace(p.assembly, up=self.assembly.up) for p in shown]
        curve_sheet(assemblies, captions, folder / "curve.png", title=self.shape.name)
