"""Held-out cars that get less drag by a network, and what OpenFOAM says of them; for benchmarks/drag.py.

The cars are test shapes of the car model's family, which neither it nor the network has seen: the model finds
each in its samples, then its body may change while its wheels stay. The same cars are also done by a model
that knows no parts, from the same training: there is nothing in it that could be told to stay.
"""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

import partwright as pw
from partwright.assembly import Assembly, Similarity
from partwright.datasets.prepared import PreparedFamily
from partwright.goals import Optimised, Options
from partwright.goals.contacts import part_surface
from partwright.goals.flow import Air
from partwright.goals.flow.surrogate import Surrogate
from partwright.goals.objectives.surrogate import outside
from partwright.goals.surface import surface_of
from partwright.goals.symmetry import asymmetry
from partwright.partsdf import ReconstructionSettings, load_model, reconstruct, to_assembly

LENGTH = 4.5  # metres
AIR = Air("y", "z", iterations=100, time_limit=3600)
FINE = replace(AIR, iterations=150, cells=64)
LEAST = 0.01  # of the drag: a smaller gain is none
FOUND_IN = ReconstructionSettings(iterations=200)
OVERLAP = 60_000  # points in the box in which parts may overlap
CLEAR = 0.01  # of the length: a wheel's points as far as this from the body say where the wheel is


@dataclass(frozen=True)
class Row:
    """What came of a car. Drag areas and volumes are pairs of before and after; moved: of the wheels'
    surface, mean and most, and overlap: of parts, as shares of length and volume."""

    name: str
    accepted: int
    tried: int
    ending: str
    outside: tuple[float, float]
    predicted: tuple[float, float]
    coarse: tuple[float, float]
    fine: tuple[float, float]
    volume: tuple[float, float]
    moved: tuple[float, float]
    held: float
    asymmetry: tuple[float, float]
    overlap: tuple[float, float]
    seconds: float

    def line(self, parts: bool) -> str:
        shift = f"{100 * self.moved[0]:.2f}, {100 * self.moved[1]:.2f} %"
        own = [f"{self.held:.1e}", " -> ".join(f"{100 * one:.2f} %" for one in self.overlap)] if parts else []
        return " | ".join(
            [
                f"| {self.name}",
                f"{self.accepted} of {self.tried}",
                self.ending.replace("_", " "),
                f"{self.outside[0]:.2f}, {self.outside[1]:.2f}",
                f"{change(self.predicted):+.1%}",
                *(shown(pair) for pair in (self.coarse, self.fine)),
                "yes" if self.less else "no",
                f"{change(self.volume):+.1%}",
                " -> ".join(f"{one:.1e}" for one in self.asymmetry),
                shift,
                *own,
                f"{self.seconds:.0f} |",
            ]
        )

    @property
    def less(self) -> bool:
        """Both meshes find less drag."""
        return all(change(pair) < -LEAST for pair in (self.coarse, self.fine))


HEAD = (
    "car | steps accepted | ending | outside | by the network | OpenFOAM, 32 cells | 64 cells | "
    "less on both | volume | mirror image off | wheels moved, mean and most"
)


def tables(
    cars: int,
    one_part_cars: int,
    one_part: Path | None,
    path: Path,
    family: Path,
    work: Path,
    steps: int,
) -> list[str]:
    """Both tables. path: of the network; work: keeps what is done, pictures too, so that a run goes on."""
    prepared = PreparedFamily(family)
    numbers = prepared.split("test")[:cars]
    rows = [improved("cars", prepared, number, path, work, steps) for number in numbers]
    both = improved("cars", prepared, numbers[0], path, work, steps, "x")
    lines = [
        "## Cars that it improves",
        "",
        "Test shapes of the car model's family, which neither that model nor the network has seen, "
        f"{LENGTH} m long: found by the model, then optimised by the network; wheels frozen, volume kept to "
        "95 %. Less on both: OpenFOAM finds at least 1 % less drag on either mesh. No gain is as large as "
        "what the mesh changes of the drag itself (last table), so how large it is is not proven. Mirror "
        "image off: mean over the surface, before and after, as a share of the length. Wheels moved: the "
        f"surface in the whole, at points of the wheels further than {CLEAR:.0%} of the length from the "
        "body; held: the wheels' own surface, most, as a share of the length (`--still`). Overlap: the share "
        "of the volume that is in two parts. Seconds: of the processor, a step.",
        "",
        f"| {HEAD} | held | overlap | seconds |",
        "|---|---|---|---:|---:|---:|---:|---|---:|---:|---:|---:|---:|---:|",
        *(row.line(True) for row in rows),
        replace(both, name=f"{both.name}, both sides alike (`--symmetric x`)").line(True),
        "",
    ]
    if one_part is None:
        return lines
    alone = [improved(str(one_part), prepared, n, path, work, steps) for n in numbers[:one_part_cars]]
    return [
        *lines,
        "## The same without parts",
        "",
        "A model of the same cars, trained alike but with all parts as one (`partwright parts train "
        f"configs/cars-one-part.toml -o cars-one-part`; {epochs(one_part)} epochs), the same network, bounds "
        "and steps. It knows no wheels that could be frozen; how far it moves them is measured at the points "
        "of the table above.",
        "",
        f"| {HEAD} | seconds |",
        "|---|---|---|---:|---:|---:|---:|---|---:|---:|---:|---:|",
        *(row.line(False) for row in alone),
        "",
    ]


def improved(
    model: str,
    family: PreparedFamily,
    number: int,
    network: Path,
    work: Path,
    steps: int,
    symmetric: str = "",
) -> Row:
    """One car by one model; from the folder of work, where it is there already."""
    name = family.shapes[number].name
    place = work / f"{name}-{label(model)}{symmetric and '-both-sides'}"
    known = place.with_suffix(".json")
    if known.is_file():
        stored = json.loads(known.read_text(encoding="utf-8"))
        return Row(**{k: tuple(v) if isinstance(v, list) else v for k, v in stored.items()})
    parts = car("cars", family, number)
    start = parts if model == "cars" else car(model, family, number)
    objective = f"surrogate_drag@{network}"
    begun = time.process_time()
    result = pw.optimise(
        start,
        objective,
        bounds=["volume>=95%"],
        freeze=["wheel_*"] if model == "cars" else ["*:pose", "*:form"],
        options=Options(steps=steps, resolution=48, symmetric=symmetric),
    )
    seconds = (time.process_time() - begun) / len(result.found.steps)
    print(name, model, result.numbers, result.ending, f"{seconds:.1f} s a step", flush=True)
    coarse, fine = result.with_simulation(AIR), result.with_simulation(FINE)
    fine.save(place)
    surrogate = Surrogate.load(network)
    first = result.found.points[0].surface
    far = [outside(surrogate, surface, 1.0) for surface in (first, result.surface)]
    row = Row(
        name,
        len(result.found.points) - 1,
        len(result.found.steps) - 1,
        result.ending,
        (far[0], far[1]),
        result.numbers[objective],
        drag(coarse),
        drag(fine),
        result.numbers["volume"],
        moved(parts, result.start, result.assembly),
        max(result.held.values(), default=float("nan")),
        (asymmetry(result.start, first, "x"), asymmetry(result.assembly, result.surface, "x")),
        (overlap(result.start), overlap(result.assembly)),
        seconds,
    )
    known.write_text(json.dumps(asdict(row)), encoding="utf-8")
    print(row.line(True), flush=True)
    return row


def label(model: str) -> str:
    return model if model == "cars" else "one-part"


def epochs(model: Path) -> str:
    """For how long it was trained, as the log beside it says."""
    log = model.with_name("log.csv")
    return log.read_text(encoding="utf-8").splitlines()[-1].partition(",")[0] if log.is_file() else "its"


def car(model: str, family: PreparedFamily, number: int) -> Assembly:
    """A held-out car as the model finds it in its samples, in metres. Both models give it one frame."""
    found = reconstruct(load_model(model), family.load(number), FOUND_IN)
    return replace(to_assembly(found, up="z").transformed(Similarity(LENGTH / 1.8)), unit="m")


def drag(result: Optimised) -> tuple[float, float]:
    before, after = (result.simulated[end]["drag_area"] for end in ("before", "after"))
    return before, after


def shown(pair: tuple[float, float]) -> str:
    return f"{pair[0]:.3f} -> {pair[1]:.3f} ({change(pair):+.1%})"


def change(pair: Sequence[float]) -> float:
    return pair[1] / pair[0] - 1


def moved(parts: Assembly, start: Assembly, end: Assembly) -> tuple[float, float]:
    """How far the whole's surface has moved where the wheels are, mean and most, as a share of the length.

    parts: the car as the model of parts has it, which says where. Wheels of `start` that are elsewhere (the
    other model's are, by what it does not learn) are looked at there all the same.
    """
    wheels = [i for i, part in enumerate(parts.parts) if part.name.startswith("wheel")]
    body = [i for i in range(len(parts)) if i not in wheels]
    points = np.concatenate([part_surface(parts, i) for i in wheels])
    points = points[parts.part_distances(points)[body].min(axis=0) > CLEAR * LENGTH]
    before, after = (one.part_distances(points).min(axis=0) for one in (start, end))
    off = np.abs(after - before) / LENGTH
    return float(off.mean()), float(off.max())


def overlap(assembly: Assembly) -> float:
    """The share of the volume that lies in two parts or more."""
    low, high = surface_of(assembly, 48).bounds
    points = np.random.default_rng(0).uniform(low, high, (OVERLAP, 3))
    inside = (assembly.part_distances(points) < 0).sum(axis=0)
    return float((inside > 1).sum() / max(1, (inside > 0).sum()))
