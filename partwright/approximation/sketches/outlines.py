"""A closed polygon, as a plane cuts it out of a mesh, as the lines and arcs that it was made of.

An arc of a tessellated part is a chain of chords whose corners lie on one circle. So is a regular polygon;
they are told apart by their turns. Chords that turn by at most 37 degrees from one to the next are an arc,
from three of them on. Steeper ones, up to 50, are one only where the outline enters and leaves them along a
tangent: a chord of an arc starts half a turn off its tangent, so that the turns at both ends are half of
those within, while those of a polygon are all alike. So a closed octagon (45 degrees) stays an octagon, a
full circle has nine chords or more, and a quarter of a circle in two chords between tangent lines is an
arc.
"""

from __future__ import annotations

import math

import numpy as np

from partwright.approximation.sketches.chains import circle_through, open_line
from partwright.fields.profile import Corner, Loop, circle
from partwright.rows import following, lengths

_TURN = math.radians(37)
_STEEP = math.radians(50)
_FEWEST = 3  # chords of an arc that is not entered along a tangent
_CLOSED = 9  # chords of a full circle, at least
_EVEN = 1.4  # times the second longest chord of an arc, that its longest may be
_COLLINEAR = 1e-6  # unit lengths: how far a corner is off by rounding alone
_MANY = 2  # times as many corners as sides, from which on they may be of arcs
_SIDES = 24  # of an outline at most that is drawn again for that


def fitted_loop(points: np.ndarray, tolerance: float) -> Loop | None:
    """Lines and arcs that stay within the tolerance of a closed polygon's corners (K, 2), K >= 3.

    None where nothing is left of it. Corners are corners of the polygon, but for circles.
    """
    points = _distinct(np.asarray(points, dtype=np.float64), tolerance / 4)
    if len(points) < 3:
        return None
    round_ = _whole_circle(points, tolerance)
    if round_ is not None:
        return round_
    # Collinear corners are where the triangles of a wall meet: they would hide that chords are even. So do
    # those that are left of a small arc in many chords where most of them count as collinear.
    plain = _of_lines_and_arcs(points, tolerance / 4, tolerance)
    if plain is not None and len(plain) > min(_SIDES, len(points) / _MANY):
        return plain
    loops = (plain, _of_lines_and_arcs(points, _COLLINEAR, tolerance))
    return min((loop for loop in loops if loop is not None), key=_plainness, default=None)


def _plainness(loop: Loop) -> tuple[int, int]:
    """Sides, and how many of them are arcs: a slot's walls are none, though their first chords may pass."""
    return len(loop), sum(bulge != 0.0 for _, _, bulge in loop)


def is_circle(points: np.ndarray, tolerance: float) -> bool:
    """Whether `fitted_loop` makes a circle of a polygon (K, 2)."""
    points = _distinct(np.asarray(points, dtype=np.float64), tolerance / 4)
    return _whole_circle(points, tolerance) is not None


def _of_lines_and_arcs(points: np.ndarray, collinear: float, tolerance: float) -> Loop | None:
    """collinear: how far corners of a line may be off it that arcs do not have."""
    kept = _straightened(points, collinear)
    points = points[kept] if len(kept) >= 3 else points
    return _joined(points, _arcs(points, tolerance), tolerance)


def _distinct(points: np.ndarray, least: float) -> np.ndarray:
    kept = [0]
    for i in range(1, len(points)):
        if math.dist(points[i], points[kept[-1]]) > least:
            kept.append(i)
    if len(kept) > 1 and math.dist(points[kept[-1]], points[0]) <= least:
        kept.pop()
    return points[kept]


def _whole_circle(points: np.ndarray, tolerance: float) -> Loop | None:
    if len(points) < _CLOSED:
        return None
    centre, radius, off = circle_through(points)
    if off > tolerance or radius <= tolerance:
        return None
    angle = np.unwrap(np.arctan2(*(points - centre).T[::-1]))
    steps = np.diff(np.append(angle, angle[0] + math.copysign(2 * math.pi, angle[-1] - angle[0])))
    if np.abs(steps).max() > _TURN + math.radians(4) or (np.sign(steps) != np.sign(steps[0])).any():
        return None
    return circle(radius, (float(centre[0]), float(centre[1])))


def _straightened(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Indices of the corners that stay: the farthest from chords, until all others lie on them."""
    count = len(points)
    first = int(np.argmax(lengths(points - points.mean(axis=0))))
    order = (np.arange(count + 1) + first) % count
    return np.sort(order[open_line(points[order], tolerance)[:-1]])


def _arcs(points: np.ndarray, tolerance: float) -> list[tuple[int, int]]:
    """(start, chords) of the chains that are arcs; they share corners at most."""
    count = len(points)
    way = following(points) - points
    heading = np.arctan2(way[:, 1], way[:, 0])
    turn = (heading - np.roll(heading, 1) + math.pi) % (2 * math.pi) - math.pi  # at each corner
    # A chain passes a corner that turns a little, and to the same side as the one before.
    passes = (np.abs(turn) <= _STEEP) & (np.abs(turn) > 1e-4)
    # From a corner that none passes, if there is one: else an arc may be cut in two where all is round.
    first = int(np.argmax((way**2).sum(axis=1) * np.where(passes.all(), 1.0, ~passes)))
    found: list[tuple[int, int]] = []
    at = 0
    while at < count - 1:
        start = first + at
        most = 1
        sign = turn[(start + 1) % count]
        while at + most < count:
            corner = (start + most) % count
            if not passes[corner] or turn[corner] * sign < 0:
                break
            most += 1
        chords = _longest(points, turn, start % count, most, tolerance)
        if chords:
            found.append((start % count, chords))
        at += chords or 1
    return found


def _longest(points: np.ndarray, turn: np.ndarray, start: int, most: int, tolerance: float) -> int:
    """Chords from a corner on, at most so many, that make an arc; 0 where none do."""

    def arc(chords: int) -> bool:
        index = (start + np.arange(chords + 1)) % len(points)
        return _is_arc(points[index], turn[index], tolerance)

    reach = next((k for k in (3, 2, 4) if k <= most and arc(k)), 0)
    if not reach:
        return 0
    step = 1
    while step:
        if reach + step <= most and arc(reach + step):
            reach, step = reach + step, step * 2
        else:
            step //= 2
    return reach


def _is_arc(points: np.ndarray, turn: np.ndarray, tolerance: float) -> bool:
    """Whether corners (K + 1, 2) of K chords lie on an arc; turn: at each of them."""
    inner = np.abs(turn[1:-1])
    _, radius, off = circle_through(points)
    if len(points) == 3:
        off = 0.0
    if off > tolerance or not tolerance < radius < math.inf:
        return False
    tangent = _tangent(float(turn[0]), inner[0], turn[1]) and _tangent(float(turn[-1]), inner[-1], turn[1])
    if len(inner) + 1 < _FEWEST or inner.max() > _TURN:
        return tangent and inner.max() - inner.min() < 0.2 * inner.max()
    # A long chord among short ones is a line between two arcs, though a circle may pass through its ends.
    chord = np.sort(lengths(points[1:] - points[:-1]))
    return bool(chord[-1] <= _EVEN * chord[-2] and 2 * math.asin(min(1.0, chord[-1] / (2 * radius))) <= _TURN)


def _tangent(end: float, inner: float, sign: float) -> bool:
    """Whether a turn at the end of a chain is half of those within it."""
    return end * sign >= 0 and abs(abs(end) - inner / 2) < 0.25 * inner


def _joined(points: np.ndarray, arcs: list[tuple[int, int]], tolerance: float) -> Loop | None:
    """Arcs, and between them as few lines as the tolerance allows."""
    count = len(points)
    if not arcs:
        kept = _straightened(points, tolerance)
        return tuple((float(x), float(y), 0.0) for x, y in points[kept]) if len(kept) >= 3 else None
    corners: list[Corner] = []
    ordered = sorted((start % count, chords) for start, chords in arcs)
    for (start, chords), (then, _) in zip(ordered, [*ordered[1:], (ordered[0][0] + count, 0)], strict=True):
        end = start + chords
        chain = points[(start + np.arange(chords + 1)) % count]
        corners += _arc(chain)
        gap = points[np.arange(end, then + 1) % count]
        between = gap[open_line(gap, tolerance)[:-1]]
        corners += [(float(x), float(y), 0.0) for x, y in between]
    return tuple(corners) if len(corners) >= 2 else None


def _arc(chain: np.ndarray) -> list[Corner]:
    """Its first corner with the bulge to the last; two pieces from three quarters of a circle on."""
    centre, _, _ = circle_through(chain)
    angle = np.unwrap(np.arctan2(*(chain - centre).T[::-1]))
    sweep = float(angle[-1] - angle[0])
    if abs(sweep) < 1.4 * math.pi:
        return [(float(chain[0, 0]), float(chain[0, 1]), math.tan(sweep / 4))]
    cut = len(chain) // 2
    return [
        (float(chain[i, 0]), float(chain[i, 1]), math.tan(float(angle[j] - angle[i]) / 4))
        for i, j in ((0, cut), (cut, -1))
    ]
