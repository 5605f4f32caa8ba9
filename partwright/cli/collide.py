"""`partwright collide`: a whole robot with simple collision shapes."""

from __future__ import annotations

import argparse
from pathlib import Path

from partwright.cli.lengths import length, share
from partwright.cli.outputs import add_output


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "collide",
        help="replace a robot's collision meshes by few simple shapes",
        description="Reads a robot (URDF, SDFormat, MJCF, USD, or a folder of meshes) and writes it into "
        "FOLDER with convex shapes in the place of its collision meshes, the meshes it needs, a report, and "
        "a picture of both.",
    )
    command.add_argument(
        "robot",
        metavar="ROBOT",
        type=Path,
        help="its file: .urdf, .sdf, .xml, .mjcf or .usd, or a folder of meshes",
    )
    add_output(
        command,
        "FOLDER",
        "where to write",
        reads=_reads,
        writes=_writes,
        folder=lambda a: a.output,
    )
    option = command.add_argument_group("what the shapes keep to").add_argument
    option("--enclose", action="store_true", help="they contain the visual meshes, tried on fresh points")
    option("--inside", action="store_true", help="they lie inside of the collision meshes")
    option(
        "--tolerance",
        metavar="T",
        type=length,
        help="how far their surface may lie from the mesh's: 5mm, 0.005 (metres), or 2%% of the link's "
        "longest side (default: 2%%, and no less than 0.3%% of the robot's)",
    )
    option(
        "--max-parts", metavar="N", type=int, default=48, help="shapes a link at most (default: %(default)s)"
    )
    option(
        "--extra",
        metavar="SHARE",
        type=share,
        help="volume that a link's shapes may add before it is cut further, as far as --max-parts allows "
        "(default: 8%%, and less where a few shapes more save much)",
    )
    option(
        "--kinds",
        metavar="A,B",
        default="",
        help="which may be used: box, cylinder, sphere, capsule, ellipsoid, hull (default: all it has)",
    )
    option(
        "--packages",
        metavar="DIR",
        type=Path,
        action="append",
        default=[],
        help="a folder in which packages of package:// and model:// addresses lie; may be given again",
    )
    option(
        "--spheres",
        metavar="N",
        type=int,
        help="also N spheres at most for each link that collides, for planners: ROBOT.spheres.yml (cuRobo's) "
        "and ROBOT.spheres.json; in its material, or around or inside it as the shapes are",
    )
    option(
        "--workers",
        metavar="N",
        type=int,
        help="processes that shape the links of a robot that takes long (default: one a processor)",
    )
    command.set_defaults(run="collide")


def _reads(arguments: argparse.Namespace) -> list[Path]:
    return _meshes(arguments.robot) or [arguments.robot]


def _meshes(robot: Path) -> list[Path]:
    """The meshes of a folder; none where it is a file."""
    return [file for file in robot.iterdir() if file.is_file()] if robot.is_dir() else []


def _writes(arguments: argparse.Namespace) -> list[Path]:
    name = arguments.robot.resolve().name if arguments.robot.is_dir() else arguments.robot.name
    more = (f"{name}.spheres.yml", f"{name}.spheres.json") if arguments.spheres is not None else ()
    own = [file.name for file in _meshes(arguments.robot)] or [name]
    return [arguments.output / each for each in (*own, f"{name}.report.json", f"{name}.png", *more)]
