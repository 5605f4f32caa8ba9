"""`python -m partwright.capri FOLDER`: pre-trains the network on CAD parts that the project makes."""

from __future__ import annotations

import argparse
import sys
from dataclasses import fields
from pathlib import Path

from partwright.errors import PartwrightError
from partwright.methods import DEVICES


def main() -> int:
    import torch

    from partwright.capri.network import SIZES
    from partwright.capri.pretraining import NETWORK, PretrainingReport, PretrainingSettings, train

    parser = argparse.ArgumentParser(
        prog="python -m partwright.capri",
        description=f"Pre-trains the network of CAPRI-Net and writes {NETWORK}; the same command goes on "
        "from where it was stopped.",
    )
    parser.add_argument("folder", metavar="FOLDER", type=Path, help="where to write")
    for entry in fields(PretrainingSettings):
        kind = float if isinstance(entry.default, float) else int
        parser.add_argument(f"--{entry.name}", metavar="X", type=kind, default=entry.default)
    parser.add_argument("--threads", metavar="N", type=int, default=0, help="default: one per core")
    parser.add_argument("--workers", metavar="N", type=int, default=1, help="processes that make the parts")
    parser.add_argument(
        "--size",
        choices=sorted(SIZES),
        default="small",
        help="of the network: small is what ships, paper the paper's (default: %(default)s)",
    )
    parser.add_argument("--device", choices=DEVICES, default="auto", help="default: %(default)s")
    given = vars(parser.parse_args())
    folder, threads, size = given.pop("folder"), given.pop("threads"), given.pop("size")
    where = {"device": given.pop("device"), "workers": given.pop("workers")}
    if threads:
        torch.set_num_threads(threads)

    def report_step(report: PretrainingReport) -> None:
        line = f"step {report.step}/{report.steps}  loss {report.loss:.5f}  {report.seconds:.0f} s"
        print(f"partwright: {line}", file=sys.stderr, flush=True)

    try:
        outcome = train(folder, PretrainingSettings(**given), SIZES[size], report_step, **where)
    except PartwrightError as error:
        print(f"partwright: error: {error}", file=sys.stderr)
        return error.exit_code
    print(f"{outcome}: {folder / NETWORK}")
    return 130 if outcome == "interrupted" else 0


if __name__ == "__main__":
    sys.exit(main())
