"""A picture of a model as it learns: training shapes, and below them what it makes of them so far."""

from __future__ import annotations

import time
from pathlib import Path

from partwright.datasets.prepared import PreparedFamily
from partwright.durations import duration
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.pictures import picture, target_picture
from partwright.partsdf.training import EpochReport
from partwright.render import Camera, sheet, write_png

_SHAPES, _PANEL = 4, 240
_LEAST, _SHARE = 20.0, 0.05  # seconds between pictures, and what they may take of all time


class LivePicture:
    """Drawn anew at the end of an epoch, whenever enough time has passed; and at the last."""

    def __init__(self, path: Path, family: PreparedFamily, camera: Camera) -> None:
        trained = family.split("train")
        chosen = [trained[i * len(trained) // _SHAPES] for i in range(min(_SHAPES, len(trained)))]
        self._shapes = [family.load(i) for i in chosen]
        self._path, self._camera = path, camera
        self._above = [target_picture(shape, _PANEL, self._camera) for shape in self._shapes]
        self._due = 0.0

    def show(self, report: EpochReport) -> None:
        """Draw what has been learned, if it is time."""
        start = time.monotonic()
        if start < self._due and report.epoch < report.epochs:
            return
        model = report.model()
        below = []
        for shape in self._shapes:
            made = NeuralShape.trained(model, shape.name)
            below.append(picture(made, None, _PANEL, self._camera))
        write_png(self._path, sheet([*self._above, *below], columns=len(below), title=_said(report)))
        took = time.monotonic() - start
        self._due = start + max(_LEAST, took / _SHARE)


def _said(report: EpochReport) -> str:
    rest = f"about {duration(report.seconds_left)} left" if report.epoch < report.epochs else "done"
    return f"epoch {report.epoch} of {report.epochs}, error {report.part:.4f}, {rest}"
