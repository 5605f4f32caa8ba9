"""Every format of fitted assemblies: size, volume, what was approximated, what another program reads back.

    partwright fit SHAPE -o FITS/NAME          # for each shape, by each method
    python benchmarks/formats.py FITS ... --learned cars:0,chairs:1 --rows rows.jsonl

Readers: trimesh (GLB, OBJ, PLY, STL, 3MF), usd-core with all its validators, MuJoCo, yourdfpy, OpenCASCADE,
openscad, build123d, blender, glslangValidator; a format whose program is not installed is written only. What
--rows holds is not measured again, so a run may be cut off and go on. The table goes to
benchmarks/results/formats.md, or to --target: scenes.md there is of --formats .glb,.usdc,.mjcf.xml,.urdf.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import trimesh

import partwright as pw
from partwright.assembly import Assembly, Node
from partwright.atomic_io import report_path
from partwright.errors import PartwrightError
from partwright.meshing import mesh_assembly
from partwright.shapes import METRES

TARGET = Path(__file__).parent / "results" / "formats.md"
METRIC = (".glb", ".usdc", ".mjcf.xml", ".urdf", ".step")  # read in metres, where the unit is known
# No blends: held against the assembly without them.
SHARP = (*METRIC, ".scad", ".build123d.py")
PATIENCE = 400  # seconds for another program
CELLS = 256  # along the longest side of the mesh whose volume counts as the assembly's own
_BLENDER = """
import bpy
bpy.context.view_layer.update()
print("objects", len(bpy.data.objects))
"""
_BUILD123D = "import runpy, sys; print('volume', runpy.run_path(sys.argv[1])['assembly'].volume)"


@dataclass(frozen=True)
class Row:
    """One file. volume: the reader's over the assembly's own, minus 1; None where it tells none.

    write, read: CPU seconds.
    """

    method: str
    name: str
    suffix: str
    size: int
    write: float
    read: float | None
    volume: float | None
    changed: int
    worst: float | None
    problem: str = ""


def plain(node: Node) -> Node:
    """Without blends."""
    if isinstance(node, Assembly):
        return dataclasses.replace(node, children=tuple(map(plain, node.children)), blend=0.0)
    return dataclasses.replace(node, blend=0.0)


def command(*words: str | Path) -> str:
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, check=False)
    if done.returncode:
        raise RuntimeError((done.stderr or done.stdout).strip().splitlines()[-1][:80])
    return done.stdout


def read_mesh(path: Path) -> float:
    """Closed also where sheets touch along an edge, which is then one of four faces."""
    mesh = trimesh.load_mesh(path)
    size = len(mesh.vertices)
    forth, back = (np.sort(edges @ (size, 1)) for edges in (mesh.edges, mesh.edges[:, ::-1]))
    if not np.array_equal(forth, back):
        raise RuntimeError("not watertight")
    return float(mesh.volume)


def shown_volume(meshes: list[trimesh.Trimesh]) -> float:
    """Of all that a scene shows, what overlaps counted once."""
    from manifold3d import Manifold, Mesh64, OpType

    places = np.concatenate([mesh.vertices for mesh in meshes])
    middle, side = places.mean(axis=0), float(np.ptp(places, axis=0).max())
    solids = []
    for mesh in meshes:
        merged = trimesh.Trimesh((mesh.vertices - middle) / side, mesh.faces)
        solids.append(Manifold(Mesh64(np.array(merged.vertices), np.array(merged.faces, np.uint64))))
        if solids[-1].is_empty() and len(mesh.faces):
            raise RuntimeError("a part is not closed")
    return float(Manifold.batch_boolean(solids, OpType.Add).volume()) * side**3


def read_glb(path: Path) -> float:
    return shown_volume(list(trimesh.load_scene(path).dump()))


def read_usd(path: Path) -> float:
    """In metres; guides are not shown."""
    from pxr import Usd, UsdGeom, UsdValidation

    stage = Usd.Stage.Open(str(path))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    if errors:
        raise RuntimeError(errors[0].GetMessage()[:80])
    meshes = []
    for prim in stage.Traverse(Usd.TraverseInstanceProxies()):
        mesh = UsdGeom.Mesh(prim)
        if mesh and mesh.ComputePurpose() != UsdGeom.Tokens.guide:
            matrix = np.array(mesh.ComputeLocalToWorldTransform(0))
            points = np.array(mesh.GetPointsAttr().Get(), np.float64) @ matrix[:3, :3] + matrix[3, :3]
            faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
            meshes.append(trimesh.Trimesh(points, faces))
    return shown_volume(meshes) * float(UsdGeom.GetStageMetersPerUnit(stage)) ** 3


def read_mjcf(path: Path) -> float:
    """What MuJoCo shows, geoms of the first three groups, by the meshes that it holds."""
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    meshes = []
    for geom in np.flatnonzero(model.geom_group <= 2):
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
        meshes.append(geom_mesh(model, int(geom)).apply_transform(pose))
    mujoco.mj_step(model, data)
    return shown_volume(meshes)


def geom_mesh(model: Any, geom: int) -> trimesh.Trimesh:
    """A geom in its own frame."""
    from partwright.approximation.ellipsoid import Ellipsoid
    from partwright.assembly import Part
    from partwright.fields import Box, Capsule, Cylinder, Sphere
    from partwright.meshing import mesh_part

    size = model.geom_size[geom].tolist()
    kinds: list[Callable[[], Any]] = [
        lambda: Sphere(size[0]),
        lambda: Capsule(size[0], 2 * size[1]),
        lambda: Ellipsoid(tuple(size)),
        lambda: Cylinder(size[0], 2 * size[1]),
        lambda: Box(tuple(2 * side for side in size)),
    ]
    kind = int(model.geom_type[geom]) - 2  # after mjtGeom: a plane and a height field come before
    if kind < len(kinds):
        return mesh_part(Part(kinds[kind]()), 64)
    mesh = model.geom_dataid[geom]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    begin, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    return trimesh.Trimesh(model.mesh_vert[first : first + count], model.mesh_face[begin : begin + faces])


def read_urdf(path: Path) -> float:
    """What a viewer shows; what collides is loaded, too."""
    import yourdfpy

    robot = yourdfpy.URDF.load(str(path), build_collision_scene_graph=True, load_collision_meshes=True)
    return shown_volume([mesh for mesh in robot.scene.dump() if isinstance(mesh, trimesh.Trimesh)])


def read_step(path: Path) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(reader.OneShape(), properties)
    return float(properties.Mass()) / 1e9  # cubic metres, as it reads all files in millimetres


def read_scad(path: Path) -> float:
    command("openscad", "-o", path.with_suffix(".stl"), path)
    return read_mesh(path.with_suffix(".stl"))


def read_build123d(path: Path) -> float:
    return float(command(sys.executable, "-c", _BUILD123D, path).rsplit(maxsplit=1)[-1])


def read_blender(path: Path) -> None:
    check = path.with_name("check.py")
    check.write_text(_BLENDER)
    command("blender", "-b", "--factory-startup", "--python-exit-code", "3", "-P", path, "-P", check)


def read_glsl(path: Path) -> None:
    shader = path.with_suffix(".frag")
    main = "out vec4 c; void main() { c = vec4(sdf(gl_FragCoord.xyz)); }"
    shader.write_text(f"#version 330\n{path.read_text()}\n{main}\n")
    command("glslangValidator", shader)


READERS: dict[str, tuple[str, Callable[[Path], float | None]]] = {
    ".glb": ("", read_glb),
    ".usdc": ("", read_usd),
    ".obj": ("", read_mesh),
    ".ply": ("", read_mesh),
    ".stl": ("", read_mesh),
    ".3mf": ("", read_mesh),
    ".mjcf.xml": ("", read_mjcf),
    ".urdf": ("", read_urdf),
    ".step": ("", read_step),
    ".scad": ("openscad", read_scad),
    ".build123d.py": ("", read_build123d),
    ".glsl": ("glslangValidator", read_glsl),
    ".blender.py": ("blender", read_blender),
}


def cpu_seconds() -> float:
    """Of this process and of the programs that it ran."""
    usages = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def measure(method: str, name: str, assembly: Assembly, suffix: str, own: float, path: Path) -> Row:
    """own: the volume of what the format should hold."""
    program, reader = READERS[suffix]
    start = cpu_seconds()
    try:
        pw.export(assembly, path)
    except PartwrightError as error:
        return Row(method, name, suffix, 0, 0.0, None, None, 0, None, f"not written: {error}")
    wrote, start = cpu_seconds() - start, cpu_seconds()
    problem, volume, read = "", None, None
    if not program or shutil.which(program):
        try:
            volume = reader(path)
            read = cpu_seconds() - start
        except subprocess.TimeoutExpired:
            problem = f"not read within {PATIENCE} s"
        except (RuntimeError, ValueError) as error:
            problem = f"not read: {error}"[:120]
    report = report_path(path)
    told = json.loads(report.read_text())["approximated"] if report.exists() else []
    shares = [change["volume_error_ratio"] for change in told if "volume_error_ratio" in change]
    changed = sum(len(change["parts"]) for change in told)
    return Row(
        method,
        name,
        suffix,
        path.stat().st_size,
        wrote,
        read,
        None if volume is None else volume / own - 1,
        changed,
        max(shares, default=None),
        problem,
    )


def cells(rows: list[Row]) -> str:
    """Medians over assemblies, and the worst."""
    size = median(row.size for row in rows) / 1000
    reads = [row.read for row in rows if row.read is not None]
    volumes = [abs(row.volume) for row in rows if row.volume is not None]
    shares = [row.worst for row in rows if row.worst is not None]
    return " | ".join(
        (
            f"{len(rows)}",
            f"{size:.0f}",
            f"{median(row.write for row in rows):.2f}",
            f"{median(reads):.2f}" if reads else "",
            f"{100 * median(volumes):.2f} ({100 * max(volumes):.2f})" if volumes else "",
            f"{sum(row.changed for row in rows) / len(rows):.1f}",
            f"{100 * median(shares):.0f} ({100 * max(shares):.0f})" if shares else "",
            f"{sum(bool(row.problem) for row in rows)}",
        )
    )


def document(rows: list[Row], formats: str = ",".join(READERS)) -> str:
    asked = "" if formats == ",".join(READERS) else f" --formats {formats}"
    lines = [
        "# Every format, written and read back",
        "",
        f"`python benchmarks/formats.py FITS{asked}`; {os.cpu_count()} cores. Medians over the assemblies,",
        "the worst in brackets. Volume: of what the reader is shown, overlaps counted once, off the",
        f"assembly's own (of formats that cannot hold blends: without them), by a mesh of {CELLS} cells",
        "along its longest side. Changed: parts in FILE.report.json, dropped blends included; by: the most",
        "that one part was changed by, in % of its volume. Seconds are CPU seconds, with the start of other",
        "programs.",
    ]
    for method in dict.fromkeys(row.method for row in rows):
        names = sorted({row.name for row in rows if row.method == method})
        lines += [
            "",
            f"## {method}",
            "",
            f"{len(names)} assemblies: {', '.join(names)}.",
            "",
            "| format | files | kB | s to write | s to read | volume off % | changed parts | by % | failed |",
            "|---|---:|---:|---:|---:|---:|---:|---:|---:|",
        ]
        for suffix in READERS:
            own = [row for row in rows if (row.method, row.suffix) == (method, suffix)]
            if own:
                lines.append(f"| `{suffix}` | {cells(own)} |")
    problems = [f"- {row.method}, {row.name}, `{row.suffix}`: {row.problem}" for row in rows if row.problem]
    if problems:
        lines += ["", "## What failed", "", *problems]
    return "\n".join(lines) + "\n"


def assemblies(folders: list[Path], learned: list[str]) -> Iterator[tuple[str, str, Callable[[], Assembly]]]:
    """Method and name of every result in the folders and of every learned shape, and what loads it."""
    paths = (path for folder in folders for path in folder.glob("*/assembly.json"))
    for path in sorted(paths, key=lambda path: path.parent.name):
        method = json.loads(path.with_name("report.json").read_text())["method"]
        yield method, path.parent.name, partial(pw.load_assembly, path)
    for name in learned:
        yield "partsdf", name, partial(learned_assembly, name)


def learned_assembly(name: str) -> Assembly:
    from partwright.partsdf.sources import open_source

    source = open_source(name)
    return source.assembly(source.shape)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = parser.add_argument
    option("folders", nargs="*", type=Path, metavar="FITS", help="each holds results of partwright fit")
    option("--rows", type=Path, required=True, help="measured rows, kept between runs")
    option("--learned", default="", metavar="A,B", help="MODEL:NAME, as `partwright parts edit` has them")
    option(
        "--target", type=Path, default=TARGET, metavar="FILE", help="the table (default: results/formats.md)"
    )
    option("--formats", default=",".join(READERS), metavar="A,B", help="suffixes (default: all)")
    options = parser.parse_args()
    kept = options.rows.read_text().splitlines() if options.rows.exists() else []
    rows = [Row(**json.loads(line)) for line in kept]
    done = {(row.method, row.name, row.suffix) for row in rows}
    for method, name, load in assemblies(options.folders, [*filter(None, options.learned.split(","))]):
        wanted = [s for s in options.formats.split(",") if (method, name, s) not in done]
        if not wanted:
            continue
        assembly = load()
        blended, sharp = (mesh_assembly(tree, CELLS).volume for tree in (assembly, plain(assembly)))
        for suffix in wanted:
            with tempfile.TemporaryDirectory() as folder:
                own = sharp if suffix in SHARP else blended
                unit = assembly.unit or ("mm" if suffix == ".step" else "m")
                own *= METRES[unit] ** 3 if suffix in METRIC else 1
                row = measure(method, name, assembly, suffix, own, Path(folder) / f"assembly{suffix}")
            rows.append(row)
            with options.rows.open("a") as file:
                file.write(json.dumps(dataclasses.asdict(row)) + "\n")
            options.target.write_text(document(rows, options.formats), encoding="utf-8")
            print(row, flush=True)
    print(document(rows, options.formats))
    return 0


if __name__ == "__main__":
    sys.exit(main())
