"""From a fit to an assembly that keeps its bounds: more parts where they are needed, fewer where not."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from partwright.assembly import Assembly
from partwright.errors import BoundsError
from partwright.methods import Cancellation
from partwright.metrics.deviation import place_in
from partwright.shapes import Shape
from partwright.tolerances.distance_bounds import DistanceBounds, Length, format_length
from partwright.tolerances.minimising import minimise_parts
from partwright.tolerances.satisfying import Bounded, measured, satisfy

# A tolerance that the fit does not reach is tried again with parts that cost this share of their price.
CHEAPER = (1 / 3, 1 / 10)


def check_alone(tolerance: Length | None, *, min_iou: float | None, curve: bool, per_node: bool) -> None:
    """Bounds are one assembly's, and a tolerance alone decides how many parts it has.

    Raises:
        BoundsError: something else is asked for that contradicts that.
    """
    if curve:
        raise BoundsError("bounds are kept by one assembly, and a curve has many: ask for one of the two")
    if tolerance is not None and (min_iou is not None or per_node):
        other = "min_iou" if min_iou is not None else "per_node"
        raise BoundsError(f"tolerance and {other} both decide how many parts there are: give one of the two")


def enforce(
    assembly: Assembly,
    shape: Shape,
    bounds: DistanceBounds,
    outcome: str,
    refit: Callable[[float], Assembly | None],
    locked: Sequence[str] = (),
    seed: int = 0,
    cancel: Cancellation | None = None,
) -> tuple[Bounded, str]:
    """An assembly that keeps the bounds, or comes nearest to it, and how the fit ended with that in mind.

    outcome: of the fit; one that was interrupted is measured only. refit: makes an assembly of more parts, at
    a share of their price (None where there may be no more). Parts in `locked` stay. `cancel` ends it with
    the best so far.
    """
    if outcome == "interrupted":
        return measured(assembly, shape, bounds, seed, complete=False), outcome
    bounded = satisfy(assembly, shape, bounds, locked, seed, cancel)
    if bounds.tolerance is not None:
        bounded = _by_parts(bounded, shape, bounds, refit, locked, seed, cancel)
    if not bounded.complete:
        return bounded, "interrupted"
    if not bounded.satisfied:
        return bounded, "budget_reached"
    return bounded, "target_reached" if bounds.tolerance is not None else outcome


def _by_parts(
    best: Bounded,
    shape: Shape,
    bounds: DistanceBounds,
    refit: Callable[[float], Assembly | None],
    locked: Sequence[str],
    seed: int,
    cancel: Cancellation | None,
) -> Bounded:
    """More parts until a tolerance is kept, and then the fewest that keep it."""
    for share in CHEAPER:
        if best.satisfied or not best.complete:
            break
        more = refit(share)
        if more is None:
            break
        tried = satisfy(more, shape, bounds, locked, seed, cancel)
        best = replace(tried if tried.improves_on(best) else best, complete=tried.complete)
    if not (best.satisfied and best.complete):
        return best
    return minimise_parts(best, shape, bounds, locked, seed, cancel)


def bounds_report(bounded: Bounded, shape: Shape, volume: float) -> dict[str, Any]:
    """For report.json: each bound with what was asked and reached, in the shape's own units; volume: of the
    assembly's surface."""
    checked = bounded.checked
    entries: dict[str, Any] = {}
    for name, side in checked.found.items():
        entries[name] = {
            "asked": float(shape.frame.length_from_unit(getattr(checked.bounds, name))),
            "reached": max(0.0, float(shape.frame.length_from_unit(side.worst))),
            "kept": name not in checked.excess,
            "place": place_in(shape, side.point),
        }
    return {**entries, "volume_ratio": volume / shape.volume}


_MISSED = {
    "tolerance": "the surfaces are up to {reached} apart",
    "contain": "the shape sticks out of the parts by up to {reached}",
    "inside": "the parts stick out of the shape by up to {reached}",
}


def bounds_warnings(bounded: Bounded, shape: Shape) -> list[str]:
    """A sentence for each bound that is missed."""
    checked = bounded.checked
    result = []
    for name in checked.excess:
        side = checked.found[name]
        missed = _MISSED[name].format(reached=format_length(side.worst, shape))
        asked = format_length(getattr(checked.bounds, name), shape)
        place = place_in(shape, side.point)
        parts = len(bounded.assembly)
        result.append(
            f"{name} {asked} is not kept: {missed}, at the {place}, with {parts} part{'s' * (parts > 1)}"
        )
    return result
