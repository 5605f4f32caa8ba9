"""What a fit costs beside another version of the project, by stage: whole processes of both in turns.

    python benchmarks/cost.py --before ../before/.venv/bin/python --shapes FOLDER --sets toys --seeds 0,1

Seconds are those of the processor, of the process and all its threads, of which each has one: on a machine
that is busy with other work they are hardly more. --before names the Python in whose environment the other
version is installed. Searches are chaotic: one shape ends elsewhere after any change, so parts and scores are
told on average. The tables go to --output, benchmarks/results/cost.md if none is given.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from statistics import mean, median

from fit import OWN_SHAPES, Entry, find_shapes

from partwright.atomic_io import write_bytes

TARGET = Path(__file__).parent / "results" / "cost.md"
# Stages are then counted in the processor's time, too.
PROGRAM = "import time; time.perf_counter = time.process_time; from partwright.__main__ import main; main()"
START = "start of Python"
LEAST = 0.02  # of the whole: stages of less are told as one
SCORES = {"IoU": "iou", "bi-surface IoU": "bi_surface_iou", "overlap": "overlap"}
SHARES = {"furthest off, %": "max_deviation_share", "sticks out, %": "max_protrusion_share"}


@dataclass(frozen=True)
class Cost:
    """One fit: seconds of the processor in all, and by stage; parts and scores by the names of the table."""

    seconds: float
    stages: dict[str, float]
    scores: dict[str, float]


def fitted(python: str, entry: Entry, seed: int) -> Cost:
    with tempfile.TemporaryDirectory() as folder:
        command = [python, "-c", PROGRAM, "fit", str(entry.path), "-o", folder, "--seed", str(seed)]
        alone = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONDONTWRITEBYTECODE": ""}
        process = subprocess.Popen(
            [*command, "--threads", "1", *entry.options],
            env=os.environ | alone,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            raise SystemExit(f"{entry.name}: ended with {process.returncode}")
        report = json.loads(Path(folder, "report.json").read_text(encoding="utf-8"))
    seconds = usage.ru_utime + usage.ru_stime
    stages = {stage: spent for stage, spent in report["seconds"].items() if stage != "all"}
    stages[START] = seconds - sum(stages.values())
    scores = {"parts": float(report["parts"])}
    # An early version does not say all of this.
    told = report["scores"]
    scores |= {name: told[key] for name, key in SCORES.items() if key in told}
    scores |= {name: 100 * told[key] for name, key in SHARES.items() if key in told}
    return Cost(seconds, stages, scores)


@dataclass
class Comparison:
    """Both costs of each shape and seed, as they come."""

    command: str
    before: list[Cost] = field(default_factory=list)
    after: list[Cost] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    def add(self, name: str, before: Cost, after: Cost) -> str:
        self.names.append(name)
        self.before.append(before)
        self.after.append(after)
        return self.row(name, before.seconds, after.seconds)

    @staticmethod
    def row(name: str, before: float, after: float) -> str:
        ratio = f"{after / before:.2f}" if before else "-"
        return f"| {name} | {before:.2f} | {after:.2f} | {ratio} |"

    def stages(self) -> list[str]:
        """Of all fits together, most first: a stage may be of one version alone."""
        sums = [sum((Counter(one.stages) for one in side), Counter()) for side in (self.before, self.after)]
        least = [LEAST * sum(one.values()) for one in sums]
        by_time = [stage for stage, _ in (sums[0] + sums[1]).most_common()]
        large = [stage for stage in by_time if sums[0][stage] > least[0] or sums[1][stage] > least[1]]
        rows = [self.row(stage, *(one[stage] for one in sums)) for stage in large]
        rest = [sum(spent for stage, spent in one.items() if stage not in large) for one in sums]
        return [
            *rows,
            self.row("all others", *rest),
            self.row("**all**", *(sum(one.values()) for one in sums)),
        ]

    def scores(self) -> list[str]:
        means = [
            {name: f"{mean(one.scores[name] for one in side):.4f}" for name in side[0].scores}
            for side in (self.before, self.after)
        ]
        return [f"| {name} | {means[0].get(name, '-')} | {after} |" for name, after in means[1].items()]

    def page(self) -> str:
        pairs = zip(self.before, self.after, strict=True)
        ratios = [after.seconds / before.seconds for before, after in pairs]
        slowest = max(range(len(ratios)), key=lambda i: self.before[i].seconds)
        return "\n".join(
            [
                "# What a fit costs, beside an earlier version",
                "",
                f"`{self.command}`. Seconds of the processor, one thread, whole processes of both in turns.",
                f"Of {len(ratios)} fits the median takes {median(ratios):.2f} of the seconds, the slowest",
                f"({self.names[slowest]}) {ratios[slowest]:.2f}, all together "
                f"{sum(one.seconds for one in self.after) / sum(one.seconds for one in self.before):.2f}.",
                "",
                "| stage | before | after | ratio |\n|---|---:|---:|---:|",
                *self.stages(),
                "",
                "| mean | before | after |\n|---|---:|---:|",
                *self.scores(),
                "",
                "| shape, seed | before | after | ratio |\n|---|---:|---:|---:|",
                *(
                    self.row(name, one.seconds, other.seconds)
                    for name, one, other in zip(self.names, self.before, self.after, strict=True)
                ),
                "",
            ]
        )


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--before", required=True, metavar="PYTHON")
    parser.add_argument("--after", default=sys.executable, metavar="PYTHON")
    parser.add_argument("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER")
    parser.add_argument("--sets", default="", metavar="A,B")
    parser.add_argument("--names", default="", metavar="A,B")
    parser.add_argument("--seeds", default="0", metavar="A,B")
    parser.add_argument("--output", type=Path, default=TARGET, metavar="FILE")
    options = parser.parse_args()
    sets, names = ({*filter(None, text.split(","))} for text in (options.sets, options.names))
    given = [("sets", options.sets), ("names", options.names), ("seeds", options.seeds)]
    told = "".join(f" --{key} {value}" for key, value in given if value)
    if options.output != TARGET:
        told += f" --output benchmarks/results/{options.output.name}"
    found = Comparison(f"python benchmarks/cost.py --before PYTHON --shapes {options.shapes.name}{told}")
    for seed in map(int, options.seeds.split(",")):
        for entry in find_shapes(options.shapes, sets, names):
            costs = (fitted(python, entry, seed) for python in (options.before, options.after))
            print(found.add(f"{entry.name}, {seed}", *costs), flush=True)
            write_bytes(options.output, found.page().encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
