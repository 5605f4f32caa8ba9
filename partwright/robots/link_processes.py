"""The shapes of one link after another, by several processes where that takes long."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from functools import partial

from partwright.approximation.convex_piece import Piece
from partwright.errors import RobotError
from partwright.processes import carried_out
from partwright.robots.model import Link, MeshUse, Shape
from partwright.robots.shaping import FLAWS, Wishes, shapes_for
from partwright.robots.solids import Solids

_WORTH = 4000  # triangles of all that is not convex: they take longer than processes need to begin
_COUNTED = 2000  # of one order: what has more is made simpler before it is cut


@dataclass(frozen=True, eq=False)
class Order:
    """Shapes that are wanted for meshes of a link; sheets: of `Solids.target`."""

    link: Link
    uses: Sequence[MeshUse]
    sheets: bool
    wishes: Wishes


def shapes_of_all(
    solids: Solids, orders: Sequence[Order], workers: int
) -> Generator[list[Shape], None, None]:
    """The shapes of each order, as they stand; the same by however many processes.

    Raises:
        RobotError: a mesh has none. SettingError: of `carried_out`.
    """
    if workers > 1:
        targets = [solids.target(order.link, order.uses, order.sheets).solid for order in orders]
        work = sum(min(one.num_tri(), _COUNTED) for one in targets if Piece(one).extra > FLAWS * one.volume())
        workers = workers if work > _WORTH else 1
    return carried_out(partial(_made, solids), orders, workers)


def _made(solids: Solids, order: Order) -> list[Shape]:
    shapes = shapes_for(order.link.name, solids.target(order.link, order.uses, order.sheets), order.wishes)
    if not shapes:
        raise RobotError(f"link {order.link.name!r}: no shape lies inside of its mesh; it is too thin")
    return shapes
