"""The guard of CI: fits of a few shapes that are made here, against committed references. Under a minute.

    python benchmarks/guard.py             # exits with 1 where a fit became worse or slower than its noise
    python benchmarks/guard.py --record    # writes benchmarks/results/guard.json anew; say why in the commit

Quality is the IoU and the number of parts: the same bytes on one machine, nearly so on others, hence the
margins. Speed is the fit's CPU time over that of a fixed computation with NumPy, which runs between the fits:
what makes the machine slower makes both slower. What was slow is measured again; the cheapest turn counts.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import trimesh

import partwright as pw
from partwright.atomic_io import write_bytes

REFERENCE = Path(__file__).parent / "results" / "guard.json"
TURNS = 2  # where the first says slower, and to record
LOST_IOU = 0.01  # another processor rounds otherwise, and a search may then end elsewhere, as by another seed
MORE_PARTS = 0.2  # of the parts, and two at least
SLOWER = 3.0  # times: idle or crowded, one machine differs by 1.4; narrow vectors cost a fit more


def mallet() -> trimesh.Trimesh:
    """A round head across a handle that thickens: SuperFrusta of several forms, joined."""
    head = trimesh.creation.cylinder(0.28, 0.9, sections=64)
    head.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (0, 1, 0)))
    profile = [(0.0, -1.6), (0.13, -1.6), (0.09, -0.8), (0.07, 0.0), (0.0, 0.0)]
    handle = trimesh.creation.revolve(profile, sections=64)
    foot = trimesh.creation.icosphere(subdivisions=3, radius=0.17)
    foot.apply_translation((0, 0, -1.6))
    return trimesh.boolean.union([head, handle, foot], engine="manifold")


def plate() -> trimesh.Trimesh:
    """A plate with a rib, four holes and a pocket: solids and their differences."""
    body = trimesh.creation.box((2.0, 1.2, 0.25))
    rib = trimesh.creation.box((0.2, 1.2, 0.6))
    rib.apply_translation((-0.6, 0, 0.3))
    pocket = trimesh.creation.box((0.7, 0.6, 0.3))
    pocket.apply_translation((0.35, 0, 0.15))
    holes = []
    for x in (-0.85, 0.85):
        for y in (-0.45, 0.45):
            hole = trimesh.creation.cylinder(0.09, 1.0, sections=48)
            hole.apply_translation((x, y, 0))
            holes.append(hole)
    whole = trimesh.boolean.union([body, rib], engine="manifold")
    return trimesh.boolean.difference([whole, pocket, *holes], engine="manifold")


CASES: dict[str, tuple[Callable[[], trimesh.Trimesh], str, str]] = {
    "mallet, superfrusta": (mallet, "superfrusta", "normal"),
    "plate, solids": (plate, "solids", "draft"),
    "plate, capri": (plate, "capri", "draft"),
}


def yardstick() -> float:
    """CPU seconds of a fixed computation: arithmetic in blocks and sorting, as a fit's."""
    start = time.process_time()
    values = np.random.default_rng(0).random((256, 4096), dtype=np.float32)
    for _ in range(40):
        values = np.sqrt(values * values + 0.25) - 0.5 * np.abs(values - 0.5)
        values[:64] = np.sort(values[:64], axis=1)
    assert np.isfinite(values).all()
    return time.process_time() - start


def measured(names: Iterable[str]) -> dict[str, dict[str, float]]:
    """IoU, parts and relative CPU time of some cases."""
    found: dict[str, dict[str, float]] = {}
    before = yardstick()
    for name in names:
        make, method, quality = CASES[name]
        shape = pw.load_shape(make())
        start = time.process_time()
        result = pw.fit(shape, method, quality=quality)
        spent = time.process_time() - start
        after = yardstick()
        ratio = round(2 * spent / (before + after), 1)
        found[name] = {"iou": round(result.scores.iou, 5), "parts": result.scores.parts, "time": ratio}
        before = after
    return found


def cheapest(slow: Callable[[str, float], bool]) -> dict[str, dict[str, float]]:
    """Of all cases, each measured anew as long as its time is slow, up to TURNS times."""
    now = measured(CASES)
    for _ in range(TURNS - 1):
        for name, again in measured([name for name in CASES if slow(name, now[name]["time"])]).items():
            now[name] = again | {"time": min(now[name]["time"], again["time"])}
    return now


def worse(now: dict[str, dict[str, float]], before: dict[str, dict[str, float]]) -> list[str]:
    """A line for each number that fell by more than its noise."""
    if now.keys() != before.keys():
        return [f"the cases are not those of {REFERENCE.name}: record them anew"]
    lines = []
    for name, was in before.items():
        got = now[name]
        if got["iou"] < was["iou"] - LOST_IOU:
            lines.append(f"{name}: IoU {got['iou']:.4f}, was {was['iou']:.4f}")
        if got["parts"] > was["parts"] + max(2, MORE_PARTS * was["parts"]):
            lines.append(f"{name}: {got['parts']:g} parts, was {was['parts']:g}")
        if got["time"] > SLOWER * was["time"]:
            lines.append(f"{name}: {got['time']:g} times the yardstick, was {was['time']:g}")
    return lines


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--record", action="store_true", help="write the references anew")
    given = parser.parse_args()
    was = {} if given.record else json.loads(REFERENCE.read_text())
    now = cheapest(lambda name, took: name not in was or took > SLOWER * was[name]["time"])
    for name, got in now.items():
        print(f"{name}: IoU {got['iou']:.4f}, {got['parts']:g} parts, {got['time']:g} times the yardstick")
    if given.record:
        write_bytes(REFERENCE, (json.dumps(now, indent=2) + "\n").encode())
        return 0
    lines = worse(now, was)
    for line in lines:
        print(f"worse: {line}", file=sys.stderr)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
