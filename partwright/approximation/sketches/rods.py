"""Rods and pipes in a body that is seen along them: from where to where they go on, through others that they
meet, to where they bend."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from partwright.approximation.sketches.sections import Region, View

ELSEWHERE = (0.1, 0.9)
"""Of a slab, where it is looked at beside its middle."""
MOST_REGIONS = 4
"""Of a section, that are looked at."""
SAME_AREA = 0.01
"""Of a section's area, that one as large may differ by."""
_INSIDE = 0.02  # of a section: what of it may lie outside of the next slab's, and it still goes on
_LEAVES = 0.005  # of a rod's section, that lies outside where it ends in a bend
_HALVINGS = 7  # of a slab, for the height at which it does
_AT_LEVEL = 0.02  # unit lengths: where it does so near to a level it ends there, or where most walls end
_WALLS = 0.03  # of the width of all walls, that end there at least
_SLENDER = 2.0  # times as long as it is wide


def rod(
    view: View, region: Region, slabs: Sequence[tuple[float, float]], i: int, heights: tuple[float, float]
) -> tuple[float, float] | None:
    """From where to where a region of two heights within a slab goes on by itself, below the first and above
    the second: a rod ends where it bends, not at a face. None of what is nowhere straight."""
    middles = [(low + high) / 2 for low, high in slabs]
    levels = [z for slab in slabs for z in slab]
    below = [z for z in middles[: i + 1][::-1] if z < heights[0]]
    above = [z for z in middles[i:] if z > heights[1]]
    low = _end(view, region, heights[0], below, levels[0], levels)
    high = _end(view, region, heights[1], above, levels[-1], levels)
    straight = _is_straight(view, region, max(low, slabs[i][0]), min(high, slabs[i][1]))
    return (low, high) if straight else None


def _end(
    view: View, region: Region, inside: float, beyond: Sequence[float], last: float, levels: Sequence[float]
) -> float:
    """To where a region goes on that is there at a height; beyond: heights further on, in order."""
    for outside in (*beyond, last + 0.02 * (inside - last)):
        if not goes_on(region, view.regions(outside), _LEAVES):
            break
        inside = outside
    else:
        return last
    for _ in range(_HALVINGS):
        between = (inside + outside) / 2
        if goes_on(region, view.regions(between), _LEAVES):
            inside = between
        else:
            outside = between
    level = min(levels, key=lambda z: abs(z - inside))
    if abs(level - inside) < _AT_LEVEL:
        return level
    ends = [(share, z) for share, z in view.wall_ends if share > _WALLS and abs(z - inside) < _AT_LEVEL]
    return max(ends, default=(0.0, inside))[1]


def round_at_ends(view: View, low: float, high: float) -> Iterator[tuple[Region, tuple[float, float]]]:
    """Round regions near the ends of a slab that its middle has but as part of others: of pipes that meet
    there. And the first and the last height at which each is seen."""
    first, last = (low + share * (high - low) for share in ELSEWHERE)
    middle = view.regions((low + high) / 2)[:MOST_REGIONS]
    below, above = (
        [
            region
            for region in view.regions(height)[:MOST_REGIONS]
            if not any(_is_as_large(region, other) for other in middle) and region.is_round
        ]
        for height in (first, last)
    )
    for region in below:
        again = next((one for one in above if _is_as_large(region, one) and goes_on(region, [one])), None)
        above = [one for one in above if one is not again]
        yield region, (first, first if again is None else last)
    yield from ((region, (last, last)) for region in above)


def _is_as_large(one: Region, other: Region) -> bool:
    return abs(one.area - other.area) < SAME_AREA * other.area


def _is_straight(view: View, region: Region, low: float, high: float) -> bool:
    """Whether a round region is nowhere part of a wider round one, as in a cone."""
    heights = (low + share * (high - low) for share in ELSEWHERE)
    return not any(
        other.is_round and other.area > (1 + SAME_AREA) * region.area and goes_on(region, [other], _LEAVES)
        for height in heights
        for other in view.regions(height)[:MOST_REGIONS]
    )


def is_rod(region: Region, low: float, high: float) -> bool:
    """Whether it is much longer than wide."""
    left, bottom, right, top = region.section.bounds()
    return bool(high - low > _SLENDER * max(right - left, top - bottom))


def span(i: int, heights: Sequence[float], holds: Callable[[float], bool]) -> tuple[int, int]:
    """The first and the last of heights around one of them, up to which something holds."""
    first = last = i
    while first > 0 and holds(heights[first - 1]):
        first -= 1
    while last + 1 < len(heights) and holds(heights[last + 1]):
        last += 1
    return first, last


def goes_on(region: Region, others: Sequence[Region], least: float = _INSIDE) -> bool:
    """Whether a region lies within other sections, but for a share."""
    left = region.section
    for other in others:
        left = left - other.section
        if left.is_empty():
            return True
    return bool(left.area() < least * region.area)
