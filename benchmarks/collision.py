"""Collision bodies of one shape, side by side: fitted primitives, what `partwright collide` makes of the
mesh, CoACD's hulls, and one box a hull.

    python benchmarks/collision.py --shapes FOLDER --names toys/mug,toys/hammer --rows rows.jsonl

Needs MuJoCo and CoACD: pip install mujoco coacd. Five copies of each body are dropped onto a plane, eight
times. What --rows holds is not measured again. The table goes to benchmarks/results/collision.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coacd
import mujoco
import numpy as np
import trimesh

import partwright as pw
from partwright.approximation.collision import TOLERANCE, geometries
from partwright.approximation.hull_faces import faces_of
from partwright.assembly import Assembly, Part, Similarity
from partwright.atomic_io import write_bytes
from partwright.export.axes import to_metres_z_up
from partwright.export.mjcf import GEOMS, geom_size
from partwright.export.rigid_body import DENSITY
from partwright.fields import Box
from partwright.meshing.hulls import hull_of
from partwright.meshing.manifolds import as_manifold, as_mesh
from partwright.meshing.mass import MassProperties, mass_properties
from partwright.robots import CollideOptions
from partwright.robots.model import Link, MeshUse
from partwright.robots.shaping import shapes_for
from partwright.robots.solids import Solids
from partwright.shapes import Shape

HERE = Path(__file__).parent
TARGET = HERE / "results" / "collision.md"
OWN_SHAPES = HERE.parent / "examples" / "shapes"
COPIES, STEPS, DROPS, POINTS = 5, 1000, 8, 200_000
BEFORE_BALANCING, LEAST_EXTRA = 0.8, 0.001  # of CoACD's volume error: what hulls may add to end at half of it
PRIMITIVES, COLLIDE, COUNTED, COACD, BOXES = KINDS = (
    "primitives",
    "collide",
    "collide, CoACD's count",
    "CoACD hulls",
    "a box per hull",
)
Inside = Callable[[np.ndarray], np.ndarray]  # points (N, 3), metres -> (N,) bool


@dataclass(frozen=True)
class Body:
    """Something to collide: `inside` says what it fills, `add` puts its geoms into a MuJoCo body."""

    kind: str
    pieces: int
    seconds: float
    inside: Inside
    add: Callable[[mujoco.MjSpec, mujoco.MjsBody], None]


@dataclass(frozen=True)
class Row:
    """One body of one shape. missing, extra: volume that it lacks or adds, over the shape's."""

    shape: str
    kind: str
    pieces: int
    missing: float
    extra: float
    step: float
    contacts: float
    seconds: float
    solidity: float


def fitted(shape: Shape, method: str, options: dict[str, Any]) -> Body:
    """Our parts, as the MJCF export has them; options: of the fit."""
    start = time.process_time()
    assembly = pw.fit(shape, method, seed=0, **options).assembly
    local = assembly.transformed(to_metres_z_up(assembly))
    found, _ = geometries(local, GEOMS, TOLERANCE, 24, convex=True)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "body.mjcf.xml"
        pw.export(assembly, path, visuals=False)
        seconds = time.process_time() - start
        spec = mujoco.MjSpec.from_file(str(path))

    def add(target: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
        for mesh in spec.meshes:
            target.add_mesh(
                name=mesh.name, uservert=mesh.uservert, userface=mesh.userface, inertia=mesh.inertia
            )
        for geom in spec.geoms:
            own = {"type": geom.type, "size": geom.size, "pos": geom.pos, "quat": geom.quat}
            body.add_geom(**own, meshname=geom.meshname)

    tests = [_in_part(g.part) for g in found if g.part] + [_in_hull(g.mesh) for g in found if g.mesh]
    return Body(PRIMITIVES, len(found), seconds, _any(tests), add)


def covered(mesh: trimesh.Trimesh, kind: str, options: CollideOptions) -> Body:
    """The shapes of `partwright collide` for a link."""
    start = time.process_time()
    use = MeshUse(Path("mesh"), np.eye(4), mesh)
    link = Link("mesh", np.eye(4), (), (use,))
    target = Solids().target(link, link.collisions)
    tolerance = options.length(target.size, target.size)
    wishes = options.wishes(tolerance, GEOMS, True)
    shapes = shapes_for("mesh", target, wishes)
    seconds = time.process_time() - start

    def add(target: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
        for i, shape in enumerate(shapes):
            if shape.mesh is not None:
                add_hull(target, body, f"cover{i}", shape.mesh)
            else:
                add_solid(body, shape.part)

    tests = [_in_part(s.part) if s.part else _in_hull(s.mesh) for s in shapes]
    return Body(kind, len(shapes), seconds, _any(tests), add)


def add_hull(target: mujoco.MjSpec, body: mujoco.MjsBody, name: str, mesh: trimesh.Trimesh) -> None:
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    target.add_mesh(name=name, uservert=mesh.vertices.ravel(), userface=mesh.faces.ravel(), inertia=shell)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name)


def add_solid(body: mujoco.MjsBody, part: Part) -> None:
    kind = getattr(mujoco.mjtGeom, f"mjGEOM_{part.field.kind.upper()}")
    size = [*geom_size(part.field), 0.0, 0.0][:3]
    body.add_geom(type=kind, size=size, pos=part.translation, quat=part.rotation)


def hulls(mesh: trimesh.Trimesh) -> tuple[Body, list[trimesh.Trimesh]]:
    """CoACD's decomposition with its defaults."""
    start = time.process_time()
    pieces = coacd.run_coacd(coacd.Mesh(mesh.vertices, mesh.faces))
    parts = [as_mesh(hull_of(piece[0])) for piece in pieces]  # trimesh's lose triangles of small ones
    seconds = time.process_time() - start

    def add(target: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
        for i, part in enumerate(parts):
            add_hull(target, body, f"hull{i}", part)

    body = Body(COACD, len(parts), seconds, _any([_in_hull(part) for part in parts]), add)
    return body, parts


def boxes(parts: list[trimesh.Trimesh], seconds: float) -> Body:
    """The smallest box around each hull."""
    start = time.process_time()
    placed = []
    for part in parts:
        to_origin, extents = trimesh.bounds.oriented_bounds(part)
        pose = Similarity.from_matrix(np.linalg.inv(to_origin))
        x, y, z = extents
        placed.append(Part(Box((x, y, z)), pose.translation, pose.rotation))
    seconds += time.process_time() - start

    def add(_: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
        for box in placed:
            size = box.field.bounds()[1]
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=size, pos=box.translation, quat=box.rotation)

    return Body(BOXES, len(placed), seconds, _any([_in_part(box) for box in placed]), add)


def _in_part(part: Part) -> Inside:
    return lambda points: part.distance(points) < 0


def _in_hull(hull: trimesh.Trimesh) -> Inside:
    normals, offsets = faces_of(as_manifold(hull))  # slivers in flat faces cut nothing off there

    def inside(points: np.ndarray) -> np.ndarray:
        near = ((points > hull.bounds[0]) & (points < hull.bounds[1])).all(axis=1)
        near[near] = (points[near] @ normals.T < offsets).all(axis=1)
        return near

    return inside


def _any(tests: list[Inside]) -> Inside:
    return lambda points: np.any([test(points) for test in tests], axis=0)


def volume_errors(body: Body, target: Inside, bounds: np.ndarray) -> tuple[float, float]:
    """Missing and extra volume over the target's, at random points of a box a third larger than its own."""
    room = np.ptp(bounds, axis=0) / 6
    points = np.random.default_rng(0).uniform(bounds[0] - room, bounds[1] + room, (POINTS, 3))
    inside, ours = target(points), body.inside(points)
    return float((inside & ~ours).sum() / inside.sum()), float((ours & ~inside).sum() / inside.sum())


def simulate(body: Body, properties: MassProperties, height: float) -> tuple[float, float]:
    """Microseconds a step and contacts, means over copies that fall onto a plane and one another, turned
    otherwise each time: how they come to lie is chance, and counts for more than what they are made of."""
    turns = np.random.default_rng(0).normal(size=(DROPS, COPIES, 4))
    turns /= np.linalg.norm(turns, axis=2, keepdims=True)
    step, contacts = np.mean([dropped(body, properties, height, each) for each in turns], axis=0)
    return float(step), float(contacts)


def dropped(body: Body, properties: MassProperties, height: float, turns: np.ndarray) -> tuple[float, float]:
    """One drop. turns: (COPIES, 4) quaternions."""
    link = mujoco.MjSpec()
    root = link.worldbody.add_body(name="link")
    root.add_freejoint()
    root.explicitinertial, root.mass = True, properties.mass(DENSITY)
    root.ipos = properties.centre
    inertia = properties.inertia * DENSITY
    root.fullinertia = [*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]
    body.add(link, root)
    scene = mujoco.MjSpec()
    scene.memory = 1 << 29  # boxes around hulls overlap in thousands of contacts
    scene.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[5, 5, 0.1])
    for i in range(COPIES):
        frame = scene.worldbody.add_frame(
            pos=[0.1 * height * (i % 2), 0, 0.1 + (i + 0.6) * height], quat=turns[i]
        )
        scene.attach(link.copy(), prefix=f"{i}/", frame=frame)
    model = scene.compile()
    data = mujoco.MjData(model)
    contacts, start = 0, time.process_time()
    for _ in range(STEPS):
        mujoco.mj_step(model, data)
        contacts += data.ncon
    seconds = time.process_time() - start
    if not np.isfinite(data.qpos).all():
        raise SystemExit(f"{body.kind}: the simulation blew up")
    return 1e6 * seconds / STEPS, contacts / STEPS


def measure(
    path: Path, name: str, unit: str, method: str, options: dict[str, Any], kept: list[Row]
) -> Iterator[Row]:
    """Rows of one shape; those that are kept are not measured again."""
    known = {row.kind: row for row in kept}
    shape = pw.load_shape(path, unit=unit, up="z")
    frame = to_metres_z_up(Assembly((Part(Box((1, 1, 1))),), unit=unit, up="z"))
    mesh = trimesh.Trimesh(frame(shape.vertices), shape.faces, process=False)

    def target(points: np.ndarray) -> np.ndarray:
        return shape.signed_distance(frame.inverse()(points)) < 0

    bodies: list[Body] = []
    if PRIMITIVES not in known:
        bodies.append(fitted(shape, method, options))
    if not {COACD, BOXES} <= set(known):
        decomposed, parts = hulls(mesh)
        bodies += [decomposed, boxes(parts, decomposed.seconds)]
    height = float(np.linalg.norm(mesh.extents))
    errors = {body.kind: volume_errors(body, target, mesh.bounds) for body in bodies}
    pieces = known[COACD].pieces if COACD in known else decomposed.pieces
    theirs = known[COACD].missing + known[COACD].extra if COACD in known else sum(errors[COACD])
    for kind, wanted in (
        (COLLIDE, CollideOptions()),
        (COUNTED, CollideOptions(max_parts=pieces, extra=max(BEFORE_BALANCING * theirs, LEAST_EXTRA))),
    ):
        if kind not in known:
            bodies.append(covered(mesh, kind, wanted))
    for body in bodies:
        missing, extra = errors.get(body.kind) or volume_errors(body, target, mesh.bounds)
        step, contacts = simulate(body, mass_properties(mesh), height)
        solidity = mesh.volume / mesh.convex_hull.volume
        yield Row(name, body.kind, body.pieces, missing, extra, step, contacts, body.seconds, solidity)


def document(rows: list[Row], command: str) -> str:
    lines = [
        "# Collision bodies in MuJoCo",
        "",
        f"`{command}`; MuJoCo {mujoco.__version__}, CoACD with its defaults; {os.cpu_count()} cores.",
        "",
        "Missing and extra: volume that the body lacks or adds, in % of the shape's own. Step time and",
        f"contacts: means over {DROPS} drops of {STEPS} steps, of {COPIES} copies that fall onto a plane and",
        "one another, turned at random.",
        "Seconds: CPU seconds to make the body from the mesh; for primitives that is a fit. collide: the",
        "shapes of `partwright collide`; CoACD's count: with `--max-parts` as many at most as CoACD makes",
        f"hulls, and `--extra` {BEFORE_BALANCING:.0%} of its missing and extra volume, no less than "
        f"{LEAST_EXTRA:.1%}: faces",
        "that are then moved inwards bring it to about half where so many shapes suffice.",
        "Solidity: the shape's volume over its hull's.",
        "",
        "| shape | solidity | body | pieces | missing % | extra % | step us | contacts | seconds |",
        "|---|---:|---|---:|---:|---:|---:|---:|---:|",
    ]
    for r in rows:
        volumes = f"{100 * r.missing:.1f} | {100 * r.extra:.1f}"
        costs = f"{r.step:.0f} | {r.contacts:.1f} | {r.seconds:.1f}"
        lines.append(f"| {r.shape} | {r.solidity:.2f} | {r.kind} | {r.pieces} | {volumes} | {costs} |")
    return "\n".join(lines) + "\n"


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = parser.add_argument
    option("--shapes", type=Path, default=OWN_SHAPES, metavar="FOLDER", help="a folder of PLY meshes")
    option("--names", default="", metavar="A,B", help="paths within it, without suffix; all if not given")
    option("--unit", default="m", help="length unit of the meshes (default: %(default)s)")
    option("--rows", type=Path, required=True, help="measured rows, kept between runs")
    option("--max-parts", type=int, metavar="N", help="of the fit")
    option("--method", default="superfrusta", metavar="NAME", help="of the fit (default: %(default)s)")
    option("--clean", action="store_true", help="of the fit")
    option("--target", type=Path, default=TARGET, metavar="FILE", help="the table")
    options = parser.parse_args()
    paths = {str(p.relative_to(options.shapes).with_suffix("")): p for p in options.shapes.rglob("*.ply")}
    names = options.names.split(",") if options.names else sorted(paths)
    if missing := set(names) - set(paths):
        raise SystemExit(f"{options.shapes} holds no mesh called {', '.join(sorted(missing))}")
    coacd.set_log_level("error")
    command = " ".join(
        ["python benchmarks/collision.py --shapes", options.shapes.name, "--names", ",".join(names)]
    )
    command += f" --max-parts {options.max_parts}" if options.max_parts else ""
    command += f" --method {options.method}" if options.method != "superfrusta" else ""
    command += f" --unit {options.unit}" if options.unit != "m" else ""
    command += " --clean" if options.clean else ""
    about = {"clean": options.clean} | ({"max_parts": options.max_parts} if options.max_parts else {})
    kept = options.rows.read_text().splitlines() if options.rows.exists() else []
    rows = [Row(**json.loads(line)) for line in kept]
    for name in names:
        own = [row for row in rows if row.shape == name]
        more = list(measure(paths[name], name, options.unit, options.method, about, own))
        rows += more
        rows.sort(key=lambda row: (names.index(row.shape), KINDS.index(row.kind)))
        with options.rows.open("a") as file:
            file.writelines(json.dumps(dataclasses.asdict(row)) + "\n" for row in more)
        write_bytes(options.target, document(rows, command).encode())
    print(document(rows, command))
    return 0


if __name__ == "__main__":
    sys.exit(main())
