"""How a running training does on shapes that it does not see: errors, IoUs, and a picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import torch

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.metrics.iou import occupancy_iou
from partwright.partsdf.config import Config
from partwright.partsdf.losses import clamped_error
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.pictures import picture, target_picture
from partwright.partsdf.reconstruction import ReconstructionSettings, reconstruct
from partwright.render import Camera, sheet, write_png

ITERATIONS, PANEL = 150, 240
HELD_OUT = 5  # every fifth sample is measured at, not fitted to


class Validation:
    """The first shapes of the validation split (of the test split where there is none)."""

    def __init__(self, config: Config, family: PreparedFamily, folder: Path) -> None:
        indices = family.split("validation") if not config.training.validation else []
        indices = (indices or family.split("test"))[: config.training.validate_shapes]
        self._shapes = [family.load(i) for i in indices] if config.training.validate else []
        self._folder, self._camera = folder, Camera(up=family.up)

    def run(self, model: Model, epoch: int) -> tuple[dict[str, float], np.ndarray | None]:
        """Scores for the log, and the picture, which is also written to validation_EPOCH.png."""
        if not self._shapes:
            return {}, None
        settings = ReconstructionSettings(iterations=ITERATIONS)
        scores, panels = [], []
        for shape in self._shapes:
            held = np.arange(len(shape.sdf)) % HELD_OUT == 0
            found = reconstruct(model, _rows(shape, ~held), settings)
            scores.append(_scores(found, _rows(shape, held)))
            panels.append(target_picture(shape, PANEL, self._camera))
            panels.append(picture(found, None, PANEL, self._camera))
        page = sheet(panels, columns=2)
        write_png(self._folder / f"validation_{epoch:05d}.png", page)
        return {name: float(np.mean([s[name] for s in scores])) for name in scores[0]}, page


def _rows(shape: PreparedShape, rows: np.ndarray) -> PreparedShape:
    return replace(shape, points=shape.points[rows], sdf=shape.sdf[rows], part=shape.part[rows])


def _scores(found: NeuralShape, shape: PreparedShape) -> dict[str, float]:
    """Clamped error and IoUs of occupancies at samples, which crowd around the surface."""
    each = found.part_distances(shape.points)
    whole, inside = found.whole(each), shape.sdf < 0
    plain = replace(found.model.config.losses, hard=0.0)
    error = clamped_error(torch.from_numpy(whole), torch.from_numpy(shape.sdf), plain).mean()
    numbers = np.flatnonzero(found.present.numpy())
    owner = np.where(whole < 0, numbers[each.argmin(axis=0)], -1)
    target = np.where(inside, shape.part if len(found.present) > 1 else 0, -1)
    parts = [occupancy_iou(owner == p, target == p) for p in numbers]
    return {
        "val_error": float(error),
        "val_iou": occupancy_iou(whole < 0, inside),
        "val_part_iou": float(np.mean(parts)),
    }
