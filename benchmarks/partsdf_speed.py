"""How fast PartSDF is beside a plain implementation: training steps, reconstruction, meshing, memory.

One thread by processor time. The plain implementation (partwright/partsdf/paper.py, a convolution as
cross-part layer, dense grid) is timed on slices and extrapolated, as the table says. Each way runs in a
process of its own: this file, run with the way's name, prints what it measured.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
from collections.abc import Callable
from types import SimpleNamespace

import torch
from partsdf_scores import SMALL, command_line, write

from partwright.partsdf.autodecoder import AutoDecoder
from partwright.partsdf.config import Config, DecoderSettings, LossSettings, TrainingSettings
from partwright.partsdf.decoder import Decoder
from partwright.partsdf.gradient_accumulation import backward
from partwright.partsdf.losses import latent_penalty, terms
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.paper import ReferenceDecoder, dense_grid
from partwright.partsdf.poses import identity

PAPER = DecoderSettings()
PARTS, SLICE, GRID = 4, 1024, 256  # parts of a mixer, points of a slice, cells along the grid
ROUNDS = 3


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


def batch_step(settings: DecoderSettings, points: int, shapes: int) -> Callable[[], object]:
    """One training step of several shapes, one of them at a time in memory."""
    generator = torch.Generator().manual_seed(0)
    model = AutoDecoder(shapes, PARTS, settings)
    config = Config("", "batch", decoder=settings, training=TrainingSettings(batch=shapes, at_once=1))
    places = torch.rand(shapes, points, 3, generator=generator) * 2 - 1
    sdf = 0.1 * torch.randn(shapes, points, generator=generator)
    part = torch.randint(PARTS, (shapes, points), generator=generator)
    poses = identity(PARTS).map(lambda t: t.expand(shapes, *t.shape))
    fabric = SimpleNamespace(backward=torch.Tensor.backward)
    return lambda: backward(fabric, model, torch.arange(shapes), (places, sdf, part), poses, config, 0)


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
    if kind == "batch step memory":
        seconds = timed(batch_step(settings, 8192, 3), 1)
    elif "step" in kind:
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
            "dense": surfaces.dense, "lipschitz": shape.model.lipschitz,
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
    command = [sys.executable, __file__, way, *(["--model", model] if model else [])]
    return dict(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))


def speed(arguments: argparse.Namespace) -> None:
    lines = [
        "# PartSDF: speed", "",
        "Processor seconds of one thread. The plain implementation (partsdf/paper.py) is timed "
        "on slices and extrapolated: a step from 3 times 1,024 points of one shape, a reconstruction from 3 "
        "iterations, the grid from 1/64 of its points. So are the steps and iterations of ours, in turns, "
        f"the fastest of {ROUNDS}; our meshes are whole.", "", command_line(), "",
        "| | plain, s | ours, s | times | other ways of ours |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for name, (*ways, width) in WAYS.items():
        # In turns, and the fastest of each: other work on the machine slows one of them more than another.
        rounds = [[child(f"{way}@{width}") for way in ways] for _ in range(ROUNDS)]
        total = [min(m["seconds"] * m["whole"] for m in way) for way in zip(*rounds, strict=True)]
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
            f"{ours['dense'] / ours['evaluations']:.1f} times fewer; Lipschitz {ours['lipschitz']:.2f} |"
        )
        print(lines[-1], flush=True)
    for width in ("512", "128"):
        plain, ours = (child(f"{way}@{width}")["bytes"] for way in ("plain step memory", "step memory"))
        lines.append(
            f"| memory of a step of one shape, width {width}, MB | {plain / 1e6:.0f} | {ours / 1e6:.0f} | "
            f"{plain / ours:.1f} | |"
        )
        print(lines[-1], flush=True)
    plain, ours = (child(f"{way}@512")["bytes"] for way in ("plain step memory", "batch step memory"))
    lines.append(
        f"| memory of a step, paper's size, MB | {16 * plain / 1e6:.0f}, 16 times one shape's | "
        f"{ours / 1e6:.0f} | {16 * plain / ours:.0f} | `at_once = 1`: the gradient of the whole batch |"
    )
    print(lines[-1], flush=True)
    write("speed", lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("way")
    parser.add_argument("--model")
    arguments = parser.parse_args()
    print(json.dumps(measure(arguments.way, arguments.model)))


if __name__ == "__main__":
    main()
