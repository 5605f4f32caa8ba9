"""`partwright batch --ray` on a cluster of two nodes on this machine, of which one is lost now and then.

    python benchmarks/batch_ray.py [--shapes 12] [--losses 3] [--output benchmarks/results/batch-ray.md]

Needs the extra `ray`. The shapes are those of batch.py. They are fitted by worker processes of this machine,
and by the cluster, whose second node dies without a word whenever so many shapes are done, and is replaced by
a new one. Ray counts a node as lost after some seconds without a sign of it.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path

from batch import digests, make
from fit import machine
from ray.cluster_utils import Cluster

from partwright.batch import Plan, fit_folder
from partwright.batch.manifest import DONE, Entry, entries


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shapes", type=int, default=12)
    parser.add_argument("--losses", type=int, default=3)
    parser.add_argument("--output", type=Path)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        make(place / "in", given.shapes)
        plan = Plan(place / "in", options={"quality": "draft"})
        start = time.perf_counter()
        fit_folder(plan, place / "pool")
        pool = time.perf_counter() - start

        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        second, ended, lost = cluster.add_node(num_cpus=1), 0, 0

        def told(entry: Entry, found: int) -> None:
            nonlocal second, ended, lost
            ended += 1
            print(entry.file, entry.status, entry.reason, flush=True)
            if lost < given.losses and ended * (given.losses + 1) >= given.shapes * (lost + 1):
                cluster.remove_node(second, allow_graceful=False)
                second = cluster.add_node(num_cpus=1)
                lost += 1

        start = time.perf_counter()
        fit_folder(plan, place / "ray", ray=cluster.address, told=told)
        spread = time.perf_counter() - start
        cluster.shutdown()
        done = Counter(e.item for e in entries(place / "ray" / "manifest.jsonl") if e.status == DONE)
        rows = {
            "shapes": given.shapes,
            "nodes lost and replaced": lost,
            "seconds, Ray against worker processes": f"{spread / pool:.2f}",
            "items without a result": given.shapes - len(done),
            "items done twice": sum(count > 1 for count in done.values()),
            "files that differ": len(digests(place / "pool").items() ^ digests(place / "ray").items()),
        }
    command = (
        f"`python benchmarks/batch_ray.py --shapes {given.shapes} --losses {given.losses}`, {machine()}."
    )
    table = ["| | |", "|---|---:|", *(f"| {name} | {value} |" for name, value in rows.items())]
    text = "\n".join(
        ["# A folder of shapes on two nodes of Ray", "", command, "Draft quality.", "", *table, ""]
    )
    print(text)
    if given.output:
        given.output.write_text(text)


if __name__ == "__main__":
    main()
