"""Drag: what the simulator's mesh is worth, how a network ranks cars, and gains that a simulation confirms.

    partwright parts simulate cars -o flows --count 57 --seed 20 --air y,ground,iterations=100
    python benchmarks/drag.py --flows flows --convergence --output benchmarks/results/drag.md

Training shapes of the car model that ships, which the network has not seen, get less drag by the network,
wheels frozen; OpenFOAM says what they had and have, on a finer mesh than the network has learned from, too.
--pictures FOLDER keeps their files, --cars N says how many.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

import partwright as pw
from partwright.assembly import Assembly, Similarity
from partwright.datasets.families import family
from partwright.goals import Optimised, Options
from partwright.goals.flow import Air, simulate
from partwright.goals.flow.dataset import Sample, read_all
from partwright.goals.flow.learning import scores, train
from partwright.goals.flow.surrogate import Surrogate, rank_correlation
from partwright.goals.objectives.surrogate import outside
from partwright.goals.surface import surface_of
from partwright.partsdf import NeuralShape, load_model, to_assembly

LENGTH = 4.5  # metres, of a learned car
AIR = Air("y", "z", iterations=100, time_limit=3600)
CELLS = (16, 32, 64)
SLOWER = 150  # iterations that a gain is measured with


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--flows", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--cars", type=int, default=3)
    parser.add_argument("--steps", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=120)
    parser.add_argument("--held-out", type=int, default=10)
    parser.add_argument("--convergence", action="store_true")
    parser.add_argument("--pictures", type=Path)
    arguments = parser.parse_args()
    lines = [
        "# Drag",
        "",
        f"Made by `{command(arguments)}`. Drag areas in m2: C_d times the frontal area.",
        "",
    ]
    with tempfile.TemporaryDirectory() as folder:
        lines += learned(arguments, Path(folder, "drag.safetensors"))
    if arguments.convergence:
        lines += convergence()
    text = "\n".join(lines) + "\n"
    print(text)
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")


def command(arguments: argparse.Namespace) -> str:
    extra = " --convergence" if arguments.convergence else ""
    return f"python benchmarks/drag.py --flows flows --cars {arguments.cars}{extra}"


def convergence() -> list[str]:
    """One car on three meshes."""
    body = family("cars", 1, 20)[0].whole
    body = trimesh.Trimesh(0.01 * body.vertices, body.faces, process=False)
    rows = []
    for cells in CELLS:
        with tempfile.TemporaryDirectory() as folder:
            begun = time.process_time()
            found = simulate(body, Path(folder, "case"), replace(AIR, cells=cells, iterations=SLOWER))
        rows.append((cells, found))
        print(cells, found.drag_area, time.process_time() - begun, flush=True)
    last = rows[-1][1].drag_area
    return [
        "## The simulator's mesh",
        "",
        f"One car, {SLOWER} iterations.",
        "",
        "| cells along it | drag area | from the finest | swing | last residual of p | wall seconds |",
        "|---:|---:|---:|---:|---:|---:|",
        *(
            f"| {cells} | {one.drag_area:.4f} | {one.drag_area / last - 1:+.1%} | {one.swing:.1e} | "
            f"{one.residuals.get('p', np.nan):.1e} | {one.seconds:.0f} |"
            for cells, one in rows
        ),
        "",
    ]


def learned(arguments: argparse.Namespace, path: Path) -> list[str]:
    """A network on held-out cars of the data set, and learned cars that it improves."""
    samples = sorted(read_all(arguments.flows), key=lambda one: one.name)
    tested, given = samples[: arguments.held_out], samples[arguments.held_out :]
    begun = time.process_time()
    model = train(given, rounds=arguments.rounds, mirror="x")
    seconds = time.process_time() - begun
    mean = float(np.mean([one.drag_area for one in given]))
    found = scores(model, tested, mean)
    fronts = rank(given, tested)
    model.save(path)
    lines = [
        "## The network",
        "",
        f"{len(given)} cars to learn from ({seconds:.0f} CPU seconds), {len(tested)} held out.",
        "",
        "| | R2 | mean error | rank correlation |",
        "|---|---:|---:|---:|",
        f"| network | {found.r2:.3f} | {found.error:.1%} | {found.rank:.3f} |",
        f"| hull of the front times a constant | {fronts[0]:.3f} | {fronts[1]:.1%} | {fronts[2]:.3f} |",
        f"| mean of the training | 0 | {found.floor:.1%} | - |",
        "",
        "## Cars that it improves",
        "",
        f"Training shapes of the car model that ships, {LENGTH} m long, wheels frozen, volume kept to 95 %. "
        "Wheels moved: by themselves, without the body beside them. In the whole, where the model lets parts "
        "see one another, they are held to a thousandth of the longest side (`--still`).",
        "",
        "| car | steps accepted | ending | outside | by the network | OpenFOAM, 32 cells | "
        "OpenFOAM, 64 cells | volume | wheels moved |",
        "|---|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    print("\n".join(lines), flush=True)
    for number in range(arguments.cars):
        lines.append(improved(number, path, arguments))
        print(lines[-1], flush=True)
    return [*lines, ""]


def improved(number: int, model: Path, arguments: argparse.Namespace) -> str:
    name = sorted(load_model("cars").shapes)[number]
    objective = f"surrogate_drag@{model}"
    result = pw.optimise(
        car(name),
        objective,
        bounds=["volume>=95%"],
        freeze=["wheel_*"],
        options=Options(steps=arguments.steps, resolution=48),
    )
    coarse = result.with_simulation(AIR)
    fine = result.with_simulation(replace(AIR, iterations=SLOWER, cells=64))
    if arguments.pictures:
        fine.save(arguments.pictures / f"car_{name}")
    network = Surrogate.load(model)
    far = [
        outside(network, point.surface, 1.0) for point in (result.found.points[0], result.found.points[-1])
    ]
    before, after = result.numbers[objective]
    volumes = result.numbers["volume"]
    return (
        f"| {name} | {len(result.found.points) - 1} of {len(result.found.steps) - 1} | {result.ending} | "
        f"{far[0]:.2f}, {far[1]:.2f} | {after / before - 1:+.1%} | {gain(coarse)} | {gain(fine)} | "
        f"{volumes[1] / volumes[0] - 1:+.1%} | {moved(result):.0e} |"
    )


def gain(result: Optimised) -> str:
    before, after = (result.simulated[end]["drag_area"] for end in ("before", "after"))
    return f"{before:.3f} -> {after:.3f} ({after / before - 1:+.1%})"


def moved(result: Optimised) -> float:
    """The largest distance between the wheels' surfaces before and after, as a share of the length, without
    the body, by which the model lets them be influenced."""
    ends = []
    for assembly in (result.start, result.assembly):
        wheels = Assembly(tuple(part for part in assembly.parts if part.name.startswith("wheel")))
        ends.append(surface_of(wheels, 48))
    return float(trimesh.proximity.closest_point(ends[0], ends[1].vertices)[1].max()) / LENGTH


def car(name: str) -> Assembly:
    assembly = to_assembly(NeuralShape.trained(load_model("cars"), name), up="z")
    longest = float(surface_of(assembly, 48).extents.max())
    return replace(assembly.transformed(Similarity(LENGTH / longest)), unit="m")


def rank(given: list[Sample], tested: list[Sample]) -> tuple[float, float, float]:
    """R2, mean error and rank correlation of the hull of the front times the training's mean coefficient."""
    areas = [frontal(one) for one in given]
    constant = sum(one.drag_area for one in given) / sum(areas)
    guess = np.array([constant * frontal(one) for one in tested])
    true = np.array([one.drag_area for one in tested])
    mean = np.mean([one.drag_area for one in given])
    r2 = 1 - np.square(guess - true).sum() / np.square(true - mean).sum()
    return (
        float(r2),
        float((np.abs(guess - true) / true).mean()),
        rank_correlation(guess.tolist(), true.tolist()),
    )


def frontal(sample: Sample) -> float:
    """Area of the convex hull of the body's shadow along the flow, m2."""
    return float(ConvexHull(sample.vertices[:, [0, 2]]).volume)


if __name__ == "__main__":
    main()
