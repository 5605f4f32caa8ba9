"""How well any layers of wedges can stand for a hollow shape of revolution, by its own profile.

    python benchmarks/ring_bound.py --shape FOLDER/toys/mug.ply --sides 12

The shape is about an axis parallel to z, its hollow a prism or pyramid of so many sides, its outer side a
profile. Its wall is cut into layers, each into wedges. A convex piece has one flat side towards the
hollow: of a wedge of several sides it adds or lacks what is between that side, placed best, and theirs.
Along the axis its outer side is a concave profile, the nearest to the layer's own (a linear programme).
The least error of all layers and counts of wedges is what no arrangement of this kind comes below;
whatever closes the bottom, and what is beside the wall (a handle), counts as exact and for nothing.
The table goes to benchmarks/results/ring_bound.md.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from scipy.optimize import linprog

TARGET = Path(__file__).parent / "results" / "ring_bound.md"
SECTIONS, OFFSETS = 135, 2000  # of the wall; places of a wedge's flat side that are tried
STEP = 0.01  # of the longest side: a radius that jumps by more begins a layer
COUNTS = (16, 18, 20, 22, 24, 28, 32, 40, 48)


@dataclass(frozen=True, eq=False)
class Wall:
    """Circumradii of the hollow and of the outer side, at sections so far apart."""

    inner: np.ndarray
    outer: np.ndarray
    apart: float


def wall_of(mesh: trimesh.Trimesh, sides: int) -> Wall:
    """Radii of polygons of these areas; the outer one by its half away from what is beside the wall."""
    from shapely.geometry import Polygon, box

    def hollow(z: float) -> tuple[Polygon, Polygon] | None:
        section = mesh.section(plane_origin=(0, 0, z), plane_normal=(0, 0, 1))
        down = np.eye(4)
        down[2, 3] = -z
        found = section.to_2D(to_2D=down)[0].polygons_full if section is not None else ()
        whole = max(found, key=lambda p: Polygon(p.exterior).area, default=None)
        if whole is None or not whole.interiors:
            return None
        return whole, max(map(Polygon, whole.interiors), key=lambda p: p.area)

    area = sides / 2 * np.sin(2 * np.pi / sides)  # of a polygon of circumradius 1
    low, high = mesh.bounds[:, 2]
    heights = np.linspace(low, high, 40 * 8 + 1)
    open_at = [z for z in heights[1:-1] if hollow(z) is not None]
    heights = np.linspace(open_at[0], open_at[-1], SECTIONS)
    inner, outer = [], []
    for z in heights:
        whole, hole = hollow(z) or sys.exit("the hollow is not one from its bottom to its rim")
        x = hole.centroid.x
        far = mesh.extents.max()
        away = min((Polygon(whole.exterior) & box(*b) for b in ((-far, -far, x, far), (x, -far, far, far))),
                   key=lambda p: p.area)  # fmt: skip
        inner.append(np.sqrt(hole.area / area))
        outer.append(np.sqrt(2 * away.area / area))
    return Wall(np.array(inner), np.array(outer), heights[1] - heights[0])


def side_error(some: int, sides: int) -> float:
    """Area between so many sides of a polygon of circumradius 1 and a straight line, within their sector."""
    half = some * np.pi / sides
    if some == 1:
        return 0.0
    if half >= np.pi / 2:
        return np.inf
    angles = np.linspace(-half, half, 20_001)
    beside = np.mod(angles + half, 2 * np.pi / sides) - np.pi / sides
    polygon = np.cos(np.pi / sides) / np.cos(beside)
    lines = np.linspace(np.cos(half), 1.0, OFFSETS)[:, None] / np.cos(angles)[None]
    return float((np.abs(lines**2 - polygon**2) / 2).mean(axis=1).min() * 2 * half)


def around(wedges: int, sides: int) -> float:
    """The same, of all wedges around, which share out the sides as evenly as may be."""
    some, more = divmod(sides, wedges)
    return more * side_error(some + 1, sides) + (wedges - more) * side_error(some, sides)


def profile_error(outer: np.ndarray, apart: float, area: float) -> float:
    """Volume between a profile of radii and the nearest concave one."""
    n = len(outer)
    if n < 3:
        return 0.0
    bend = np.zeros((n - 2, 2 * n))
    for k in range(n - 2):
        bend[k, k : k + 3] = 1, -2, 1
    off = np.block([[np.eye(n), -np.eye(n)], [-np.eye(n), -np.eye(n)]])
    weight = 2 * area * outer * apart
    found = linprog(
        np.r_[np.zeros(n), weight], np.r_[bend, off], np.r_[np.zeros(n - 2), outer, -outer], bounds=(0, None)
    )
    return float(found.fun)


def best(wall: Wall, sides: int, size: float, most: int) -> list[tuple[float, tuple[int, ...]]]:
    """For 1 to `most` pieces of the wall, the least error as a volume, and the wedges of its layers."""
    jumps = np.flatnonzero(np.abs(np.diff(wall.outer)) > STEP * size) + 1
    ends = [0, *(int(k) for k in jumps if 3 < k < len(wall.outer) - 3), len(wall.outer)]
    ends = [k for i, k in enumerate(ends) if i == 0 or k - ends[i - 1] > 3 or k == len(wall.outer)]
    area = sides / 2 * np.sin(2 * np.pi / sides)
    outer = {
        (a, b): profile_error(wall.outer[a:b], wall.apart, area) for a, b in itertools.combinations(ends, 2)
    }
    ring = {n: around(n, sides) for n in range(3, sides + 1)}
    found = [(np.inf, ())] * (most + 1)
    for cuts in range(len(ends) - 1):
        for inside in itertools.combinations(ends[1:-1], cuts):
            layers = list(itertools.pairwise([0, *inside, ends[-1]]))
            squares = [float((wall.inner[a:b] ** 2).sum() * wall.apart) for a, b in layers]
            fixed = sum(outer[layer] for layer in layers)
            for wedges in itertools.product(ring, repeat=len(layers)):
                total = fixed + sum(ring[n] * s for n, s in zip(wedges, squares, strict=True))
                if sum(wedges) <= most and total < found[sum(wedges)][0]:
                    found[sum(wedges)] = (total, wedges)
    for n in range(1, most + 1):  # no more pieces than that
        found[n] = min(found[n], found[n - 1], key=lambda one: one[0])
    return found


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shape", type=Path, required=True, metavar="FILE")
    parser.add_argument("--sides", type=int, default=12, help="of the hollow (default: %(default)s)")
    options = parser.parse_args()
    mesh = trimesh.load_mesh(options.shape)
    found = best(wall_of(mesh, options.sides), options.sides, mesh.extents.max(), max(COUNTS))
    lines = [
        "# The least error of a hollow shape in layers of wedges",
        "",
        f"`python benchmarks/ring_bound.py --shape data/toys/{options.shape.name} --sides {options.sides}`. "
        "Error: volume missing and extra,",
        "in % of the shape's own, of the best layers of convex wedges for its wall, however they are made. "
        "Bottom and handle",
        "count as exact; they need pieces of their own, of a mug one and",
        "up to three. Pieces that are in no layers, as some in bricks are, may do better.",
        "",
        "| pieces of the wall | error % | wedges in each layer, from the bottom |",
        "|---:|---:|---|",
    ]
    for count in COUNTS:
        error, wedges = found[count]
        lines.append(f"| {count} | {100 * error / mesh.volume:.2f} | {' + '.join(map(str, wedges))} |")
    TARGET.write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))
    return 0


if __name__ == "__main__":
    sys.exit(main())
