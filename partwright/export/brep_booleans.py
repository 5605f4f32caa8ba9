"""Boolean operations of OpenCASCADE, tried in one way after another until the volume is right.

Where surfaces nearly touch, OpenCASCADE may lose a solid, or a cut, and say nothing: what it returns is
checked for being valid, and its volume is compared with what is known of it. All solids at once go wrong less
often than one after another, and a tolerance as wide as the faces' distance makes nearly touching faces one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError
from partwright.export.brep import volume_and_area
from partwright.export.brep_errors import opencascade_errors

if TYPE_CHECKING:
    from OCP.TopoDS import TopoDS_Shape

_LOST = 1e-4  # of the larger volume: what an operation may lose by rounding
_FUZZY = (0.0, 1e-4, 1e-3, 3e-3)  # tolerances of operations, of the cube root of the largest volume
_RIGHT = 1e-3  # share of the volume: as close as meshes are that it is compared with
_ACCEPTED = 5e-3  # the closest of all results may be this far off
_MOVES = (2e-4, 1e-3)  # of the cube root of the largest volume: what operands move by at last
_DIRECTIONS = 2


def operated(
    operation: str,
    solids: Sequence[TopoDS_Shape],
    right: float | None,
    label: str,
    move: bool = False,
    rough: bool = False,
) -> tuple[TopoDS_Shape, float]:
    """The union, difference or intersection of the solids, and how far some of them were moved for it: as a
    length, 0 but where nothing else goes.

    right: its volume, where it is known. move: whether they may move, where that is known. rough: with wider
    tolerances and further moves from the first on, where the least ones left slivers.

    Raises:
        NoSurfaceError: no way gives a valid solid of that volume.
    """
    if len(solids) == 1:
        return solids[0], 0.0
    found = _closest(_results(operation, solids, _FUZZY[rough:]), right)
    if found is not None:
        return found, 0.0
    scale = max(volume_and_area(solid)[0] for solid in solids) ** (1 / 3)
    for distance in (share * scale for share in _MOVES[rough:]) if move and right is not None else ():
        found = _closest(_moved_results(operation, solids, distance), right)
        if found is not None:
            return found, distance
    raise NoSurfaceError(f"OpenCASCADE gets the {operation} of {label} wrong; move it a little")


def _closest(results: Iterator[TopoDS_Shape], right: float | None) -> TopoDS_Shape | None:
    """The first of about the right volume, or the nearest to it of all that will do."""
    closest, error = None, _ACCEPTED
    for result in results:
        if right is None:
            return result
        off = abs(volume_and_area(result)[0] / right - 1)
        if off < error:
            closest, error = result, off
        if off < _RIGHT:
            break
    return closest


def _moved_results(operation: str, solids: Sequence[TopoDS_Shape], distance: float) -> Iterator[TopoDS_Shape]:
    """With all but the first moved so far, each in another direction: faces that nearly touched do not."""
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location

    for seed in range(_DIRECTIONS):
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
    operation: str, solids: Sequence[TopoDS_Shape], tolerances: Sequence[float]
) -> Iterator[TopoDS_Shape]:
    """Valid results of volumes that they can have."""
    volumes = [volume_and_area(solid)[0] for solid in solids]
    fuzzies = [tolerance * max(volumes) ** (1 / 3) for tolerance in tolerances]
    low, high = {
        "union": (max(volumes), sum(volumes)),
        "difference": (volumes[0] - sum(volumes[1:]), volumes[0]),
        "intersection": (0.0, min(volumes)),
    }[operation]
    slack = _LOST * max(volumes)

    def possible(result: TopoDS_Shape | None) -> bool:
        return result is not None and low - slack <= volume_and_area(result)[0] <= high + slack

    if operation != "intersection":  # OpenCASCADE's is that with the union of the others
        yield from filter(possible, (_at_once(operation, solids, fuzzy) for fuzzy in fuzzies))
        if len(solids) == 2:
            return
    for fuzzy in fuzzies:
        yield from filter(possible, [_one_by_one(operation, solids, fuzzy)])


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
