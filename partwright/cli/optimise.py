"""`partwright optimise`: an assembly's parts improved for a goal, while those that are frozen stay."""

from __future__ import annotations

import argparse

from partwright.cli.assembly_argument import add_assembly
from partwright.cli.outputs import add_output

# What `partwright.goals` writes; a test holds the two together, as that room takes long to import.
FILES = ("assembly.json", "surface.ply", "report.json", "before_after.png", "trajectory.gif", "curves.png")

_EPILOG = """\
OBJECTIVE is NAME[@ARGUMENT][=TARGET][:WEIGHT]. Without a target the number is made less (more, with a
negative weight); each is divided by what it is at the start. Given several times, the weighted sum counts.

  volume, mass@DENSITY, centre@AXIS, inertia@AXIS         of the solid
  frontal_area@AXIS, silhouette@AXIS                      as seen along an axis; as different from the start
  keep_out@x0,y0,z0,x1,y1,z1                              volume within boxes
  wall_thickness                                          of the thinnest twentieth of the surface
  distance@FILE                                           to the surface of a file
  drag, drag@FILE, drag@AXIS                              the next two by one name; alone, along the length
  surrogate_drag@FILE                                     by a network (parts train-surrogate)
  newtonian_drag@AXIS                                     of flow along an axis: no CFD, see docs/optimise.md
  FILE.py:FUNCTION                                        your own

BOUND is NAME<=VALUE, NAME>=VALUE, or PART.PARAMETER<=VALUE; VALUE may be a share of that at the start: 90%.

  partwright optimise mug.json -o lighter --objective volume --bound 'wall_thickness>=95%' --freeze 'handle*'
"""


def add(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    command = commands.add_parser(
        "optimise",
        help="improve some parts for a goal while others stay as they are",
        description="Changes places, sizes, proportions, blends and latents of parts so that objectives of "
        "the whole surface get better. Writes into FOLDER the assembly, its surface, a report, pictures of "
        "before and after, of the way between them, and curves.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_assembly(command)
    add_output(
        command,
        "FOLDER",
        "where to write",
        reads=lambda a: [a.assembly],
        writes=lambda a: [a.output / name for name in FILES],
        folder=lambda a: a.output,
    )
    option = command.add_argument
    option(
        "--objective",
        metavar="OBJECTIVE",
        action="append",
        required=True,
        help="what is to get better; may be given again",
    )
    option(
        "--bound", metavar="BOUND", action="append", default=[], help="what is to be kept; may be given again"
    )
    option(
        "--freeze",
        metavar="PART[:GROUP]",
        action="append",
        default=[],
        help="parts that stay, as a pattern ('wheel_*'), or of them only pose, position, rotation, form, "
        "blend, latent or one parameter; may be given again",
    )
    option("--steps", metavar="N", type=int, default=60, help="surfaces tried at most (default: %(default)s)")
    option(
        "--resolution",
        metavar="N",
        type=int,
        default=64,
        help="cells along the longest side (default: %(default)s)",
    )
    option(
        "--simulate",
        metavar="AIR",
        help="at the end, the drag before and after by OpenFOAM (minutes), the air moving along x, -y ...: "
        "AXIS[,ground][,cells=N][,iterations=N][,speed=V][,seconds=S][,turning=PARTS]; PARTS is a pattern of "
        "wheels that roll on the ground",
    )
    limits = command.add_argument_group("how far parts may go").add_argument
    limits(
        "--reach",
        metavar="X",
        type=float,
        default=0.1,
        help="from their place, as a share of the longest side (default: %(default)s)",
    )
    limits(
        "--change",
        metavar="X",
        type=float,
        default=0.5,
        help="in size, as a share of themselves (default: %(default)s)",
    )
    limits(
        "--anchor",
        metavar="W",
        type=float,
        default=0.1,
        help="weight of the squared distance from the start (default: %(default)s)",
    )
    limits(
        "--still",
        metavar="X",
        type=float,
        default=1e-3,
        help="by the surface of learned parts that are frozen, which follows the others', as a share of the "
        "longest side; 0 sets no limit (default: %(default)s)",
    )
    limits(
        "--symmetric",
        metavar="AXIS",
        default="",
        help="change both sides alike: x, y or z, across the plane through the middle (default: none)",
    )
    limits(
        "--neighbours",
        metavar="W",
        type=float,
        default=0.1,
        help="weight of the distance of latents from those of the training (default: %(default)s)",
    )
    limits("--no-contacts", action="store_true", help="parts that touch need not go on to")
    command.set_defaults(run="optimise")
