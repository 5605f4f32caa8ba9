"""One picture to parts (section 3.4, appendix H): what an image encoder sees, moved until its outline is the
picture's."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from partwright.assembly import Assembly
from partwright.atomic_io import replacing_files, write_bytes
from partwright.errors import ModelError
from partwright.export import export
from partwright.export.ply import write_mesh
from partwright.partsdf.assemblies import to_assembly
from partwright.partsdf.image_encoder import ImageEncoder, load_image_encoder
from partwright.partsdf.meshing import mesh_shape, resolution_for_wall
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.outline_fit import OutlineFit, fit_outline
from partwright.partsdf.photos import Looked, Photo, look_at, read_photo
from partwright.partsdf.pictures import picture
from partwright.partsdf.pinhole import Pinhole
from partwright.partsdf.standpoint import Standpoint
from partwright.partsdf.strangers import standpoint_of, warnings_of
from partwright.render import Camera, render_mesh, sheet, write_png

if TYPE_CHECKING:
    import trimesh

FILES = ("assembly.json", "parts.glb", "surface.ply", "report.json", "preview.png")
_COARSE, _FINE = 48, 112  # cells of the mesh that is moved, by the thinnest wall
_PANEL = 320  # pixels
_UNSEEN = 0.25  # of its light that is left of what is not the shape, in the preview


@dataclass(frozen=True)
class PhotoParts:
    """shape: as its family stands, unit frame; the assembly of it; the surface; what was looked at, and with
    which camera; report: as it is written."""

    shape: NeuralShape
    assembly: Assembly
    surface: trimesh.Trimesh
    looked: Looked
    camera: Camera
    report: dict[str, Any]

    @property
    def warnings(self) -> tuple[str, ...]:
        """One line where the picture may show no shape of the family, else none."""
        return tuple(self.report["warnings"])

    def save(self, folder: str | Path) -> None:
        """Write `FILES`, all or none; raises OutputError."""
        with replacing_files(folder) as staging:
            self.assembly.save(staging / "assembly.json")
            export(self.assembly, staging / "parts.glb")
            write_mesh(self.surface, staging / "surface.ply", self.assembly.unit)
            write_png(staging / "preview.png", self.preview())
            write_bytes(staging / "report.json", (json.dumps(self.report, indent=2) + "\n").encode())

    def preview(self) -> np.ndarray:
        """(H, W, 3) uint8: the picture, what is taken for the shape in it, and the parts from there and from
        beside."""
        camera = replace(self.camera, margin=0.05)
        aside = Camera(camera.azimuth + 60, 22.0, up=camera.up)
        seen = np.kron(self.looked.silhouette, np.ones((2, 2)))[..., None]
        closely = self.looked.closely
        panels = [_enlarged(one) for one in (closely, closely * np.maximum(seen, _UNSEEN))]
        size = (_PANEL, _PANEL)
        panels.append(render_mesh(self.surface, camera, size, ground=False))
        panels += [picture(self.shape, size=_PANEL, camera=view) for view in (camera, aside)]
        return sheet(panels, ("picture", "taken for the shape", "surface", "parts", "from beside"))


def reconstruct_photo(
    model: Model, path: str | Path, resolution: int | None = None, encoder: ImageEncoder | None = None
) -> PhotoParts:
    """The parts of a model that a picture shows. Seconds; what is hidden is as is usual in the family.

    resolution: cells along the unit frame of the surface's mesh, as `mesh_shape`.

    Raises:
        ModelError: the model has no image encoder.
        UnreadableFileError: the file is no picture, damaged, or its size is out of all bounds.
        EmptyShapeError: no shape is seen in it.
        NoSurfaceError: what was found has no surface.
    """
    encoder = encoder or needed_encoder(model)
    return reconstruct_seen(encoder, read_photo(path), Path(path).name, resolution)


def needed_encoder(model: Model) -> ImageEncoder:
    """The image encoder beside the model; raises ModelError where there is none."""
    encoder = load_image_encoder(model)
    if encoder is None:
        raise ModelError(
            f"{model.name} has no image encoder; make one with `parts train-encoder --from images`, or give "
            "a mesh or points"
        )
    return encoder


def reconstruct_seen(
    encoder: ImageEncoder, photo: Photo, name: str = "", resolution: int | None = None
) -> PhotoParts:
    """As `reconstruct_photo`, of a photo in memory. name: of its file."""
    start, model = time.perf_counter(), encoder.model
    looked = look_at(encoder, photo)
    sight, seen = looked.sight, time.perf_counter()
    standpoint, fit = moved_to_outline(looked)
    shape, camera, moved = fit.shape, fit.eye.camera, time.perf_counter()
    covered = round(fit.iou, 4)  # once, or a summary and a warning may round it to different percents
    meshed = mesh_shape(shape, resolution, parts=False)
    surface = meshed.whole
    report = {
        "method": "parts",
        "picture": name,
        "model": {"name": model.name, "hash": model.hash},
        "parts": shape.names(),
        "absent": [part for part in model.parts if part not in shape.names()],
        "camera": {
            "azimuth": round(camera.azimuth % 360, 1),
            "elevation": round(camera.elevation, 1),
            "field_of_view": camera.field_of_view,
        },
        "silhouette_iou": covered,
        "silhouette_iou_as_seen": round(standpoint.iou, 4),
        "certainty": round(sight.certainty, 4),
        "oddness": round(sight.oddness, 4),
        "doubt": round(sight.doubt, 4),
        "likeness": round(sight.likeness - encoder.usual, 4),
        "mirrored_iou": round(looked.mirrored, 4),
        "resolution": meshed.resolution,
        "seconds": {
            "see": round(seen - start, 3),
            "fit": round(moved - seen, 3),
            "mesh": round(time.perf_counter() - moved, 3),
        },
        "warnings": warnings_of(encoder, looked, covered),
    }
    assembly = to_assembly(shape, up=model.up, source=name)
    return PhotoParts(shape, assembly, surface, looked, camera, report)


def moved_to_outline(looked: Looked) -> tuple[Standpoint, OutlineFit]:
    """Where what was seen is seen from, and the shape, moved until its outline is the picture's.

    Raises NoSurfaceError where nothing has a surface.
    """
    shape = looked.sight.shape
    coarse = mesh_shape(shape, min(_FINE, resolution_for_wall(shape.thinnest, _COARSE)))
    standpoint = standpoint_of(looked, coarse.whole)
    filling = Pinhole.filling(standpoint.camera, coarse.whole.vertices, looked.covered.box)
    return standpoint, fit_outline(shape, coarse.parts, looked.covered, filling)


def _enlarged(picture: np.ndarray) -> np.ndarray:
    from PIL import Image

    levels = Image.fromarray(np.rint(255 * picture).astype(np.uint8))
    return np.asarray(levels.resize((_PANEL, _PANEL), Image.Resampling.BICUBIC))
