"""`partwright fit`: a shape in, a folder with the assembly, meshes, report and preview out."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.assembly_argument import assembly_file
from partwright.cli.lengths import length
from partwright.cli.outputs import Group, add_output_folder
from partwright.cli.reading import add_reading


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "fit",
        help="fit an assembly of parts to a shape",
        description="Fits an assembly of parts to a shape. Writes assembly.json, parts.glb, surface.ply, "
        "report.json and preview.png.",
    )
    _add_input(command.add_argument_group("input"))
    method = command.add_argument_group("method and budget")
    add_method(method)
    _add_finish(method)
    lengths = "lengths: 0.5 in the shape's unit, 0.5mm, or 1% of its longest side"
    _add_bounds(command.add_argument_group("bounds", lengths))
    _add_start(command.add_argument_group("start"))
    _add_what_is_written(command.add_argument_group("output"))
    _add_running(command.add_argument_group("running"))
    command.set_defaults(run="fit")


def _add_input(group: Group) -> None:
    group.add_argument(
        "shape",
        metavar="SHAPE",
        type=Path,
        help="mesh, scene, points, grid or STEP file; with --via a picture",
    )
    add_reading(group)
    group.add_argument(
        "--via",
        metavar="GENERATOR",
        help="what makes a mesh of the picture: a command with {input} and {output} in it, or the "
        "address of a service that answers with a GLB; its mesh is kept as generated.glb",
    )
    group.add_argument(
        "--via-timeout",
        metavar="SECONDS",
        type=float,
        help="how long the generator may take (default: 600)",
    )


def add_method(group: Group) -> None:
    """Options that choose the method and what it may spend."""
    option = group.add_argument
    option(
        "--method",
        metavar="NAME",
        default="superfrusta",
        help="superfrusta; solids: boxes, cylinders and other named solids; capri: a CSG tree of quadrics; "
        "parts: those of a learned model; or one that an installed package adds (default: %(default)s)",
    )
    option("--model", metavar="MODEL", help="of method parts: a model that ships, or a file (.safetensors)")
    option(
        "--quality",
        choices=("draft", "normal", "high"),
        default="normal",
        help="how much time to spend; of high, superfrusta and solids keep the best of four growths, in "
        "about three times the time of normal (default: %(default)s)",
    )
    option("--max-parts", metavar="N", type=int, help="at most N parts")
    option("--min-iou", metavar="X", type=float, help="stop at the fewest parts that reach IoU X")
    option(
        "--symmetry",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="parts that are alike, on both sides or in several places, come as repeats (default: on)",
    )
    option(
        "--subtract",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="parts may also be subtracted: holes, slots, pockets (default: on for solids and capri, for "
        "superfrusta where that is clearly better)",
    )


def _add_finish(group: Group) -> None:
    option = group.add_argument
    option("--per-node", action="store_true", help="fit each node of a scene by itself")
    option("--clean", action="store_true", help="make numbers plain and relations exact after the fit")
    option(
        "--clean-tolerance",
        metavar="X",
        type=float,
        help="how much further from the shape cleaning may move any part, on average, in the shape's units "
        "(default: half a thousandth of the longest side, or the noise of the mesh)",
    )


def _add_bounds(group: Group) -> None:
    group.add_argument(
        "--tolerance",
        metavar="T",
        type=length,
        help="the fewest parts whose surface is nowhere further than T from the shape's",
    )
    for name, text in (
        ("--contain", "the parts contain the shape, but for SLACK (0)"),
        ("--inside", "the parts stay inside the shape, but for SLACK (0)"),
    ):
        group.add_argument(name, metavar="SLACK", nargs="?", const="0", type=length, help=text)


def _add_start(group: Group) -> None:
    group.add_argument(
        "--start", metavar="ASSEMBLY", type=assembly_file, help="refine and continue this assembly or fit"
    )
    group.add_argument(
        "--lock", metavar="NAMES", help="parts of the start that stay as they are, separated by commas"
    )


def _add_what_is_written(group: Group) -> None:
    add_output_folder(group)
    group.add_argument(
        "--curve", action="store_true", help="also write smaller and smaller assemblies, and a picture"
    )
    group.add_argument(
        "--density", metavar="D", type=float, help="in kg/m3: the report then has mass and inertia"
    )


def _add_running(group: Group) -> None:
    option = group.add_argument
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
