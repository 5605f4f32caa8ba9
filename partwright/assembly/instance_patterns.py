"""How the copies of a repeated part follow from the first, as a person would put it: so many around an axis,
on a circle, in rows along the axes, in a row that goes another way, at these places, or each placed and
turned for itself."""

from __future__ import annotations

import dataclasses
import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.checks import Vector
from partwright.assembly.repeated_groups import ring
from partwright.assembly.similarity import Similarity, rotation_matrix
from partwright.assembly.turned_fields import is_round, is_same_turned

if TYPE_CHECKING:
    from partwright.assembly.tree import Part

_SAME = 1e-9  # of the lengths that occur, and of entries of rotations
_TURNED = 5e-5  # radians, by which copies may be turned where places may be off, too
_DIGITS = 10  # of numbers that are told apart by how plain they are


@dataclass(frozen=True)
class Ring:
    """`count` copies by equal turns about the axis "x", "y" or "z" through a centre, the part first."""

    count: int
    axis: str
    centre: Vector


@dataclass(frozen=True)
class Circle:
    """`count` copies of what is round about its own z, at equal angles on a circle across it.

    diameter: of the circle through their origins. start: where on it the part itself is, in degrees from
    the part's own x towards its y. centre: of the circle, in the assembly.
    """

    count: int
    diameter: float
    start: float
    centre: Vector

    def places(self, part: Part) -> np.ndarray:
        """(count, 3) of the origins, the part's own first."""
        angles = np.radians(self.start) + 2 * np.pi * np.arange(self.count) / self.count
        flat = np.stack([np.cos(angles), np.sin(angles), np.zeros(self.count)], axis=1)
        across: np.ndarray = flat * (self.diameter / 2) @ rotation_matrix(part.rotation).T
        return across + self.centre


@dataclass(frozen=True)
class Grid:
    """Copies turned alike in rows along the axes of coordinates: count (3,) along each, 1 where there is no
    row, the spacing (3,) from one to the next, 0 there, about a middle."""

    count: tuple[int, int, int]
    spacing: Vector
    middle: Vector

    def places(self, part: Part) -> np.ndarray:
        """(N, 3) of the origins, from the corner that the part itself is at."""
        own = np.subtract(part.translation, self.middle)
        rows = [
            (np.arange(n) - (n - 1) / 2) * step * (-1 if at > 0 else 1)
            for n, step, at in zip(self.count, self.spacing, own, strict=True)
        ]
        return np.array(list(itertools.product(*rows))) + self.middle


@dataclass(frozen=True)
class Line:
    """`count` copies turned alike in a row that goes anywhere: from the first, at `place`, on by equal steps
    (3,)."""

    count: int
    step: Vector
    place: Vector

    def places(self, part: Part) -> np.ndarray:
        """(count, 3) of the origins, the part's own first."""
        return np.arange(self.count)[:, None] * np.array(self.step) + self.place


@dataclass(frozen=True)
class Row:
    """Copies turned alike at these places, the part's own first."""

    places: tuple[Vector, ...]


@dataclass(frozen=True)
class Poses:
    """Copies of which each is its own: parts without instances, the part itself first."""

    copies: tuple[Part, ...]


Pattern = Ring | Circle | Grid | Line | Row | Poses


def pattern(part: Part, within: float = 0.0) -> Pattern | None:
    """The plainest words for a part's copies; None for a part that is not repeated.

    within: how far places may be from those that a circle or a grid says, but for rounding.
    """
    if not part.instances:
        return None
    places = _places(part, _TURNED if within else _SAME)
    if places is None:
        return _ring(part) or Poses(tuple(part.copies))
    least = max(within, _SAME * max(1.0, float(np.abs(places).max())))
    grid, circle = _grid(places, least), _circle(part, places, least)
    if circle and grid:
        return circle if _plainer(circle, grid, within) else grid
    return circle or grid or _line(places, least) or Row(tuple((x, y, z) for x, y, z in places.tolist()))


def with_pattern(part: Part, wanted: Ring | Circle | Grid | Line | Row) -> Part:
    """The part with its copies as a pattern has them, itself at the first place."""
    if isinstance(wanted, Ring):
        return dataclasses.replace(part, instances=ring(wanted.count, wanted.axis, wanted.centre))
    places = np.array(wanted.places) if isinstance(wanted, Row) else wanted.places(part)
    x, y, z = places[0].tolist()
    moves = (Similarity(translation=tuple(shift)) for shift in (places[1:] - places[0]).tolist())
    return dataclasses.replace(part, translation=(x, y, z), instances=tuple(moves))


def _places(part: Part, within: float) -> np.ndarray | None:
    """(N, 3) of the origins of copies of which none seems turned; None where one does."""
    back = rotation_matrix(part.rotation).T
    copies = part.copies
    turns = (back @ rotation_matrix(copy.rotation) for copy in copies[1:])
    if not all(is_same_turned(part.field, turn, within) for turn in turns):
        return None
    return np.array([copy.translation for copy in copies])


def _grid(places: np.ndarray, within: float) -> Grid | None:
    """All places of rows along the axes, in any order."""
    counts, spacings, middles, steps = [], [], [], []
    for values in places.T:
        low, high = float(values.min()), float(values.max())
        levels = np.sort(values)
        count = 1 + int((np.diff(levels) > 4 * within).sum())
        if count > 1:
            gap = (high - low) / (count - 1) / 2
            low, high = (float(values[np.abs(values - end) < gap].mean()) for end in (low, high))
        spacing = (high - low) / (count - 1) if count > 1 else 0.0
        step = np.rint((values - low) / spacing) if count > 1 else np.zeros(len(values))
        if np.abs(low + step * spacing - values).max() > 2 * within:
            return None
        counts.append(count)
        spacings.append(spacing)
        middles.append((low + high) / 2)
        steps.append(step)
    if math.prod(counts) != len(places) or len(np.unique(np.stack(steps), axis=1).T) != len(places):
        return None
    a, b, c = counts
    return Grid((a, b, c), _vector(spacings), _vector(middles))


def _line(places: np.ndarray, within: float) -> Line | None:
    """Three places at least, in any order, from the end that the first is nearer to."""
    count = len(places)
    if count < 3:
        return None
    ways = places - places[0]
    along = ways @ ways[np.linalg.norm(ways, axis=1).argmax()]
    if along.max() < -along.min():
        along = -along
    index = np.arange(count) - (count - 1) / 2
    middle, ordered = places.mean(axis=0), places[np.argsort(along)]
    step = index @ (ordered - middle) / float(index @ index)
    off = np.abs(middle + index[:, None] * step - ordered).max()
    return Line(count, _vector(step), _vector(middle + index[0] * step)) if off <= 2 * within else None


def _circle(part: Part, places: np.ndarray, within: float) -> Circle | None:
    """Three places at least, at equal angles about their centre, in any order."""
    count = len(places)
    if count < 3 or not is_round(part.field):
        return None
    centre = places.mean(axis=0)
    x, y, _ = rotation_matrix(part.rotation).T @ (places - centre).T
    radius = float(np.hypot(x, y).mean())
    angles = np.arctan2(y, x)
    steps = (angles - angles[0]) / (2 * np.pi) * count
    nearest = np.rint(steps)
    # The mean of all, and not the first alone, says where they begin.
    start = float(np.degrees(angles[0] + ((steps - nearest) / count * 2 * np.pi).mean()))
    found = Circle(count, float(f"{2 * radius:.12g}"), round(start, 9) + 0.0, _vector(centre))
    order = nearest.astype(int) % count
    if sorted(order.tolist()) != list(range(count)):
        return None
    return found if np.abs(found.places(part)[order] - places).max() <= 2 * within else None


def _plainer(circle: Circle, grid: Grid, within: float) -> bool:
    """Whether the circle's number is the one that was typed."""
    return _digits(circle.diameter, within) < max(_digits(step, within) for step in grid.spacing if step)


def _digits(value: float, within: float) -> int:
    """Of the shortest number so near."""
    return next(
        (n for n in range(1, _DIGITS) if abs(float(f"{value:.{n}g}") - value) <= within + _SAME * abs(value)),
        _DIGITS,
    )


def _vector(values: np.ndarray | list[float], dust: float = _SAME) -> Vector:
    """Without the dust of rounding, about zero and in the last digits."""
    x, y, z = (0.0 if abs(v) <= dust else float(f"{v:.12g}") for v in values)
    return (x, y, z)


def _ring(part: Part) -> Ring | None:
    count = len(part.instances) + 1
    turns = [rotation_matrix(move.rotation) for move in part.instances]
    shifts = np.array([move.translation for move in part.instances])
    size = max(1.0, float(np.abs([copy.translation for copy in part.copies]).max()))
    for axis in range(3):
        if any(abs(turn[axis, axis] - 1) > _SAME for turn in turns):
            continue
        a, b = (axis + 1) % 3, (axis + 2) % 3
        steps = [np.arctan2(turn[b, a], turn[a, a]) / (2 * np.pi) * count % count for turn in turns]
        if not np.allclose(np.sort(steps), np.arange(1, count), rtol=0, atol=1e-6):
            return None
        # A turn R about the centre c shifts by c - R c.
        systems = [np.eye(3)[[a, b]][:, [a, b]] - turn[np.ix_([a, b], [a, b])] for turn in turns]
        centre = np.zeros(3)
        centre[[a, b]] = np.linalg.solve(systems[0], shifts[0, [a, b]])
        moved = np.array([centre - turn @ centre for turn in turns])
        if np.abs(moved - shifts).max() > 1e-6 * size:
            return None
        return Ring(count, "xyz"[axis], _vector(centre, _SAME * size))
    return None
