"""What the command line may say of a shape that its file does not."""

from __future__ import annotations

from partwright.cli.lengths import length
from partwright.cli.outputs import Group


def add_reading(group: Group, unit: str = "length unit of the shape") -> None:
    """--unit, --up and --thickness."""
    group.add_argument("--unit", metavar="U", help=f"{unit}: um, mm, cm, m, km, in, ft")
    group.add_argument("--up", metavar="AXIS", help="axis that points up: x, y, z, -x, -y, -z")
    add_thickness(group)


def add_thickness(group: Group) -> None:
    group.add_argument(
        "--thickness",
        metavar="T",
        type=length,
        help="make walls this thick of surfaces that are open, in the place of filling them: 0.5 in the "
        "shape's unit, 0.5mm, or 1%% of its longest side",
    )
