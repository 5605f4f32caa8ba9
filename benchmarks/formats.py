"""Every format of fitted assemblies: size, volume, what was approximated, what another program reads back.

    python benchmarks/formats.py --shapes FOLDER --names toys/mug,cad/bd_rod_end --methods superfrusta
    python benchmarks/formats.py --assemblies FOLDER

The first fits each shape (FOLDER/NAME.ply) by each method; the second takes FOLDER/*/assembly.json as they
are. Readers: trimesh (GLB, OBJ, PLY, STL, 3MF), usd-core, MuJoCo, yourdfpy, OpenCASCADE, openscad, build123d,
blender, glslangValidator; a format whose program is not installed is written only. The table goes to
benchmarks/results/formats.md.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import trimesh

import partwright as pw
from partwright.assembly import Assembly, Node
from partwright.errors import PartwrightError
from partwright.export.approximation import report_path
from partwright.meshing import mesh_assembly

TARGET = Path(__file__).parent / "results" / "formats.md"
SHARP = (".step", ".scad", ".build123d.py")  # no blends: held against the assembly without them
PATIENCE = 300  # seconds for another program
_BLENDER = """
import bpy
bpy.context.view_layer.update()
print("objects", len(bpy.data.objects))
"""
_BUILD123D = "import runpy, sys; print('volume', runpy.run_path(sys.argv[1])['assembly'].volume)"


@dataclass(frozen=True)
class Row:
    """One file. volume: the reader's over the assembly's own, minus 1; None where it tells none."""

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
    mesh = trimesh.load_mesh(path)
    if not mesh.is_watertight:
        raise RuntimeError("not watertight")
    return float(mesh.volume)


def read_scene(path: Path) -> None:
    trimesh.load_scene(path).to_geometry()


def read_usd(path: Path) -> None:
    from pxr import Usd, UsdValidation

    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    errors = UsdValidation.ValidationContext(validators).Validate(Usd.Stage.Open(str(path)))
    if errors:
        raise RuntimeError(errors[0].GetMessage()[:80])


def read_mjcf(path: Path) -> None:
    import mujoco

    model = mujoco.MjModel.from_xml_path(str(path))
    mujoco.mj_step(model, mujoco.MjData(model))


def read_urdf(path: Path) -> None:
    import yourdfpy

    yourdfpy.URDF.load(str(path), build_collision_scene_graph=True, load_collision_meshes=True)


def read_step(path: Path) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()
    reader.ReadFile(str(path))
    reader.TransferRoots()
    properties = GProp_GProps()
    BRepGProp.VolumeProperties_s(reader.OneShape(), properties)
    return float(properties.Mass()) / 1e9  # cubic millimetres


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
    ".glb": ("", read_scene),
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


def measure(method: str, name: str, assembly: Assembly, folder: Path) -> Iterator[Row]:
    blended = mesh_assembly(assembly, 200).volume
    sharp = mesh_assembly(plain(assembly), 200).volume
    for suffix, (program, reader) in READERS.items():
        path = folder / f"assembly{suffix}"
        start = time.perf_counter()
        try:
            pw.export(assembly, path)
        except PartwrightError as error:
            yield Row(method, name, suffix, 0, 0.0, None, None, 0, None, f"not written: {error}")
            continue
        wrote, start = time.perf_counter() - start, time.perf_counter()
        problem, volume, read = "", None, None
        if not program or shutil.which(program):
            try:
                volume = reader(path)
                read = time.perf_counter() - start
            except (RuntimeError, subprocess.TimeoutExpired) as error:
                problem = f"not read: {error}"[:120]
        if volume is not None:
            volume = volume / (sharp if suffix in SHARP else blended) - 1
        report = report_path(path)
        told = json.loads(report.read_text())["approximated"] if report.exists() else []
        shares = [change["volume_error_ratio"] for change in told if "volume_error_ratio" in change]
        changed = sum(len(change["parts"]) for change in told)
        size = path.stat().st_size
        yield Row(
            method, name, suffix, size, wrote, read, volume, changed, max(shares, default=None), problem
        )


def cells(rows: list[Row]) -> str:
    """Medians over assemblies, and the worst."""
    size = median(row.size for row in rows) / 1000
    reads = [row.read for row in rows if row.read is not None]
    volumes = [abs(row.volume) for row in rows if row.volume is not None]
    shares = [row.worst for row in rows if row.worst is not None]
    return " | ".join(
        (
            f"{size:.0f}",
            f"{median(row.write for row in rows):.2f}",
            f"{median(reads):.2f}" if reads else "",
            f"{100 * median(volumes):.2f} ({100 * max(volumes):.2f})" if volumes else "",
            f"{sum(row.changed for row in rows) / len(rows):.1f}",
            f"{100 * median(shares):.0f} ({100 * max(shares):.0f})" if shares else "",
            f"{sum(bool(row.problem) for row in rows)}",
        )
    )


def document(rows: list[Row], line: str) -> str:
    names = ", ".join(dict.fromkeys(row.name for row in rows))
    lines = [
        "# Every format, written and read back",
        "",
        f"`{line}`; {os.cpu_count()} cores. Assemblies: {names}.",
        "",
        "Medians over the assemblies, the worst in brackets. Volume: of what the reader sees, off the",
        "assembly's own (STEP, OpenSCAD and build123d: off the assembly's without its blends, which they",
        "cannot hold). Changed: parts in FILE.report.json, dropped blends included; by: the most that one",
        "part was changed by, in % of its volume. Seconds are wall-clock and other work was going on.",
        "",
        "| method | format | kB | s to write | s to read | volume off % | changed parts | by % | failed |",
        "|---|---|---:|---:|---:|---:|---:|---:|---:|",
    ]
    for method in dict.fromkeys(row.method for row in rows):
        for suffix in READERS:
            own = [row for row in rows if (row.method, row.suffix) == (method, suffix)]
            lines.append(f"| {method} | `{suffix}` | {cells(own)} |")
    problems = [f"- {row.method}, {row.name}, `{row.suffix}`: {row.problem}" for row in rows if row.problem]
    return "\n".join([*lines, "", *problems]).rstrip() + "\n"


def assemblies(options: argparse.Namespace) -> Iterator[tuple[str, str, Assembly]]:
    if options.assemblies:
        for path in sorted(options.assemblies.glob("*/assembly.json")):
            method = json.loads((path.parent / "report.json").read_text())["method"]
            yield method, path.parent.name, pw.load_assembly(path)
        return
    for name in options.names.split(","):
        shape = pw.load_shape(options.shapes / f"{name}.ply", unit="m", up="z")
        for method in options.methods.split(","):
            yield method, name, pw.fit(shape, method, seed=0).assembly


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    option = parser.add_argument
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--shapes", type=Path, metavar="FOLDER", help="holds NAME.ply, in metres")
    source.add_argument("--assemblies", type=Path, metavar="FOLDER", help="holds results of partwright fit")
    option("--names", default="", metavar="A,B", help="shapes to fit")
    option("--methods", default="superfrusta", metavar="A,B", help="default: %(default)s")
    options = parser.parse_args()
    line = "python benchmarks/formats.py " + (
        f"--assemblies {options.assemblies.name}"
        if options.assemblies
        else f"--shapes {options.shapes.name} --names {options.names} --methods {options.methods}"
    )
    rows: list[Row] = []
    for method, name, assembly in assemblies(options):
        with tempfile.TemporaryDirectory() as folder:
            rows += measure(method, name, assembly, Path(folder))
        TARGET.write_text(document(rows, line), encoding="utf-8")
        print(f"{method} {name}", flush=True)
    print(document(rows, line))
    return 0


if __name__ == "__main__":
    sys.exit(main())
