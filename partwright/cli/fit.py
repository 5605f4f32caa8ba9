"""`partwright fit`: a shape in, a folder with the assembly, meshes, report and preview out."""

from __future__ import annotations

import argparse
from pathlib import Path


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "fit",
        help="fit an assembly of parts to a shape",
        description="Fits an assembly of parts to a shape. Writes assembly.json, parts.glb, surface.ply, "
        "report.json and preview.png.",
    )
    option = command.add_argument
    option("shape", metavar="SHAPE", type=Path, help="mesh, scene, points, grid or STEP file")
    option(
        "-o",
        "--output",
        metavar="DIR",
        type=Path,
        default=None,
        help="where to write; SHAPE-parts if not given",
    )
    option(
        "--method",
        choices=("superfrusta", "solids", "capri"),
        default="superfrusta",
        help="kind of parts: SuperFrusta; boxes, cylinders and other named solids; or capri, a CSG tree of "
        "quadrics (default: %(default)s)",
    )
    option(
        "--quality",
        choices=("draft", "normal", "high"),
        default="normal",
        help="how much time to spend (default: %(default)s)",
    )
    option("--max-parts", metavar="N", type=int, help="at most N parts")
    option("--min-iou", metavar="X", type=float, help="stop at the fewest parts that reach IoU X")
    option(
        "--tolerance",
        metavar="T",
        help="the fewest parts whose surface is nowhere further than T from the shape's: 0.5mm, 1%%",
    )
    option(
        "--contain",
        metavar="SLACK",
        nargs="?",
        const="0",
        help="the parts contain the shape, but for SLACK (0)",
    )
    option(
        "--inside",
        metavar="SLACK",
        nargs="?",
        const="0",
        help="the parts stay inside the shape, but for SLACK",
    )
    option("--curve", action="store_true", help="also write smaller and smaller assemblies, and a picture")
    option("--start", metavar="ASSEMBLY", type=Path, help="refine and continue this assembly")
    option("--lock", metavar="NAMES", help="parts of the start that stay as they are, separated by commas")
    option("--per-node", action="store_true", help="fit each node of a scene by itself")
    option(
        "--symmetry",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="where the shape is symmetric, parts come as repeats (default: on)",
    )
    option(
        "--subtract",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="parts may also be subtracted: holes, slots, pockets (default: on for solids only)",
    )
    option("--clean", action="store_true", help="make numbers plain and relations exact after the fit")
    option(
        "--clean-tolerance",
        metavar="X",
        type=float,
        help="how much further from the shape cleaning may move any part, on average, in the shape's units "
        "(default: half a thousandth of the longest side)",
    )
    option("--unit", metavar="U", help="length unit of the shape: um, mm, cm, m, km, in, ft")
    option("--density", metavar="D", type=float, help="in kg/m3: the report then has mass and inertia")
    option("--up", metavar="AXIS", help="axis that points up: x, y, z, -x, -y, -z")
    option(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="auto",
        help="what computes (default: %(default)s)",
    )
    option(
        "--seed",
        metavar="S",
        type=int,
        default=0,
        help="the same seed makes a run repeat (default: %(default)s)",
    )
    option("--threads", metavar="N", type=int, default=0, help="threads to use (default: one per core)")
    command.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    from partwright.assembly import load_assembly
    from partwright.atomic_io import check_folder
    from partwright.cli.interrupts import raising
    from partwright.cli.progress import Display
    from partwright.cli.tables import print_relations, print_result
    from partwright.cli.terminal import warn
    from partwright.fitting import fit
    from partwright.shapes import load_shape

    folder: Path = arguments.output or Path(f"{arguments.shape.stem}-parts")
    check_folder(folder)
    with raising(), Display() as display:
        shape = load_shape(arguments.shape, unit=arguments.unit, up=arguments.up)
        result = fit(
            shape,
            arguments.method,
            quality=arguments.quality,
            max_parts=arguments.max_parts,
            min_iou=arguments.min_iou,
            curve=arguments.curve,
            start=load_assembly(arguments.start) if arguments.start else None,
            locked=[name for name in (arguments.lock or "").split(",") if name],
            per_node=arguments.per_node,
            symmetry=arguments.symmetry,
            subtract=arguments.subtract,
            seed=arguments.seed,
            device=arguments.device,
            threads=arguments.threads,
            progress=display.show,
            source=arguments.shape.name,
            density=arguments.density,
            tolerance=arguments.tolerance,
            contain=arguments.contain,
            inside=arguments.inside,
            clean=arguments.clean,
            clean_tolerance=arguments.clean_tolerance,
        )
        display.stage("writing")
        result.save(folder)
    print_result(result, folder)
    if result.clean:
        print_relations(result.clean)
    warn(result.warnings)
    if result.outcome == "interrupted":
        warn([f"interrupted: {folder} holds the best assembly so far"])
        return 130
    return 0
