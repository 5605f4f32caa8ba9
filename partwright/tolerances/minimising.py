"""The fewest parts that keep the bounds: the cheapest go, as long as the others can make up for them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from partwright.assembly import Assembly
from partwright.errors import ParameterError
from partwright.methods import Cancellation
from partwright.metrics.frames import in_unit_frame
from partwright.metrics.iou import occupancy_iou
from partwright.shapes import Shape
from partwright.tolerances.distance_bounds import DistanceBounds
from partwright.tolerances.satisfying import Bounded, satisfy

_SAMPLES = 6_000
_AT_ONCE = 0.25  # of the parts are tried to be removed in the first step
_TRIALS = 2  # single parts whose removal is tried before it ends


def minimise_parts(
    kept: Bounded,
    shape: Shape,
    bounds: DistanceBounds,
    locked: Sequence[str] = (),
    seed: int = 0,
    cancel: Cancellation | None = None,
) -> Bounded:
    """An assembly that keeps the bounds with as few parts as removals find; `kept` keeps them to begin with.

    A quarter of the parts is tried first, those that the IoU misses least; what fails is tried with half as
    many. `cancel` ends it with the fewest so far.
    """
    at_once = max(1, round(_AT_ONCE * len(kept.assembly)))
    failed = 0
    while failed < _TRIALS and len(kept.assembly) > 1:
        names = _cheapest(kept.assembly, shape, locked, at_once, failed if at_once == 1 else 0, seed)
        thinned = _without(kept.assembly, names)
        if thinned is None:
            return kept
        tried = satisfy(thinned, shape, bounds, locked, seed, cancel)
        if not tried.complete:
            return replace(kept, complete=False)
        if tried.satisfied:
            kept, failed = tried, 0
            at_once = min(at_once, max(1, round(_AT_ONCE * len(kept.assembly))))
        elif at_once > 1:
            at_once //= 2
        else:
            failed += 1
    return kept


def _cheapest(
    assembly: Assembly, shape: Shape, locked: Sequence[str], count: int, skipped: int, seed: int
) -> list[str]:
    """Names of the parts that go one after another, each the one that the IoU misses least then."""
    samples = shape.samples(_SAMPLES, _SAMPLES, seed + 300)
    inside = samples.distance < 0
    local = in_unit_frame(assembly, shape.frame)
    names: list[str] = []
    for _ in range(count):
        scores = {}
        for part in local.parts:
            rest = None if part.name in locked else _without(local, [part.name])
            if rest is not None:
                occupied = rest.distance(samples.points) < 0
                scores[part.name] = occupancy_iou(occupied, inside)
        ranked = sorted(scores, key=lambda name: -scores[name])
        if len(ranked) <= skipped:
            break
        names.append(ranked[skipped])
        rest = _without(local, names[-1:])
        assert rest is not None
        local = rest
    return names


def _without(assembly: Assembly, names: list[str]) -> Assembly | None:
    """The assembly without these parts; None where there are none, or where nothing would be left."""
    if not names:
        return None
    try:
        for name in names:
            assembly = assembly.without(name)
    except ParameterError:
        return None
    return assembly
