"""PartSDF measured: speed against a plain implementation, reconstruction of held-out shapes, ablations.

    python benchmarks/partsdf.py speed [--model MODEL]
    python benchmarks/partsdf.py reconstruct --family FOLDER --model MODEL [--config CONFIG] [--shapes N]
    python benchmarks/partsdf.py ablations --family FOLDER [--epochs N] [--shapes N]
    python benchmarks/partsdf.py training --models FOLDER
    python benchmarks/partsdf.py robots --parts FOLDER [--epochs N]

`speed` times one thread by processor time. The plain implementation (partwright/partsdf/reference.py, a
convolution as cross-part layer, dense grid) is timed on slices and extrapolated, as the table says.
`training` tables trainings in FOLDER/mixers, chairs and cars, and keeps their logs.
`reconstruct` with CONFIG also trains the same on all parts as one ("1P"), in --work, for a row of its own.
`reconstruct` and `ablations` keep every shape's scores in benchmarks/results/partsdf-*.csv and skip those
that are there, so that they can be stopped and go on. Tables go to benchmarks/results/partsdf-*.md.
"""

from __future__ import annotations

import argparse
import csv
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import torch

from partwright.datasets.prepared import PreparedFamily
from partwright.errors import NoSurfaceError
from partwright.metrics.reconstruction import ReconstructionScores, mean_scores, reconstruction_scores
from partwright.partsdf.config import (
    Config,
    DecoderSettings,
    LossSettings,
    TrainingSettings,
    read_config,
)
from partwright.partsdf.decoder import Decoder
from partwright.partsdf.losses import latent_penalty, terms
from partwright.partsdf.meshing import labelled_surface, mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.reconstruction import (
    ReconstructionSettings,
    Target,
    reconstruct,
    reconstruct_unknown,
)
from partwright.partsdf.reference import ReferenceDecoder, dense_grid
from partwright.partsdf.training import train

RESULTS = Path(__file__).parent / "results"
PAPER = DecoderSettings()
SMALL = DecoderSettings(latent=64, width=128)
# As configs/ has it for the models that ship.
LOSSES = LossSettings(latent=1e-5, ramp=20)
TRAINING = TrainingSettings(
    batch=2, points=512, rate=1e-3, latent_rate=2e-3, validate=0, checkpoint=1.0,
    accelerator="cpu", precision="bf16-mixed",
)  # fmt: skip
PARTS, SLICE, GRID = 4, 1024, 256  # parts of a mixer, points of a slice, cells along the grid
TABLE = ("chamfer", "iou", "image_consistency", "part_iou")


# --- speed ---------------------------------------------------------------------------------------------


def processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def timed(work: Callable[[], object], times: int) -> float:
    """Processor seconds of one call, after one that does not count."""
    work()
    start = processor_seconds()
    for _ in range(times):
        work()
    return (processor_seconds() - start) / times


def step_of(
    decoder: torch.nn.Module, settings: DecoderSettings, points: int, half: bool
) -> Callable[[], object]:
    """One training step of one shape."""
    generator = torch.Generator().manual_seed(0)
    latents = torch.randn(1, PARTS, settings.latent, generator=generator).requires_grad_()
    local = torch.randn(1, PARTS, points, 3, generator=generator)
    sdf = 0.1 * torch.randn(1, points, generator=generator)
    part = torch.randint(PARTS, (1, points), generator=generator)

    def step() -> None:
        with torch.autocast("cpu", torch.bfloat16, enabled=half):
            distances = decoder(latents, local).float()
        losses = LossSettings()
        total = terms(distances, sdf, part, losses, settings).total(losses)
        (total + latent_penalty(latents, losses, 100)).backward()

    return step


def iteration_of(
    decoder: torch.nn.Module, settings: DecoderSettings, points: int, frozen: bool
) -> Callable[[], object]:
    """One step of a reconstruction: as in training, with weights that need no derivatives if `frozen`."""
    decoder.requires_grad_(not frozen)
    return step_of(decoder, settings, points, half=False)


def measure(way: str, model: str | None) -> dict[str, float]:
    """Seconds of a slice, how many slices make the whole, and bytes at the peak; in a process of its own."""
    torch.set_num_threads(1)
    torch.manual_seed(0)
    start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    kind, _, width = way.partition("@")
    settings = PAPER if width == "512" else SMALL
    plain = kind.startswith("plain")
    parts = len(load_model(model).parts) if model else PARTS
    decoder = (ReferenceDecoder if plain else Decoder)(parts, settings)
    whole = 1.0
    if "step" in kind:
        points = 8192 if kind.endswith("memory") else SLICE
        seconds = timed(step_of(decoder, settings, points, "half" in kind), 1 if points > SLICE else 3)
        whole = 16 * 8192 / points
    elif "reconstruction" in kind:
        iterations, points = (800, 8000) if plain or "same" in kind else (400, 2048)
        seconds = timed(iteration_of(decoder, settings, points, frozen=not plain), 3)
        whole = iterations
    elif plain:
        places = torch.from_numpy(dense_grid(GRID).reshape(-1, 3)[::64])
        seconds = timed(lambda: dense_slice(decoder, parts, settings, places), 1)
        whole = 64
    else:
        assert model, "meshing is timed on a trained shape"
        shape = NeuralShape.trained(load_model(model), "0")
        before = processor_seconds()
        surfaces = mesh_shape(shape, GRID, parts=False)
        return {
            "seconds": processor_seconds() - before, "whole": 1.0, "evaluations": surfaces.evaluations,
            "dense": surfaces.dense, "slope": shape.model.slope,
        }  # fmt: skip
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - start
    return {"seconds": seconds, "whole": whole, "bytes": 1024.0 * peak}


@torch.no_grad()
def dense_slice(
    decoder: torch.nn.Module, parts: int, settings: DecoderSettings, places: torch.Tensor
) -> None:
    latents = torch.zeros(1, parts, settings.latent)
    for chunk in places.split(SLICE * 16):
        decoder(latents, chunk.expand(1, parts, -1, -1))


STEPS = ("plain step", "step", "half step")
RECONSTRUCTIONS = ("plain reconstruction", "same reconstruction", "reconstruction")
WAYS = {
    "training step, paper's size (batch 16, 8,192 points, width 512)": (*STEPS, "512"),
    "training step, small (the same points, width 128)": (*STEPS, "128"),
    "reconstruction, paper's size (800 x 8,000 points)": (*RECONSTRUCTIONS, "512"),
    "reconstruction, small": (*RECONSTRUCTIONS, "128"),
}


def child(way: str, model: str | None = None) -> dict[str, float]:
    command = [sys.executable, __file__, "_measure", way, *(["--model", model] if model else [])]
    return dict(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


def speed(arguments: argparse.Namespace) -> None:
    lines = [
        "# PartSDF: speed", "",
        "Processor seconds of one thread. The plain implementation (partsdf/reference.py) is timed "
        "on slices and extrapolated: a step from 3 times 1,024 points of one shape, a reconstruction from 3 "
        "iterations, the grid from 1/64 of its points. So are the steps and iterations of ours; our meshes "
        "are whole.", "", f"    python benchmarks/partsdf.py {' '.join(sys.argv[1:])}", "",
        "| | plain, s | ours, s | times | other ways of ours |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for name, (*ways, width) in WAYS.items():
        plain, ours, other = (child(f"{way}@{width}") for way in ways)
        total = [m["seconds"] * m["whole"] for m in (plain, ours, other)]
        about = "bfloat16" if "half" in ways[2] else "defaults, 400 x 2,048 points"
        lines.append(
            f"| {name} | {total[0]:.1f} | {total[1]:.1f} | {total[0] / total[1]:.1f} | "
            f"{about}: {total[2]:.1f} ({total[0] / total[2]:.1f} times) |"
        )
        print(lines[-1], flush=True)
    if arguments.model:
        width = str(load_model(arguments.model).config.decoder.width)
        plain, ours = (child(f"{way}@{width}", arguments.model) for way in ("plain mesh", "mesh"))
        total = plain["seconds"] * plain["whole"]
        lines.append(
            f"| mesh at {GRID}^3, {arguments.model}, width {width} | {total:.1f} | {ours['seconds']:.1f} | "
            f"{total / ours['seconds']:.1f} | {ours['evaluations']:,.0f} of {ours['dense']:,.0f} points, "
            f"{ours['dense'] / ours['evaluations']:.1f} times fewer; slope {ours['slope']:.2f} |"
        )
        print(lines[-1], flush=True)
    for width in ("512", "128"):
        plain, ours = (child(f"{way}@{width}")["bytes"] for way in ("plain step memory", "step memory"))
        lines.append(
            f"| memory of a step of one shape, width {width}, MB | {plain / 1e6:.0f} | {ours / 1e6:.0f} | "
            f"{plain / ours:.1f} | |"
        )
        print(lines[-1], flush=True)
    write("speed", lines)


# --- reconstruction ------------------------------------------------------------------------------------


def score(found: NeuralShape | None, truth: object, resolution: int) -> ReconstructionScores:
    """Scores of the mesh; nothing that came out is the worst, not left out."""
    surface = None
    if found is not None:
        try:
            mesh = mesh_shape(found, resolution, parts=False).whole
            surface = labelled_surface(found, mesh)
        except NoSurfaceError:
            surface = None
    return reconstruction_scores(surface, truth)  # type: ignore[arg-type]


def known(model: Model, shape: object, settings: ReconstructionSettings) -> NeuralShape:
    return reconstruct(model, shape, settings)  # type: ignore[arg-type]


def unknown(model: Model, shape: object, settings: ReconstructionSettings) -> NeuralShape:
    """Without labels and poses."""
    points, sdf = torch.tensor(shape.points), torch.tensor(shape.sdf)  # type: ignore[attr-defined]
    return reconstruct_unknown(model, Target(points, sdf), settings)


def measured(
    file: str,
    label: str,
    family: PreparedFamily,
    model: Model,
    how: Callable[[Model, object, ReconstructionSettings], NeuralShape],
    arguments: argparse.Namespace,
) -> list[ReconstructionScores]:
    """Scores of the test shapes, from the file where it has them."""
    path = RESULTS / f"partsdf-{file}.csv"
    names = list(ReconstructionScores.__dataclass_fields__)
    if not path.exists():
        path.write_text(",".join(["model", "how", "shape", "seconds", *names]) + "\n")
    done = {(r["model"], r["how"], r["shape"]): r for r in csv.DictReader(path.open())}
    rows = []
    for index in family.split("test")[: arguments.shapes]:
        shape = family.load(index)
        key = (model.hash[:12], label, shape.name)
        if key not in done:
            start = time.perf_counter()
            found = how(model, shape, ReconstructionSettings(iterations=arguments.iterations))
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
    m = mean_scores(scores)
    part_iou = f"{100 * m.part_iou:.2f}" if parts else ""
    return (
        f"| {label} | {1e4 * m.chamfer:.2f} | {1e4 * m.chamfer_floor:.2f} | {100 * m.iou:.2f} | "
        f"{m.image_consistency:.3f} | {part_iou} | {100 * m.failed:.0f} |"
    )


# Table 1 of the paper, on its own shapes: Ours, Ours-PC, Ours-1P.
PUBLISHED = {
    family: [
        f"| paper, its own {family}, {how} | {row[0]:.2f} | | {row[1]:.2f} | {row[2]:.3f} | {row[3]} | |"
        for how, row in zip(("known parts", "from points", "1P"), rows, strict=True)
    ]
    for family, rows in {
        "cars": ((1.27, 98.02, 0.931, 94.89), (1.28, 97.95, 0.930, 94.25), (1.37, 97.41, 0.924, "")),
        "mixers": ((1.60, 94.43, 0.978, 90.42), (1.73, 83.38, 0.966, 78.61), (1.44, 95.16, 0.978, "")),
        "chairs": ((1.30, 97.17, 0.942, 93.67), (1.57, 97.09, 0.942, 88.13), (3.74, 93.78, 0.913, "")),
    }.items()
}
HEAD = [
    "| | CD x1e4 | floor | IoU % | IC | pIoU % | failed % |",
    "|---|---|---|---|---|---|---|",
]


def scale_of(model: Model) -> str:
    c, t = model.config.decoder, model.config.training
    return (
        f"{len(model.shapes)} shapes, width {c.width}, latent {c.latent}, {t.epochs} epochs of {t.points} "
        f"points a shape, {t.precision}"
    )


def reconstruction(arguments: argparse.Namespace) -> None:
    family, model = PreparedFamily(arguments.family), load_model(arguments.model)
    lines = [f"# PartSDF: reconstruction of held-out {family.name}", "",
             f"Trained on {scale_of(model)}. {min(arguments.shapes, len(family.split('test')))} test shapes, "
             f"{arguments.iterations} iterations of 2,048 points, meshed at {arguments.resolution}^3; "
             "failures count as worst.", "",
             f"    python benchmarks/partsdf.py {' '.join(sys.argv[1:])}", "", *HEAD]  # fmt: skip
    name = f"reconstruct-{family.name}"
    for label, how in (("known parts", known), ("part-agnostic", unknown)):
        lines.append(line(label, measured(name, label, family, model, how, arguments)))
    if arguments.config:
        single = one_part(arguments)
        lines.append(
            line("one part (1P)", measured(name, "one part", family, single, known, arguments), parts=False)
        )
    lines += PUBLISHED.get(family.name, [])
    write(name, lines)


def one_part(arguments: argparse.Namespace) -> Model:
    """The same training with all parts as one; it goes on, or comes back, from the folder of work."""
    config = read_config(arguments.config)
    config = replace(
        config, family=arguments.family, name=f"{config.name}-1p", one_part=True,
        training=replace(config.training, validate=0),
    )  # fmt: skip
    return train(config, arguments.work / config.name).model


# --- training ------------------------------------------------------------------------------------------


def training(arguments: argparse.Namespace) -> None:
    """A row a training, from its log and its model as it ships."""
    lines = ["# PartSDF: the models that ship", "",
             "Trained by `partwright parts train configs/NAME.toml --half`, on one core. Errors are means "
             "over the last epoch's samples, clamped at 0.1 of the unit frame (longest side 1.8); IoUs those "
             "of the first held-out shape, reconstructed with known parts, at samples near the surface that "
             "were not fitted. Logs: partsdf-training-NAME.csv.", "",
             f"    python benchmarks/partsdf.py {' '.join(sys.argv[1:])}", "",
             "| | trained on | minutes | whole | part | overlap | IoU % | pIoU % | file, MB |",
             "|---|---|---|---|---|---|---|---|---|"]  # fmt: skip
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


# --- ablations -----------------------------------------------------------------------------------------


def ablations(arguments: argparse.Namespace) -> None:
    """Tables 3, 6 (its first row) and 7 on one family, each trained the same."""
    family = PreparedFamily(arguments.family)
    training = replace(
        TRAINING, epochs=arguments.epochs, threads=arguments.threads, samples=arguments.samples
    )
    base = Config(arguments.family, "base", decoder=SMALL, losses=LOSSES, training=training)
    variants = {
        "PartSDF": base,
        "one part": replace(base, one_part=True),
        "without poses": replace(base, poses=False),
        "without modulation": replace(base, decoder=replace(SMALL, modulation=False)),
        "without cross-part layers": replace(base, decoder=replace(SMALL, cross_part=False)),
        "without L_inter": replace(base, losses=replace(base.losses, inter=0.0)),
        "softmin": replace(base, decoder=replace(SMALL, aggregation="softmin")),
        "transformer": replace(base, decoder=replace(SMALL, architecture="transformer")),
    }
    lines = [f"# PartSDF: ablations on {family.name}", "",
             f"Each trained alike: {len(family.split('train'))} shapes, width 128, latent 64, "
             f"{arguments.epochs} epochs of {TRAINING.points} points a shape. Known parts, "
             f"{arguments.iterations} iterations, meshed at {arguments.resolution}^3.", "",
             f"    python benchmarks/partsdf.py {' '.join(sys.argv[1:])}", "", *HEAD]  # fmt: skip
    for label, config in variants.items():
        if arguments.only and label not in arguments.only.split(","):
            continue
        folder = arguments.work / f"{family.name}-{label.replace(' ', '-')}"
        model = train(replace(config, name=label.replace(" ", "-")), folder).model
        lines.append(
            line(label, measured(f"ablations-{family.name}", label, family, model, known, arguments))
        )
        print(lines[-1], flush=True)
    write(f"ablations-{family.name}", lines)


# --- robots --------------------------------------------------------------------------------------------


def robots(arguments: argparse.Namespace) -> None:
    """Train on 6 of 7 robot arms, whose links are the parts; reconstruct the seventh, each in turn."""
    from partwright.datasets import prepare

    arguments.shapes = 1
    lines = ["# PartSDF: robot arms", "",
             f"Trained on six arms of seven links, {arguments.epochs} epochs, width 128; the seventh "
             f"reconstructed with known parts and without, in {arguments.iterations} iterations, meshed at "
             f"{arguments.resolution}^3.", "",
             f"    python benchmarks/partsdf.py {' '.join(sys.argv[1:])}", "", *HEAD]  # fmt: skip
    training = replace(TRAINING, epochs=arguments.epochs, threads=arguments.threads)
    for held in arguments.held.split(","):
        folder = arguments.work / f"robots-{held}"
        prepare(arguments.parts, folder / "family", samples=30_000, held_out=(held,), workers=1)
        family = PreparedFamily(folder / "family")
        config = Config(str(family.folder), f"robots-{held}", decoder=SMALL, losses=LOSSES,
                        training=training)  # fmt: skip
        model = train(config, folder / "model").model
        for label, how in (("known parts", known), ("part-agnostic", unknown)):
            scores = measured("robots", f"{held}, {label}", family, model, how, arguments)
            lines.append(line(f"{held}, {label}", scores))
            print(lines[-1], flush=True)
    write("robots", lines)


def write(name: str, lines: list[str]) -> None:
    path = RESULTS / f"partsdf-{name}.md"
    path.write_text("\n".join(lines) + "\n")
    print(f"written to {path}")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(required=True)

    def command(name: str, run: Callable[[argparse.Namespace], None]) -> argparse.ArgumentParser:
        one = commands.add_parser(name)
        one.set_defaults(run=run)
        one.add_argument("--threads", type=int, default=0, help="of PyTorch; 0 leaves its default")
        one.add_argument("--shapes", type=int, default=10_000, help="at most so many test shapes")
        one.add_argument("--iterations", type=int, default=400)
        one.add_argument("--resolution", type=int, default=256)
        one.add_argument("--epochs", type=int, default=60)
        one.add_argument("--samples", type=int, default=0, help="of each shape in training; 0 for all")
        one.add_argument("--work", type=Path, default=Path(tempfile.gettempdir()) / "partsdf-benchmark")
        return one

    command("speed", speed).add_argument("--model")
    one = command("reconstruct", reconstruction)
    one.add_argument("--family", required=True)
    one.add_argument("--model", required=True)
    one.add_argument("--config", help="of the model's training: also train and measure all parts as one")
    one = command("training", training)
    one.add_argument("--models", type=Path, required=True, help="folder of trainings")
    one = command("ablations", ablations)
    one.add_argument("--family", required=True)
    one.add_argument("--only", help="variants, separated by commas")
    one = command("robots", robots)
    one.add_argument("--parts", required=True, help="folder of arms, a folder of link meshes each")
    one.add_argument("--held", required=True, help="arms that are held out in turn, separated by commas")
    hidden = commands.add_parser("_measure")
    hidden.add_argument("way")
    hidden.add_argument("--model")
    hidden.set_defaults(run=lambda a: print(json.dumps(measure(a.way, a.model))))
    arguments = parser.parse_args()
    if getattr(arguments, "threads", 0):
        torch.set_num_threads(arguments.threads)
    arguments.run(arguments)


if __name__ == "__main__":
    main()
