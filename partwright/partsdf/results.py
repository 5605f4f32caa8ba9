"""A reconstruction with its mesh and scores, and the folder that it is written to."""

from __future__ import annotations

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from partwright import __version__
from partwright.assembly import Assembly
from partwright.atomic_io import finishing, replacing_files, write_bytes
from partwright.metrics.report import evaluate
from partwright.partsdf.assemblies import to_assembly
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import Progress, ReconstructionSettings, reconstruct
from partwright.shapes import Shape

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True)
class Reconstruction:
    """neural: the shape in the unit frame. assembly, surface: in the input's own units and place. report:
    what report.json holds."""

    shape: Shape
    neural: NeuralShape
    assembly: Assembly
    surface: trimesh.Trimesh
    report: dict[str, Any]

    def save(self, folder: str | Path) -> None:
        """Write assembly.json, parts.glb, surface.ply, report.json and preview.png, all or none.

        Raises:
            OutputError: they cannot be written there.
        """
        from partwright.export import export
        from partwright.export.ply import write_mesh
        from partwright.render import preview

        with finishing(), replacing_files(folder) as staging:
            self.assembly.save(staging / "assembly.json")
            export(self.assembly, staging / "parts.glb")
            write_mesh(self.surface, staging / "surface.ply", self.assembly.unit)
            write_bytes(staging / "report.json", (json.dumps(self.report, indent=2) + "\n").encode())
            preview(self.shape, self.assembly, self.surface, staging / "preview.png", title=self.shape.name)


def reconstruct_shape(
    model: Model,
    shape: Shape,
    settings: ReconstructionSettings | None = None,
    resolution: int | None = None,
    progress: Progress | None = None,
) -> Reconstruction:
    """Find the parts of a plain shape, mesh them at `resolution` (see `mesh_shape`) and score the whole.

    Raises:
        NoSurfaceError: what was found has no surface.
    """
    settings = settings or ReconstructionSettings()
    started = time.perf_counter()
    neural = reconstruct(model, shape, settings, progress)
    found = time.perf_counter()
    with finishing():
        assembly = to_assembly(neural, shape.frame, shape.unit, shape.up, shape.name)
        surfaces = mesh_shape(neural, resolution, parts=False)
        surface = surfaces.whole
        surface.vertices = shape.frame.from_unit(surface.vertices)
        meshed = time.perf_counter()
        scores = evaluate(assembly, shape, settings.seed, emd=False, surface=surface)
    report = {
        "version": __version__,
        "method": "partsdf",
        "model": {"name": model.name, "hash": model.hash},
        "seed": settings.seed,
        "settings": {**asdict(settings), "resolution": surfaces.resolution},
        "input": {"file": shape.name, "unit": shape.unit, "repairs": list(shape.repairs)},
        "seconds": {
            "reconstruction": round(found - started, 3),
            "meshing": round(meshed - found, 3),
            "all": round(time.perf_counter() - started, 3),
        },
        "parts": len(assembly),
        "absent": [name for name in model.parts if name not in neural.names()],
        "evaluations": {"meshing": surfaces.evaluations, "dense grid": surfaces.dense},
        "scores": scores.to_dict(),
    }
    return Reconstruction(shape, neural, assembly, surface, report)
