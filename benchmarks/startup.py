"""What a process costs besides its work: until `partwright --help` answers, and around a fit.

    python benchmarks/startup.py before=TREE now=. [--shapes FILE ...] --output benchmarks/results/startup.md

Each NAME=TREE is a source tree with a built kernel: a column of the table. The trees take turns, so that what
else the machine does meets all of them alike; medians of processes of their own. Of the first table the
numbers are milliseconds on the clock. With shapes, a table more has the CPU seconds, of all threads, of
`partwright fit`, draft and normal, by stage, as medians over the shapes; what the method does is one row.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from fit import machine

COMMANDS = {
    "python alone": ["-c", "pass"],
    "import partwright": ["-c", "import partwright"],
    "partwright --help": ["-m", "partwright", "--help"],
    "partwright fit --help": ["-m", "partwright", "fit", "--help"],
}


def in_tree(tree: Path) -> dict[str, str]:
    """The environment of a process that finds the package in the tree. Python keeps what it compiles, as it
    does on most machines."""
    return os.environ | {"PYTHONPATH": str(tree.resolve()), "PYTHONDONTWRITEBYTECODE": ""}


def seconds(tree: Path, command: list[str]) -> float:
    """Of one process that finds the package in the tree."""
    environment = in_tree(tree)
    start = time.perf_counter()
    subprocess.run(
        [sys.executable, *command], cwd=tree, env=environment, stdout=subprocess.DEVNULL, check=True
    )
    return time.perf_counter() - start


FIXED = ("start", "reading", "prepare", "meshing", "scores", "writing")
# The stages of report.json are then CPU seconds of the process.
FIT = """
import sys, time
time.perf_counter = time.process_time
from partwright.cli.main import main
sys.exit(main(sys.argv[1:]))
"""


def stages(tree: Path, shape: Path, quality: str) -> dict[str, float]:
    """CPU seconds of one fit by stage; "fit" is all that the method does, "fixed" all the rest."""
    environment = in_tree(tree)
    with tempfile.TemporaryDirectory() as folder:
        options = ["--quality", quality, "-o", f"{folder}/out"]
        command = [sys.executable, "-c", FIT, "fit", str(shape.resolve()), *options]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, cwd=tree, env=environment, capture_output=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        told = json.loads(Path(folder, "out", "report.json").read_text())["seconds"]
    total = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    told["start"] = total - told.pop("all")
    method = sum(spent for stage, spent in told.items() if stage not in FIXED)
    fixed = {stage: told.get(stage, 0.0) for stage in FIXED}
    return fixed | {"fixed": sum(fixed.values()), "fit": method, "all": total}


def fit_table(trees: dict[str, Path], shapes: list[Path], quality: str, runs: int) -> list[str]:
    """Medians over the shapes, of each of which the cheapest of the runs counts."""
    found: dict[str, list[dict[str, float]]] = {name: [] for name in trees}
    for shape in shapes:
        taken = [{name: stages(tree, shape, quality) for name, tree in trees.items()} for _ in range(runs)]
        for name in trees:
            found[name].append(min((turn[name] for turn in taken), key=lambda one: one["all"]))
    lines = [
        f"| CPU seconds of a {quality} fit | " + " | ".join(trees) + " |",
        "|---|" + "---:|" * len(trees),
    ]
    for stage in (*FIXED, "fixed", "fit", "all"):
        cells = [f"{median(one[stage] for one in found[name]):.2f}" for name in trees]
        lines.append("| " + " | ".join([stage, *cells]) + " |")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("columns", metavar="NAME=TREE", nargs="+", help="a column of the table")
    parser.add_argument("--runs", metavar="N", type=int, default=15, help="of each (default: %(default)s)")
    parser.add_argument("--shapes", metavar="FILE", nargs="+", type=Path, default=[], help="to fit, each")
    parser.add_argument(
        "--fits", metavar="N", type=int, default=2, help="of each shape (default: %(default)s)"
    )
    parser.add_argument("--output", type=Path, help="where the table goes (Markdown; default: printed)")
    arguments = parser.parse_args()
    trees = {name: Path(tree) for name, _, tree in (text.partition("=") for text in arguments.columns)}
    lines = ["| milliseconds | " + " | ".join(trees) + " |", "|---|" + "---:|" * len(trees)]
    for label, command in COMMANDS.items():
        for tree in trees.values():  # bytecode is written, files are read once
            seconds(tree, command)
        taken = [
            {name: seconds(tree, command) for name, tree in trees.items()} for _ in range(arguments.runs)
        ]
        cells = [f"{1000 * median(turn[name] for turn in taken):.0f}" for name in trees]
        lines.append("| " + " | ".join([f"`{label}`", *cells]) + " |")
        print(lines[-1], flush=True)
    command = " ".join(["python benchmarks/startup.py", *(f"{name}=TREE" for name in trees)])
    if arguments.shapes:
        command += " --shapes " + " ".join(f"{shape.parent.name}/{shape.name}" for shape in arguments.shapes)
    intro = f"`{command}` on {machine()}: medians of {arguments.runs} runs in turns."
    text = "\n".join(["# Start-up", "", intro, "", *lines]) + "\n"
    for quality in ("draft", "normal") if arguments.shapes else ():
        table = fit_table(trees, arguments.shapes, quality, arguments.fits)
        print("\n".join(table), flush=True)
        text += "\n" + "\n".join(table) + "\n"
    if arguments.output:
        arguments.output.write_text(text)


if __name__ == "__main__":
    main()
