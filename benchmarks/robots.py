"""Whole robots with simple collision shapes: how many, how far off, whether they contain, and what a step
costs.

    python benchmarks/robots.py NAME=PATH ... --rows rows.jsonl [--ways nearest enclose CoACD]

PATH is a robot's file (URDF or MJCF), as packages on PyPI ship them: airo-models, gym-ignition-models,
gymnasium-robotics, robosuite. Each is done three times: nearest; containing the visual meshes (--enclose) at
10 mm with at most 12 shapes a link; and by CoACD with its defaults. What --rows holds is not measured again.
Steps are MuJoCo's, of which URDF robots are standing on their first link; it takes meshes as their hulls.
The table goes to benchmarks/results/robots.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import mujoco
import trimesh
from lxml import etree
from manifold3d import Manifold, OpType

from partwright.meshing.hulls import file_hull
from partwright.meshing.manifolds import as_mesh, surface_of
from partwright.robots import Collided, CollideOptions, collide, open_robot, save
from partwright.robots.containment import shape_solid
from partwright.robots.model import Link, Shape
from partwright.robots.overlaps import overlaps
from partwright.robots.solids import Solids, largest_deviation
from partwright.robots.xml_files import parsed

TARGET = Path(__file__).parent / "results" / "robots.md"
STEPS, TIMES = 500, 3
WAYS = {"nearest": CollideOptions(), "enclose": CollideOptions(enclose=True, tolerance="10mm", max_parts=12)}
COACD = "CoACD"


@dataclass(frozen=True)
class Row:
    """One robot, one way. missing, extra: over the volume of all links. deviation: the largest, in metres.

    contained: links whose fresh points all lie within. step, contacts: microseconds and contacts of a step,
    with the shapes and with the hulls of the meshes. seconds: CPU.
    """

    robot: str
    way: str
    links: int
    natives: int
    hulls: int
    missing: float
    extra: float
    deviation: float
    contained: int | None
    pairs: tuple[int, int]
    step: tuple[float, float]
    contacts: tuple[float, float]
    seconds: float


def model_of(path: Path) -> mujoco.MjModel:
    """Of what collides. A URDF with the addresses of its meshes as this project finds them: MuJoCo knows no
    packages."""
    if path.suffix == ".xml":
        return mujoco.MjModel.from_xml_path(str(path))
    root = parsed(path, "robot").getroot()
    links = {link.name: link for link in open_robot(path).links}
    for element in root.findall("link"):
        meshes = element.findall("collision/geometry/mesh")
        for mesh, use in zip(meshes, links[element.get("name")].collisions, strict=True):
            mesh.set("filename", str(use.source.resolve()))
    compiler = {"strippath": "false", "discardvisual": "true", "balanceinertia": "true"}
    etree.SubElement(etree.SubElement(root, "mujoco"), "compiler", compiler)
    return mujoco.MjModel.from_xml_string(etree.tostring(root).decode())


def simulated(path: Path) -> tuple[float, float]:
    """CPU microseconds a step and contacts, means over the first steps from rest; of three times the fastest,
    as other programs take their share of the machine."""
    model, times = model_of(path), []
    for _ in range(TIMES):
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data)
        contacts, start = 0, time.process_time()
        for _ in range(STEPS):
            mujoco.mj_step(model, data)
            contacts += data.ncon
        times.append(time.process_time() - start)
    return 1e6 * min(times) / STEPS, contacts / STEPS


def beside_meshes(result: Collided) -> tuple[tuple[float, float], tuple[float, float]]:
    """Steps and contacts of a robot with these shapes, and as it was."""
    path = result.robot.path
    with tempfile.TemporaryDirectory() as folder:
        save(result, folder)
        (own, touching), (before, touched) = simulated(Path(folder) / path.name), simulated(path)
    return (own, before), (touching, touched)


def with_natives(link: Link, *solids: Manifold) -> Manifold:
    """Solids of a link and those that it has natively, at rest."""
    own = [shape_solid(Shape("", part)) for part in link.natives]
    return Manifold.batch_boolean([*solids, *own], OpType.Add).transform(link.pose[:3])


def decomposed(name: str, path: Path) -> Row:
    """Each link's collision meshes, closed as `collide` closes them, by CoACD."""
    import coacd

    coacd.set_log_level("error")
    solids, seconds, hulls, links = Solids(), 0.0, 0, 0
    own = missing = extra = deviation = 0.0
    bodies: dict[str, tuple[Manifold, Manifold]] = {}
    robot = open_robot(path)
    shapes: dict[str, list[Shape]] = {}
    for link in (link for link in robot.links if link.collisions):
        solid = solids.target(link, link.collisions).solid
        start = time.process_time()
        pieces = coacd.run_coacd(coacd.Mesh(*surface_of(solid)))
        seconds += time.process_time() - start
        hulls += len(pieces)
        links += 1
        convex = [Manifold.hull_points(trimesh.Trimesh(*piece).vertices) for piece in pieces]
        shapes[link.name] = [
            Shape(f"{link.name}_{i}", mesh=as_mesh(file_hull(surface_of(hull)[0])))
            for i, hull in enumerate(convex)
        ]
        union = Manifold.batch_boolean(convex, OpType.Add)
        own += solid.volume()
        missing += (solid - union).volume()
        extra += (union - solid).volume()
        deviation = max(deviation, largest_deviation(solid, union).length)
        bodies[link.name] = with_natives(link, solid), with_natives(link, union)
    for link in (link for link in robot.links if link.natives and link.name not in bodies):
        bodies[link.name] = with_natives(link), with_natives(link)
    pairs = [len(overlaps({name: both[i] for name, both in bodies.items()})) for i in (0, 1)]
    return Row(
        name, COACD, links, 0, hulls, missing / own, extra / own, deviation, None,
        (pairs[0], pairs[1]), *beside_meshes(Collided(robot, shapes, [])), seconds,
    )  # fmt: skip


def measure(name: str, path: Path, way: str) -> Row:
    if way == COACD:
        return decomposed(name, path)
    start = time.process_time()
    result = collide(path, WAYS[way])
    seconds = time.process_time() - start
    volume = sum(link.volume for link in result.links)
    hulls = sum(link.shapes.get("hull", 0) for link in result.links)
    return Row(
        name,
        way,
        len(result.links),
        sum(link.count for link in result.links) - hulls,
        hulls,
        sum(link.missing * link.volume for link in result.links) / volume,
        sum(link.extra * link.volume for link in result.links) / volume,
        max(link.deviation for link in result.links),
        sum(link.sticking_out == 0 for link in result.links) if way == "enclose" else None,
        (len(result.pairs_before), len(result.pairs_after)),
        *beside_meshes(result),
        seconds,
    )


def document(rows: list[Row]) -> str:
    lines = [
        "# Robots with simple collision shapes",
        "",
        f"`python benchmarks/robots.py`; {os.cpu_count()} cores. Missing and extra: volume that the shapes",
        "lack and add, in % of the links' meshes (enclose: of the visual ones). Contained: links of whose",
        "visual mesh no corner and none of 100,000 fresh points is outside. Pairs: links that share volume,",
        "with the meshes and with the shapes, native solids included. Step and contacts: MuJoCo's, means of",
        f"{STEPS} steps, the fastest of {TIMES}, with the shapes and with the hulls of the meshes. Seconds",
        "are CPU seconds, CoACD's without reading meshes.",
        "",
        "| robot | way | links | native | hulls | missing % | extra % | deviation mm | contained | pairs "
        "| step us | contacts | seconds |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for r in rows:
        cells = (
            f"{100 * max(r.missing, 0.0):.1f}",  # rounding leaves -0.0
            f"{100 * r.extra:.1f}",
            f"{1000 * r.deviation:.1f}",
            "" if r.contained is None else f"{r.contained} of {r.links}",
            f"{r.pairs[0]} / {r.pairs[1]}",
            f"{r.step[0]:.0f} / {r.step[1]:.0f}",
            f"{r.contacts[0]:.1f} / {r.contacts[1]:.1f}",
            f"{r.seconds:.0f}",
        )
        lines.append(f"| {r.robot} | {r.way} | {r.links} | {r.natives} | {r.hulls} | {' | '.join(cells)} |")
    done = {(row.robot, row.way) for row in rows}
    left = [
        f"{name}, {way}"
        for name in dict.fromkeys(r.robot for r in rows)
        for way in (*WAYS, COACD)
        if (name, way) not in done
    ]
    lines += ["", f"Not measured: {'; '.join(left)}."] if left else []
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("robots", nargs="+", metavar="NAME=PATH")
    parser.add_argument("--rows", type=Path, required=True, help="measured rows, kept between runs")
    parser.add_argument("--ways", nargs="+", choices=[*WAYS, COACD], default=[*WAYS, COACD])
    options = parser.parse_args()
    kept = options.rows.read_text().splitlines() if options.rows.exists() else []
    rows = [Row(**json.loads(line)) for line in kept]
    for way in options.ways:
        for name, _, path in (robot.partition("=") for robot in options.robots):
            if any((row.robot, row.way) == (name, way) for row in rows):
                continue
            rows.append(measure(name, Path(path), way))
            with options.rows.open("a") as file:
                file.write(json.dumps(dataclasses.asdict(rows[-1])) + "\n")
            TARGET.write_text(document(rows), encoding="utf-8")
            print(rows[-1], flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
