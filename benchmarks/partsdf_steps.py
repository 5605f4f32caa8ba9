"""Our decoder beside the paper's network, as small as both are trained here: a step, and a mesh at 256^3.

    python benchmarks/partsdf_steps.py

A step is of four training shapes, 512 points each, forward, backward and Adam; points lie in and around the
parts' cuboids, as most samples of a training do. The paper's network is that of configs/NAME-paper.toml (for
vehicles as for cars), in single precision. Processor seconds of one thread, in turns, the least of five; the
ratios hold on a busy machine, too.
Table: benchmarks/results/partsdf-steps.md.
"""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import torch
from partsdf_scores import write

from partwright.partsdf.autodecoder import AutoDecoder
from partwright.partsdf.config import Config, read_config
from partwright.partsdf.gradient_accumulation import backward
from partwright.partsdf.local import LocalDecoder
from partwright.partsdf.meshing import mesh_shape
from partwright.partsdf.model import Model, load_model
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import rotation_matrices

CONFIGS = Path(__file__).parents[1] / "configs"
NAMES, BATCH, POINTS, ROUNDS, RESOLUTION = ("cars", "chairs", "mixers", "vehicles"), 4, 512, 5, 256


PAPERS = {"vehicles": "cars"}  # whose configuration has the paper's network, where a family has none


class Steps:
    """Steps of one decoder on the first shapes of a model."""

    def __init__(self, model: Model, config: Config) -> None:
        torch.manual_seed(0)
        self.config, self.shapes = config, torch.arange(BATCH)
        self.poses = model.poses.map(lambda t: t[:BATCH])
        self.network = AutoDecoder(BATCH, len(model.parts), config.decoder)
        if isinstance(self.network.decoder, LocalDecoder):
            self.network.decoder.fit_room(model.room / 1.05)
        self.optimiser = torch.optim.Adam(self.network.parameters(), fused=True)
        part = torch.randint(len(model.parts), (BATCH, POINTS))
        one = torch.arange(BATCH)[:, None]
        turn, scale = rotation_matrices(self.poses.rotation)[one, part], self.poses.scale[one, part]
        local = 1.2 * (2 * torch.rand(BATCH, POINTS, 3) - 1) * scale
        points = (turn @ local[..., None])[..., 0] + self.poses.translation[one, part]
        self.drawn = points, 0.05 * torch.randn(BATCH, POINTS), part

    def seconds(self) -> float:
        fabric = SimpleNamespace(backward=torch.Tensor.backward, world_size=1)
        start = time.process_time()
        self.optimiser.zero_grad()
        backward(fabric, self.network, self.shapes, self.drawn, self.poses, self.config, 0)
        self.optimiser.step()
        return time.process_time() - start


def main() -> None:
    torch.set_num_threads(1)
    lines = [
        "# PartSDF: steps and meshes of our decoder", "", *(__doc__ or "").splitlines()[2:-1], "",
        "| | paper's step, ms | ours, ms | share | mesh at 256^3, s |", "|---|---|---|---|---|",
    ]  # fmt: skip
    for name in NAMES:
        model = load_model(name)
        paper = read_config(CONFIGS / f"{PAPERS.get(name, name)}-paper.toml")
        ours = replace(paper, decoder=model.config.decoder, losses=model.config.losses)
        both = Steps(model, paper), Steps(model, ours)
        rounds = [[steps.seconds() for steps in both] for _ in range(ROUNDS + 1)][1:]
        theirs, mine = (min(each) for each in zip(*rounds, strict=True))
        start = time.process_time()
        mesh_shape(NeuralShape.trained(model, "0"), RESOLUTION, parts=False)
        meshed = time.process_time() - start
        lines.append(
            f"| {name} | {1e3 * theirs:.1f} | {1e3 * mine:.1f} | {mine / theirs:.2f} | {meshed:.1f} |"
        )
        print(lines[-1], flush=True)
    write("steps", lines)


if __name__ == "__main__":
    main()
