"""How long it takes until `partwright --help` answers and `import partwright` is done.

    python benchmarks/startup.py before=TREE now=. --output benchmarks/results/startup.md

Each NAME=TREE is a source tree with a built kernel: a column of the table. The trees take turns, so that what
else the machine does meets all of them alike; wall-clock medians of processes of their own.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
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


def seconds(tree: Path, command: list[str]) -> float:
    """Of one process that finds the package in the tree."""
    environment = os.environ | {"PYTHONPATH": str(tree.resolve())}
    start = time.perf_counter()
    subprocess.run([sys.executable, *command], env=environment, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("columns", metavar="NAME=TREE", nargs="+", help="a column of the table")
    parser.add_argument("--runs", metavar="N", type=int, default=15, help="of each (default: %(default)s)")
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
    intro = f"`{command}` on {machine()}: medians of {arguments.runs} runs in turns."
    text = "\n".join(["# Start-up", "", intro, "", *lines]) + "\n"
    if arguments.output:
        arguments.output.write_text(text)


if __name__ == "__main__":
    main()
