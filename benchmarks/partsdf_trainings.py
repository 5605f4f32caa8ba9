"""The trainings of the models that ship, a row each, from their logs and from the models as they ship."""

from __future__ import annotations

import argparse
import csv

from partsdf_scores import RESULTS, command_line, scale_of, write

from partwright.partsdf.model import load_model

HEAD = [
    "# PartSDF: the models that ship", "",
    "Trained by `partwright parts train configs/NAME.toml --half`, on one core, vehicles on an H200 GPU "
    "beside five other trainings; those of NAME-first are what NAME begins with. Errors are means "
    "over the last epoch's samples, clamped at 0.1 of the unit frame (longest side 1.8); IoUs those "
    "of the first held-out shape, reconstructed with known parts, at samples near the surface that "
    "were not fitted. Minutes are by the clock, whatever else ran. Logs: partsdf-training-NAME.csv.", "",
]  # fmt: skip
COLUMNS = [
    "| | trained on | minutes | whole | part | overlap | IoU % | pIoU % | file, MB |",
    "|---|---|---|---|---|---|---|---|---|",
]


def trainings(arguments: argparse.Namespace) -> None:
    """FOLDER holds trainings by name, as `parts train ... --half` leaves them; keeps their logs, too."""
    lines = [*HEAD, command_line(), "", *COLUMNS]
    for folder in sorted(arguments.models.iterdir()):
        log = (folder / "log.csv").read_text()
        (RESULTS / f"partsdf-training-{folder.name}.csv").write_text(log)
        last = list(csv.DictReader(log.splitlines()))[-1]
        row = {name: float(value) for name, value in last.items()}
        file = folder / "model-half.safetensors"
        lines.append(
            f"| {folder.name} | {scale_of(load_model(file))} | {row['seconds'] / 60:.0f} | "
            f"{row['whole']:.4f} | {row['part']:.4f} | {row['inter']:.4f} | {100 * row['val_iou']:.1f} | "
            f"{100 * row['val_part_iou']:.1f} | {file.stat().st_size / 1e6:.2f} |"
        )
    write("training", lines)
