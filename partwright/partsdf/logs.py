"""The log of a training: a line an epoch as CSV, and the same for TensorBoard where it is installed."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from partwright.atomic_io import write_bytes

FILE = "log.csv"
COLUMNS = ("epoch", "whole", "part", "inter", "latent_norm", "rate", "seconds",
           "val_error", "val_iou", "val_part_iou")  # fmt: skip


class Log:
    """Goes on in `folder` after `epoch`: lines beyond it were written by steps that are now done again."""

    def __init__(self, folder: Path, epoch: int) -> None:
        self._path = folder / FILE
        kept = [row for row in read_log(self._path) if int(row["epoch"]) <= epoch]
        text = io.StringIO()
        writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)
        write_bytes(self._path, text.getvalue().encode())
        self._board: Any = None
        if find_spec("tensorboard"):
            from torch.utils.tensorboard import SummaryWriter

            self._board = SummaryWriter(str(folder / "tensorboard"), purge_step=epoch + 1)

    def row(self, epoch: int, values: Mapping[str, float]) -> None:
        """One line; columns without a value stay empty."""
        shown = {"epoch": epoch} | {name: f"{value:.6g}" for name, value in values.items()}
        with self._path.open("a", newline="") as file:
            csv.DictWriter(file, COLUMNS, restval="", lineterminator="\n").writerow(shown)
        if self._board:
            for name, value in values.items():
                self._board.add_scalar(name, value, epoch)
            self._board.flush()

    def picture(self, epoch: int, image: np.ndarray | None) -> None:
        """A picture (H, W, 3) uint8 for TensorBoard."""
        if self._board and image is not None:
            self._board.add_image("validation", image, epoch, dataformats="HWC")


def read_log(path: Path) -> list[dict[str, str]]:
    """The lines of a log, none where there is no file."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))
