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
_ORDERS = 4  # of operands, beside the given one and its reverse


def operated(operation: str, solids: Sequence[TopoDS_Shape], right: float | None, label: str) -> TopoDS_Shape:
    """The union, difference or intersection of the solids.

    right: its volume, where it is known.

    Raises:
        NoSurfaceError: no way gives a valid solid of that volume.
    """
    if len(solids) == 1:
        return solids[0]
    closest, error = None, _ACCEPTED
    for result in _results(operation, solids):
        if right is None:
            return result
        off = abs(volume_and_area(result)[0] / right - 1)
        if off < error:
            closest, error = result, off
        if off < _RIGHT:
            break
    if closest is None:
        raise NoSurfaceError(f"OpenCASCADE gets the {operation} of {label} wrong; move it a little")
    return closest


def _results(operation: str, solids: Sequence[TopoDS_Shape]) -> Iterator[TopoDS_Shape]:
    """Valid results of volumes that they can have."""
    volumes = [volume_and_area(solid)[0] for solid in solids]
    fuzzies = [tolerance * max(volumes) ** (1 / 3) for tolerance in _FUZZY]
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
    for order in _orders(operation, len(solids)):
        yield from filter(possible, [_one_by_one(operation, [solids[i] for i in order], 0.0)])


def _orders(operation: str, count: int) -> Iterator[list[int]]:
    """Other orders of the solids; the first of a difference stays."""
    first = int(operation == "difference")
    if count - first < 2:
        return
    yield [*range(first), *range(count - 1, first - 1, -1)]
    for seed in range(_ORDERS):
        yield [*range(first), *(first + np.random.default_rng(seed).permutation(count - first)).tolist()]


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
