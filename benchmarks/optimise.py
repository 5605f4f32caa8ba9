"""Fitted and learned shapes improved for a goal: what was gained, what was kept, and how long a step takes.

    python benchmarks/optimise.py --shapes FOLDER --output benchmarks/results/optimise.md

--pictures docs/images also draws them before and after, --only bracket leaves the others out.

FOLDER holds cad/ttt_angle_bracket.ply, which is fitted by quality draft first; its bore stays, and its two
sides change alike. The car is a training shape
of the model that ships. Gains and bounds are measured again on surfaces of twice the resolution, which the
search has not seen. Seconds are of the processor: those of the search, a step. A fitted toy truck, whose
wheels and cargo box are rings, is also done with nothing frozen: what becomes of them is what parts are for.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

import partwright as pw
from partwright.assembly import Assembly
from partwright.goals import Optimised, Options, Start
from partwright.goals.objective import measured
from partwright.goals.surface import surface_of
from partwright.goals.wanted import measure_of
from partwright.meshing import mesh_part
from partwright.partsdf import NeuralShape, load_model, to_assembly
from partwright.shapes import MeshDistance


@dataclass(frozen=True)
class Task:
    name: str
    objective: str
    bounds: tuple[str, ...]
    freeze: tuple[str, ...]
    steps: int
    resolution: int
    wheels: str = ""  # how the names of its wheels begin
    symmetric: str = ""


BORE = ("ring_upper_left", "ring_left")  # the bracket's, as the fit calls its parts
TASKS = {
    "bracket": Task("bracket", "volume", ("inertia@x>=95%", "inertia@z>=95%"), BORE, 20, 48, symmetric="y"),
    "car": Task("car", "newtonian_drag@y", ("volume>=95%",), ("wheel_*",), 6, 40, "wheel_"),
    "truck": Task("truck", "newtonian_drag@x", ("volume>=95%",), ("ring*",), 10, 48, "ring"),
    "truck_free": Task("truck, nothing frozen", "newtonian_drag@x", ("volume>=95%",), (), 10, 48, "ring"),
}
TRUCK = Path(__file__).parents[1] / "examples" / "shapes" / "truck.glb"
FILES = {"bracket": "cad/ttt_angle_bracket.ply"}


def assembly_of(name: str, shapes: Path) -> Assembly:
    if name.startswith("truck"):
        return pw.fit(pw.load_shape(TRUCK), quality="draft").assembly
    if name == "car":
        return to_assembly(NeuralShape.trained(load_model("cars"), "3"), up="z")
    return pw.fit(pw.load_shape(shapes / FILES[name]), quality="draft").assembly


def again(result: Optimised, name: str) -> tuple[float, float]:
    """A measure before and after, on surfaces of twice the resolution."""
    numbers = []
    start = None
    for assembly in (result.start, result.assembly):
        surface = surface_of(assembly, 2 * result.problem.options.resolution)
        start = start or Start(assembly, surface, result.problem.parameters.longest)
        labels = np.zeros(len(surface.faces), int)
        numbers.append(measured(name, measure_of(name, start)[0], surface, labels).value)
    return numbers[0], numbers[1]


def wheels_moved(result: Optimised, wheels: str) -> str:
    """The largest distance between a wheel's surfaces before and after, over the longest side; empty for
    what has no wheels."""
    names = [part.name for part in result.start.parts if wheels and part.name.startswith(wheels)]
    length = result.problem.parameters.longest
    off = []
    for name in names:
        before, after = (mesh_part(one[name], 48) for one in (result.start, result.assembly))
        faces = np.asarray(before.faces)
        there = MeshDistance(np.asarray(before.vertices) / length, faces, faces, True)
        off.append(there.unsigned(np.asarray(after.vertices) / length).max())
    return f"{100 * max(off):.2f} %" if off else ""


def row(key: str, shapes: Path, pictures: Path | None) -> str:
    task = TASKS[key]
    assembly = assembly_of(key, shapes)
    options = Options(steps=task.steps, resolution=task.resolution, symmetric=task.symmetric)
    begun = time.process_time()
    result = pw.optimise(assembly, task.objective, bounds=task.bounds, freeze=task.freeze, options=options)
    seconds = (time.process_time() - begun) / len(result.found.steps)
    if pictures:
        with tempfile.TemporaryDirectory() as folder:
            result.save(folder)
            shutil.copyfile(Path(folder, "before_after.png"), pictures / f"optimise-{key}.png")
    same = sum(a == b for a, b in zip(result.start.parts, result.assembly.parts, strict=True))
    cells = []
    for name in dict.fromkeys(
        [task.objective, *(b.partition(">")[0].partition("<")[0] for b in task.bounds)]
    ):
        seen, found = result.numbers[name], again(result, name)
        shares = [100 * (after / before - 1) for before, after in (seen, found)]
        cells.append(f"{name} {shares[0]:+.1f} % ({shares[1]:+.1f} %)")
    accepted = len(result.found.points) - 1
    return (
        f"| {task.name} | {len(assembly)} | {same} | {', '.join(task.bounds)} | {'; '.join(cells)} | "
        f"{accepted} of {len(result.found.steps) - 1} | {result.ending.replace('_', ' ')} | "
        f"{wheels_moved(result, task.wheels)} | {seconds:.1f} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shapes", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--output", type=Path)
    parser.add_argument("--pictures", type=Path, metavar="FOLDER")
    parser.add_argument("--only", choices=TASKS, nargs="*", default=list(TASKS))
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    command = "python benchmarks/optimise.py --shapes FOLDER --output benchmarks/results/optimise.md"
    if arguments.only != list(TASKS):
        command += f" --only {' '.join(arguments.only)}"
    lines = [
        "# Parts improved for a goal",
        "",
        f"Made by `{command}`: changes as the search measured them, and in brackets on surfaces of twice "
        "the resolution. The drag is that of Newtonian flow, which is no flow simulation. Wheels moved: the "
        "largest distance between a wheel's surfaces before and after, over the longest side (truck: rings).",
        "",
        "| shape | parts | unchanged | bounds | change | steps accepted | ending | wheels moved "
        "| CPU seconds a step |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name in arguments.only:
        lines.append(row(name, arguments.shapes, arguments.pictures))
        print(lines[-1], flush=True)
        if arguments.output:
            arguments.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
