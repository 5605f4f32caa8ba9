"""What the tables of PartSDF share: how a reconstruction is made, scored, kept on disk and written down."""

from __future__ import annotations

import argparse
import csv
import shlex
import sys
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
import torch

from partwright.datasets.prepared import PreparedFamily, PreparedShape
from partwright.errors import NoSurfaceError
from partwright.meshing import mesh_field
from partwright.metrics.reconstruction import ReconstructionScores, mean_scores, reconstruction_scores
from partwright.partsdf.config import Config, DecoderSettings, LossSettings, TrainingSettings
from partwright.partsdf.meshing import LabelledSurface, labelled_surface, mesh_shape
from partwright.partsdf.model import Model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import (
    ReconstructionSettings,
    reconstruct,
    reconstruct_unknown,
)
from partwright.partsdf.targets import Target
from partwright.partsdf.training import train
from partwright.shapes.distance import MeshDistance

RESULTS = Path(__file__).parent / "results"
# The paper's network, as configs/NAME-paper.toml have it.
SMALL = DecoderSettings(latent=64, width=128)
LOSSES = LossSettings(latent=1e-5, ramp=20)
TRAINING = TrainingSettings(
    batch=2, points=512, rate=1e-3, latent_rate=2e-3, validate=0, checkpoint=1.0,
    accelerator="cpu", precision="bf16-mixed",
)  # fmt: skip
HEAD = [
    "| | CD x1e4 | floor | IoU % | IC | pIoU % | decided pIoU % | failed % |",
    "|---|---|---|---|---|---|---|---|",
]

How = Callable[[Model, PreparedShape, ReconstructionSettings], NeuralShape]


def known(model: Model, shape: PreparedShape, settings: ReconstructionSettings) -> NeuralShape:
    """With labels and poses, where the model has parts."""
    return reconstruct(model, shape, settings)


def unknown(model: Model, shape: PreparedShape, settings: ReconstructionSettings) -> NeuralShape:
    """Without labels and poses."""
    target = Target(torch.tensor(shape.points), torch.tensor(shape.sdf))
    return reconstruct_unknown(model, target, settings)


def trained(config: Config, folder: Path) -> Model:
    """The model of a training, which goes on, or comes back, from its folder; Ctrl-C also ends the table."""
    result = train(config, folder)
    if result.outcome == "interrupted":
        raise KeyboardInterrupt
    return result.model


def score(found: NeuralShape, truth: PreparedShape, resolution: int) -> ReconstructionScores:
    """Scores of the mesh; nothing that came out is the worst, not left out."""
    try:
        surface = labelled_surface(found, mesh_shape(found, resolution, parts=False).whole)
    except NoSurfaceError:
        surface = None
    return reconstruction_scores(surface, truth)


def remeshed(truth: PreparedShape, resolution: int) -> LabelledSurface:
    """The shape itself as a mesh as fine as those of reconstructions, each face of the part that is nearest:
    what a perfect model would score."""
    faces = np.asarray(truth.faces, dtype=np.int64)
    distance = MeshDistance(np.asarray(truth.vertices, dtype=np.float64), faces, faces, closed=True)
    mesh = mesh_field(distance.signed, np.full(3, -1.0), np.full(3, 1.0), resolution)
    nearest, _ = distance.nearest(mesh.triangles_center)
    return LabelledSurface(
        np.asarray(mesh.vertices), np.asarray(mesh.faces), np.asarray(truth.label)[nearest]
    )


def measured(
    file: str, label: str, family: PreparedFamily, model: Model, how: How, arguments: argparse.Namespace
) -> list[ReconstructionScores]:
    """Scores of the first `arguments.shapes` test shapes, from partsdf-FILE.csv where it has them.

    A row there belongs to a model and a label; delete it to measure with other iterations or another
    resolution, or what was not measured yet when it was written.
    """
    path = RESULTS / f"partsdf-{file}.csv"
    names = list(ReconstructionScores.__dataclass_fields__)
    head = ["model", "how", "shape", "seconds", *names]
    rows_there = list(csv.DictReader(path.open())) if path.exists() else []
    rows_there = [{name: row.get(name) or "nan" for name in head} for row in rows_there]
    path.write_text("".join(",".join(row) + "\n" for row in (head, *(r.values() for r in rows_there))))
    done = {(r["model"], r["how"], r["shape"]): r for r in rows_there}
    settings = ReconstructionSettings(iterations=arguments.iterations, points=arguments.points)
    rows = []
    for index in family.split("test")[: arguments.shapes]:
        shape = family.load(index)
        key = (model.hash[:12], label, shape.name)
        if key not in done:
            start = time.perf_counter()
            found = how(model, shape, settings)
            seconds = time.perf_counter() - start
            scores = asdict(score(found, shape, arguments.resolution))
            row = dict(zip(("model", "how", "shape"), key, strict=True)) | {"seconds": f"{seconds:.1f}"}
            done[key] = row | {n: f"{scores[n]:.8g}" for n in names}
            with path.open("a") as out:
                out.write(",".join(done[key].values()) + "\n")
            print(", ".join(done[key].values()), flush=True)
        rows.append(done[key])
    return [ReconstructionScores(**{n: float(row[n]) for n in names}) for row in rows]


def line(label: str, scores: list[ReconstructionScores], parts: bool = True) -> str:
    """A row of a table: means; `parts`: whether IoU by parts means anything."""
    m = mean_scores(scores)
    part_iou, decided = (
        f"{100 * score:.2f}" if parts and score == score else "" for score in (m.part_iou, m.decided_part_iou)
    )
    return (
        f"| {label} | {1e4 * m.chamfer:.2f} | {1e4 * m.chamfer_floor:.2f} | {100 * m.iou:.2f} | "
        f"{m.image_consistency:.3f} | {part_iou} | {decided} | {100 * m.failed:.0f} |"
    )


def published(label: str, chamfer: float, iou: float, consistency: float, part_iou: float | None) -> str:
    """A row of the paper's, in the same form."""
    parts = "" if part_iou is None else f"{part_iou:.2f}"
    return f"| {label} | {chamfer:.2f} | | {iou:.2f} | {consistency:.3f} | {parts} | | |"


def scale_of(model: Model) -> str:
    """At what scale a model was trained, in words."""
    c, t = model.config.decoder, model.config.training
    return (
        f"{len(model.shapes)} shapes, width {c.width}, latent {c.latent}, {t.epochs} epochs of {t.points} "
        f"points a shape, {t.batch} {'shape' if t.batch == 1 else 'shapes'} a step, {t.precision}"
    )


def how_measured(family: PreparedFamily, arguments: argparse.Namespace) -> str:
    """On what and how reconstructions were measured, in words."""
    return (
        f"{min(arguments.shapes, len(family.split('test')))} test shapes, {arguments.iterations} iterations "
        f"of {arguments.points:,} points, meshed at {arguments.resolution}^3; failures count as worst. "
        "Decided: without what two parts of the truth are as near to, which a perfect mesh gets wrong by "
        "chance, too."
    )


def command_line() -> str:
    """What was typed, but for where trainings are kept."""
    typed = sys.argv[1:]
    if "--work" in typed:
        at = typed.index("--work")
        typed = typed[:at] + typed[at + 2 :]
    return f"    python benchmarks/partsdf.py {shlex.join(typed)}"


def write(name: str, lines: list[str]) -> None:
    path = RESULTS / f"partsdf-{name}.md"
    path.write_text("\n".join(lines) + "\n")
    print(f"written to {path}")
