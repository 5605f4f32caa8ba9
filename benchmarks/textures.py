"""How well maps of parts keep the colours of a textured shape: PSNR of eight views at 512 x 512.

    python benchmarks/textures.py --shapes FOLDER --output benchmarks/results/textures.md

Each shape is fitted, its colours are baked into maps of 128 texels a side, and both are seen without light,
by the same rays, from other sides than those that maps are optimised for. "Not optimised" are means of what
is nearest to the surface. PSNR is of all pixels ("picture": outlines count) and of those where both are met
("surface": colours alone). Then GLB as it is exported and read again, part by part and as the one surface of
all parts (--joined). Normals: the same views of a white surface in light, with smooth parts and with
normal maps where these pay. For comparison, the part's mean colour instead of its map. Three shapes have
textures of their own, three are painted here: bands and blots that are functions of the place.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

import partwright as pw
from partwright.assembly import Assembly
from partwright.export import export
from partwright.meshing import mesh_assembly
from partwright.render.camera import View
from partwright.render.raycast import Scene
from partwright.textures import Colours, bake, load_colours, part_map
from partwright.textures.likeness import (
    SIDE,
    VIEWS,
    around,
    likeness,
    map_colours,
    picture,
    psnr,
    seen,
    without_relief,
)
from partwright.textures.maps import RELIEF

NAMES = ("dirty/Duck.glb", "dirty/CesiumMilkTruck.glb", "dirty/fuze.obj")
PAINTED = ("toys/mug.ply", "toys/penguin.ply", "toys/ycb_mustard_bottle.ply")
FINE = 1 / 150  # of the longest side: edges of painted shapes


def mean_colours(assembly: Assembly, points: np.ndarray) -> np.ndarray:
    owner = np.abs(assembly.part_distances(points)).argmin(axis=0)
    means = [t.image.mean(axis=(0, 1)) if (t := part_map(part)) else np.zeros(3) for part in assembly.parts]
    return np.array(means)[owner]


def painted(path: Path, folder: Path) -> Path:
    """A copy with colours at its vertices: soft ones, bands with sharp edges, and blots."""
    mesh: Any = trimesh.load(path, process=False)
    mesh = mesh.subdivide_to_size(FINE * float(mesh.extents.max()), max_iter=20)
    x, y, z = (np.asarray(mesh.vertices) / float(mesh.extents.max())).T
    soft = 127 + 100 * np.sin(6 * np.stack([x + y, y + 2 * z, z - x], axis=1))
    soft[np.sin(25 * (y + 0.3 * x)) > 0.6] = (30, 60, 160)
    soft[np.sin(17 * x) * np.sin(17 * y) * np.sin(17 * z) > 0.5] = (240, 230, 40)
    mesh.visual.vertex_colors = np.column_stack([soft, np.full(len(soft), 255)]).round().astype(np.uint8)
    target = folder / path.name
    mesh.export(target)
    return target


def fitted(path: Path, quality: str, size: int) -> tuple[Any, Colours, Any, Assembly, tuple[float, float]]:
    """The shape, its colours, the fit, its assembly with maps, and CPU seconds of the fit and of the maps."""
    shape, colours = pw.load_shape(path), load_colours(path)
    start = time.process_time()
    result = pw.fit(shape, quality=quality, symmetry=False)
    middle = time.process_time()
    baked = bake(result.assembly, colours, size)
    return shape, colours, result, baked, (middle - start, time.process_time() - middle)


def picture_of(assembly: Assembly, view: View) -> np.ndarray:
    mesh = mesh_assembly(assembly)
    pixel, _, _, places = seen(Scene(mesh.vertices, mesh.faces), view)
    return picture(pixel, map_colours(assembly, places))


def write_pictures(shapes: Path, quality: str, size: int, path: Path) -> None:
    """Beside one another: two shapes, their parts, and the parts after edits, maps and all."""
    from PIL import Image

    rows = []
    for name, edit in ((NAMES[0], _bent), (NAMES[2], _squared)):
        shape, colours, _, baked, _ = fitted(shapes / name, quality, size)
        view = around(shape.vertices, shape.up)[0]
        pixel, face, weights, _ = seen(Scene(colours.vertices, colours.faces), view, colours)
        row = [picture(pixel, colours.on_faces(face, weights))]
        row += [picture_of(one, view) for one in (baked, edit(baked))]
        rows.append(np.concatenate([one.reshape(SIDE, SIDE, 3) for one in row], axis=1))
    image = Image.fromarray(np.concatenate(rows).clip(0, 255).round().astype(np.uint8))
    path.parent.mkdir(parents=True, exist_ok=True)
    image.resize((image.width * 5 // 8, image.height * 5 // 8), Image.Resampling.LANCZOS).save(
        path, optimize=True
    )


def _largest(assembly: Assembly) -> Any:
    return max(assembly.parts, key=lambda part: float(np.prod(np.ptp(part.bounds(), axis=0))))


def _bent(assembly: Assembly) -> Assembly:
    """The largest part flat at the top and a third longer across."""
    part = _largest(assembly)
    size = tuple(v * f for v, f in zip(part.field.size, (1.3, 0.8, 0.8), strict=True))
    return assembly.replace_part(part.name, replace(part, field=replace(part.field, size=size, taper=0.6)))


def _squared(assembly: Assembly) -> Assembly:
    """The largest part with square corners."""
    part = _largest(assembly)
    return assembly.replace_part(
        part.name, replace(part, field=replace(part.field, roundness=0.0, bulge=0.0))
    )


def measured(path: Path, name: str, quality: str, size: int) -> list[str]:
    shape, colours, result, baked, seconds = fitted(path, quality, size)
    truth = Scene(colours.vertices, colours.faces)
    mesh = mesh_assembly(baked)
    parts = Scene(mesh.vertices, mesh.faces)
    start = time.process_time()
    plain = bake(result.assembly, colours, size, optimise=False)
    plainly = time.process_time() - start
    exported, took = (
        {},
        {
            "maps": f"{seconds[0]:.0f} + {seconds[1]:.1f}",
            "maps, not optimised": f"{plainly:.1f}",
        },
    )
    for kind, options in (("GLB", {}), ("GLB, joined", {"joined": True})):
        with tempfile.TemporaryDirectory() as folder:
            start = time.process_time()
            export(replace(baked, unit=None, up=None), Path(folder) / "a.glb", **options)
            took[kind] = f"{time.process_time() - start:.1f}"
            glb = load_colours(Path(folder) / "a.glb")
        exported[kind] = glb, Scene(glb.vertices, glb.faces)
    scores: dict[str, list[tuple[float, float]]] = {}
    for view in around(shape.vertices, shape.up):
        pixel, face, weights, _ = seen(truth, view, colours)
        want = picture(pixel, colours.on_faces(face, weights))
        own, _, _, places = seen(parts, view)
        found = {"maps": (own, map_colours(baked, places))}
        found["maps, not optimised"] = (own, map_colours(plain, places))
        for kind, (glb, scene) in exported.items():
            at, face, weights, _ = seen(scene, view)
            found[kind] = (at, glb.on_faces(face, weights))
        found["one colour a part"] = (own, mean_colours(baked, places))
        for kind, (where, colour) in found.items():
            both = np.intersect1d(where, pixel)
            got = picture(where, colour)
            scores.setdefault(kind, []).append((psnr(got, want), psnr(got[both], want[both])))
    kilobytes = sum(len(str(p.metadata.get("texture", ""))) for p in baked.parts) / 1000
    rows = []
    for kind, values in scores.items():
        whole, surface = np.mean(values, axis=0)
        head = f"{name} | {len(baked)} | {result.scores.iou:.3f} | {kilobytes:.0f}" if not rows else " | | |"
        rows.append(f"| {head} | {kind} | {whole:.1f} | {surface:.1f} | {took.get(kind, '')} |")
    bent = [p for p in baked.parts if RELIEF in p.metadata]
    kilobytes = sum(len(str(p.metadata[RELIEF])) for p in bent) / 1000
    lit = likeness([without_relief(baked), baked], colours, lit=True)
    for kind, (whole, surface) in zip(("", f"{kilobytes:.0f}"), lit, strict=True):
        told = f"{len(bent)} normal maps" if kind else "smooth"
        rows.append(f"|  | | | {kind} | white in light, {told} | {whole:.1f} | {surface:.1f} |  |")
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--output", type=Path)
    parser.add_argument(
        "--shapes",
        type=Path,
        required=True,
        metavar="FOLDER",
        help=f"that holds {', '.join((*NAMES, *PAINTED))}",
    )
    parser.add_argument("--quality", default="normal")
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--picture", type=Path, help="draws two of them instead, before and after edits")
    arguments = parser.parse_args()
    if arguments.picture:
        write_pictures(arguments.shapes, arguments.quality, arguments.size, arguments.picture)
        return
    command = "python benchmarks/textures.py --shapes FOLDER --output benchmarks/results/textures.md"
    lines = [
        "# Colours in maps of parts",
        "",
        f"Made by `{command}`: {VIEWS} views of {SIDE} x {SIDE} pixels without light, maps of "
        f"{arguments.size} texels a side, quality {arguments.quality}. Painted: colours that are functions",
        "of the place, made here. Seconds are CPU seconds: of the fit and the maps, and of the export.",
        "",
        "| shape | parts | IoU | kB of maps | colours | PSNR of pictures | PSNR of the surface | seconds |",
        "|---|---|---|---|---|---|---|---|",
    ]
    with tempfile.TemporaryDirectory() as folder:
        for name in (*NAMES, *PAINTED):
            path, told = arguments.shapes / name, Path(name).name
            if name in PAINTED:
                path, told = painted(path, Path(folder)), f"{told}, painted"
            rows = measured(path, told, arguments.quality, arguments.size)
            print("\n".join(rows), flush=True)
            lines += rows
    if arguments.output:
        arguments.output.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
