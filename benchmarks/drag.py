"""Drag: what the simulator's mesh is worth, how a network ranks cars, and gains that a simulation confirms.

    partwright parts simulate cars -o flows --count 57 --seed 20 --air y,ground,iterations=100
    partwright parts prepare cars --count 300 --samples 60000 -o families/cars
    partwright parts train configs/cars-one-part.toml -o cars-one-part
    python benchmarks/drag.py --flows flows --family families/cars \\
        --one-part cars-one-part/model.safetensors --convergence --output benchmarks/results/drag.md

Held-out cars get less drag by the network, wheels frozen; OpenFOAM says what they had and have, on a finer
mesh than the network has learned from, too (drag_cars.py). Two of them also by a model without parts.
--work FOLDER keeps the network, the cars and their pictures, so that a run that was stopped goes on.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import drag_cars
import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from partwright.datasets.families import family
from partwright.goals.flow import simulate
from partwright.goals.flow.dataset import Sample, read_all
from partwright.goals.flow.learning import scores, train
from partwright.goals.flow.surrogate import rank_correlation

CELLS = (16, 32, 64)
SLOWER = 150  # iterations that a gain is measured with


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--flows", type=Path, required=True)
    parser.add_argument("--output", type=Path)
    parser.add_argument("--family", type=Path, required=True, help="prepared, of the car model")
    parser.add_argument("--cars", type=int, default=4)
    parser.add_argument("--one-part", type=Path, metavar="MODEL", help="the same training without parts")
    parser.add_argument("--one-part-cars", type=int, default=2)
    parser.add_argument("--steps", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=120)
    parser.add_argument("--held-out", type=int, default=10)
    parser.add_argument("--convergence", action="store_true")
    parser.add_argument("--work", type=Path, default=Path("build/drag"), metavar="FOLDER")
    arguments = parser.parse_args()
    arguments.work.mkdir(parents=True, exist_ok=True)
    lines = [
        "# Drag",
        "",
        f"Made by `{command(arguments)}` from `partwright parts simulate cars -o flows --count 57 --seed 20 "
        "--air y,ground,iterations=100`. Drag areas in m2: C_d times the frontal area. Widths and rates of "
        "the network were chosen on the same ten cars that are held out here.",
        "",
    ]
    path = arguments.work / "drag.safetensors"
    lines += learned(arguments, path)
    lines += drag_cars.tables(
        arguments.cars,
        arguments.one_part_cars,
        arguments.one_part,
        path,
        arguments.family,
        arguments.work,
        arguments.steps,
    )
    if arguments.convergence:
        lines += convergence()
    text = "\n".join(lines) + "\n"
    print(text)
    if arguments.output:
        arguments.output.write_text(text, encoding="utf-8")


def command(arguments: argparse.Namespace) -> str:
    extra = " --one-part cars-one-part/model.safetensors" if arguments.one_part else ""
    extra += " --convergence" if arguments.convergence else ""
    return f"python benchmarks/drag.py --flows flows --family families/cars --cars {arguments.cars}{extra}"


def convergence() -> list[str]:
    """One car on three meshes."""
    body = family("cars", 1, 20)[0].whole
    body = trimesh.Trimesh(0.01 * body.vertices, body.faces, process=False)
    rows = []
    for cells in CELLS:
        with tempfile.TemporaryDirectory() as folder:
            begun = time.process_time()
            found = simulate(
                body, Path(folder, "case"), replace(drag_cars.AIR, cells=cells, iterations=SLOWER)
            )
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
    """A network on held-out cars of the data set."""
    samples = sorted(read_all(arguments.flows), key=lambda one: one.name)
    tested, given = samples[: arguments.held_out], samples[arguments.held_out :]
    begun = time.process_time()
    model = train(given, rounds=arguments.rounds, mirror="x")
    seconds = time.process_time() - begun
    mean = float(np.mean([one.drag_area for one in given]))
    found = scores(model, tested, mean)
    fronts = rank(given, tested)
    model.save(path)
    return [
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
    ]


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
