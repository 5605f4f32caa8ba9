"""Boolean operations of OpenCASCADE, tried in one way after another until the volume is right.

Where surfaces nearly touch, OpenCASCADE may lose a solid, or a cut, and say nothing: what it returns is
checked for being valid, and its volume is compared with what is known of it. All solids at once go wrong less
often than one after another, and a tolerance as wide as the faces' distance makes nearly touching faces one.
All tries beyond the first of an operation are paid from one budget for the whole export, in faces, which
cost about as much time each, so that the same assembly gives the same bytes on a slow machine.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError
from partwright.export.brep_errors import opencascade_errors
from partwright.export.brep_topology import faces_of, volume_of

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_LOST = 1e-4  # of the larger volume: what an operation may lose by rounding
_FUZZY = (0.0, 1e-4, 1e-3, 3e-3)  # tolerances of operations, of the cube root of the largest volume
_RIGHT = 1e-3  # share of the volume: as close as meshes are that it is compared with
_ACCEPTED = 5e-3  # the closest of all results may be this far off
_MOVES = (2e-4, 1e-3)  # of the cube root of the largest volume: what operands move by at last
_DIRECTIONS = 2
_BUDGET = 60_000


@dataclass
class Repairs:
    """What may still be spent on further tries, in faces of their operands; about a thousand to a second."""

    left: int = _BUDGET

    def allow(self, solids: Sequence[TopoDS_Shape]) -> bool:
        """Whether there is a try more, which then is paid."""
        self.left -= sum(1 for solid in solids for _ in faces_of(solid))
        return self.left > 0

    @property
    def spent(self) -> bool:
        """Whether tries were left out."""
        return self.left <= 0


def operated(
    operation: str,
    solids: Sequence[TopoDS_Shape],
    right: float | None,
    label: str,
    repairs: Repairs,
    rough: bool = False,
) -> TopoDS_Shape:
    """The union, difference or intersection of the solids.

    right: its volume, where it is known. repairs: what pays for all tries but the first. rough: with wider
    tolerances from the first on, where the least ones left slivers.

    Raises:
        NoSurfaceError: no way gives a valid solid of that volume.
    """
    if len(solids) == 1:
        return solids[0]
    found = _closest(_results(operation, solids, _FUZZY[rough:], repairs), right)
    if found is None:
        raise NoSurfaceError(f"OpenCASCADE gets the {operation} of {label} wrong; move it a little")
    return found


def operated_on_moved(
    operation: str,
    solids: Sequence[TopoDS_Shape],
    right: float,
    label: str,
    repairs: Repairs,
    rough: bool = False,
) -> tuple[TopoDS_Shape, float]:
    """As `operated`, with all but the first moved a little, and how far: a length. rough: further at once.

    Raises:
        NoSurfaceError: no way gives a valid solid of that volume.
    """
    scale = max(volume_of(solid) for solid in solids) ** (1 / 3)
    for distance in (share * scale for share in _MOVES[rough:]):
        found = _closest(_moved_results(operation, solids, distance, repairs), right)
        if found is not None:
            return found, distance
    raise NoSurfaceError(f"OpenCASCADE gets the {operation} of {label} wrong; move it a little")


def _closest(results: Iterator[TopoDS_Shape], right: float | None) -> TopoDS_Shape | None:
    """The first of about the right volume, or the nearest to it of all that will do."""
    closest, error = None, _ACCEPTED
    for result in results:
        if right is None:
            return result
        off = abs(volume_of(result) / right - 1)
        if off < error:
            closest, error = result, off
        if off < _RIGHT:
            break
    return closest


def _moved_results(
    operation: str, solids: Sequence[TopoDS_Shape], distance: float, repairs: Repairs
) -> Iterator[TopoDS_Shape]:
    """With all but the first moved so far, each in another direction: faces that nearly touched do not."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    for seed in range(_DIRECTIONS):
        if not repairs.allow(solids):
            return
        ways = np.random.default_rng(seed).normal(size=(len(solids), 3))
        ways *= distance / np.linalg.norm(ways, axis=1)[:, None]
        moved = [solids[0]]
        for solid, way in zip(solids[1:], ways.tolist(), strict=False):
            shift = gp_Trsf()
            shift.SetTranslation(gp_Vec(*way))
            moved.append(solid.Moved(TopLoc_Location(shift)))
        result = _one_by_one(operation, moved, 0.0)
        if result is not None:
            yield result


def _results(
    operation: str, solids: Sequence[TopoDS_Shape], tolerances: Sequence[float], repairs: Repairs
) -> Iterator[TopoDS_Shape]:
    """Valid results of volumes that they can have."""
    volumes = [volume_of(solid) for solid in solids]
    low, high = {
        "union": (max(volumes), sum(volumes)),
        "difference": (volumes[0] - sum(volumes[1:]), volumes[0]),
        "intersection": (0.0, min(volumes)),
    }[operation]
    slack = _LOST * max(volumes)
    # OpenCASCADE's intersection is that with the union of the others.
    way = _one_by_one if operation == "intersection" else _at_once
    for i, tolerance in enumerate(tolerances):
        if i and not repairs.allow(solids):
            return
        result = way(operation, solids, tolerance * max(volumes) ** (1 / 3))
        if result is not None and low - slack <= volume_of(result) <= high + slack:
            yield result


def _one_by_one(operation: str, solids: Sequence[TopoDS_Shape], fuzzy: float) -> TopoDS_Shape | None:
    result: TopoDS_Shape | None = solids[0]
    for solid in solids[1:]:
        result = _at_once(operation, (result, solid), fuzzy)
        if result is None:
            break
    return result


def _at_once(operation: str, solids: Sequence[TopoDS_Shape], fuzzy: float) -> TopoDS_Shape | None:
    """The first solid and all others; None where the result is not valid.

    fuzzy: length within which faces, edges and corners are one.
    """
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.collections import List_TopoDS_Shape as Shapes

    work = {"union": BRepAlgoAPI_Fuse, "difference": BRepAlgoAPI_Cut, "intersection": BRepAlgoAPI_Common}[
        operation
    ]()
    arguments, tools = Shapes(), Shapes()
    arguments.Append(solids[0])
    for solid in solids[1:]:
        tools.Append(solid)
    work.SetArguments(arguments)
    work.SetTools(tools)
    work.SetFuzzyValue(fuzzy)
    work.SetNonDestructive(True)  # a failed attempt leaves the solids as they are
    try:
        work.Build()
        result = work.Shape() if work.IsDone() else None
    except opencascade_errors():
        return None
    return result if result is not None and BRepCheck_Analyzer(result).IsValid() else None
