"""Copies and equal parts around a circle, and pairs on both sides of a plane."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part
from partwright.assembly.euler_angles import rotation_of
from partwright.cleaning.dimensions import values
from partwright.cleaning.features import Feature
from partwright.cleaning.model import Model
from partwright.cleaning.orientations import Frames, aligned, angle

Floats = NDArray[np.float64]

_NEAR = 0.01  # degrees, of the turns of the copies
_SENSIBLE = 15.0  # degrees
_FEWEST = 3


@dataclass(frozen=True)
class Circle:
    """Copies in equal steps around an axis."""

    copies: tuple[int, ...]
    """In their order around it."""
    axis: int
    """Of the frame: 0, 1 or 2."""
    frame: int
    """Which of the frames."""
    phase: float
    """The first copy's angle in degrees."""
    centre: tuple[Floats, Floats]
    """Rows for where the axis lies, along the two directions across it."""
    rows: tuple[Floats, ...]
    """Equations, all equal 0, that make it a circle."""

    def radius(self, model: Model, frames: Frames, phase: float) -> tuple[Floats, Floats]:
        """Rows for the first copy's distance from the centre along the phase and across it."""
        u, v = _plane(frames.rotations[self.frame], self.axis)
        across, along = _offset(model, self.copies[0], u, v, self.centre)
        c, s = np.cos(np.radians(phase)), np.sin(np.radians(phase))
        return c * across + s * along, c * along - s * across

    def turn(self, frames: Frames, steps: int) -> Floats:
        """(3, 3) of so many steps on."""
        return _about(frames.rotations[self.frame], self.axis, 360.0 * steps / len(self.copies))


def equal_leaves(model: Model, vector: Floats, reach: float) -> list[list[int]]:
    """Leaves of one kind whose dimensions all are within `reach` (as far as the surface moves by them)."""
    found: list[list[int]] = []
    for leaf, part in enumerate(model.leaves):
        for group in found:
            other = model.leaves[group[0]]
            if type(other.field) is type(part.field) and abs(other.blend - part.blend) <= reach:
                columns, others = model.numbers(leaf), model.numbers(group[0])
                apart = np.abs(vector[columns] - vector[others]) * model.weights[columns]
                most = np.minimum(reach, 0.1 * np.abs(vector[others]) * model.weights[columns] + 1e-12)
                if (apart <= most).all():
                    group.append(leaf)
                    break
        else:
            found.append([leaf])
    return [group for group in found if len(group) > 1]


def circles(model: Model, vector: Floats, frames: Frames, reach: float) -> Iterator[Circle]:
    """Circles of equal parts, those of the most copies first."""
    found = []
    for copies in _classes(model, vector, reach):
        for f, frame in enumerate(frames.rotations):
            for k in range(3):
                found += _circles_about(model, vector, copies, f, frame, k, reach)
    taken: set[int] = set()
    for circle in sorted(found, key=lambda c: (-len(c.copies), c.axis)):
        if not taken & set(circle.copies):
            taken |= set(circle.copies)
            yield circle


def _classes(model: Model, vector: Floats, reach: float) -> list[list[int]]:
    """Copies of equal parts."""
    together = equal_leaves(model, vector, reach)
    single = set(range(len(model.leaves))) - {leaf for group in together for leaf in group}
    groups = [*together, *([leaf] for leaf in sorted(single))]
    classes = [np.flatnonzero(np.isin(model.leaf_of, group)).tolist() for group in groups]
    return [copies for copies in classes if len(copies) >= _FEWEST]


def _circles_about(
    model: Model, vector: Floats, copies: list[int], f: int, frame: Floats, k: int, reach: float
) -> list[Circle]:
    u, v = _plane(frame, k)
    places = np.array([vector[model.places(c)] for c in copies])
    flat = places @ np.stack([u, v], axis=1)
    level = places @ frame[:, k]
    result = []
    for centre, rows in _centres(model, vector, copies, flat, u, v):
        away = flat - centre
        radius = np.hypot(*away.T)
        for group in _alike(np.stack([radius, level], axis=1), reach):
            if len(group) < _FEWEST or radius[group].min() < 4 * reach:
                continue
            circle = _circle(model, [copies[i] for i in group], away[group], f, k, rows, frame, reach)
            if circle is not None:
                result.append(circle)
    return result


def _circle(
    model: Model,
    copies: list[int],
    away: Floats,
    f: int,
    k: int,
    centre: tuple[Floats, Floats],
    frame: Floats,
    reach: float,
) -> Circle | None:
    """Of copies `away` (n, 2) from the centre; None where steps or turns are uneven."""
    degrees = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    # The circle starts where an axis of the frame crosses it, if anywhere.
    start = int(np.argmin(np.abs(degrees - 90 * np.rint(degrees / 90)) * 1000 + np.abs(degrees)))
    order = np.argsort((degrees - degrees[start] + 1e-6) % 360, kind="stable")
    degrees, copies = degrees[order], [copies[i] for i in order]
    step = 360.0 / len(copies)
    uneven = (degrees - degrees[0] - step * np.arange(len(copies)) + 180) % 360 - 180
    if np.abs(np.radians(uneven)).max() * np.hypot(*away.T).max() > reach:
        return None
    u, v = _plane(frame, k)
    base = copies[0]
    freely = model.freely(base)
    first = _offset(model, base, u, v, centre)
    rows = []
    for i, copy in enumerate(copies[1:], start=1):
        turn = _about(frame, k, step * i)
        if angle(turn @ model.rotations[base], model.rotations[copy], freely) > _NEAR:
            return None
        c, s = np.cos(np.radians(step * i)), np.sin(np.radians(step * i))
        own = _offset(model, copy, u, v, centre)
        rows += [own[0] - c * first[0] + s * first[1], own[1] - s * first[0] - c * first[1]]
        level = np.zeros(len(model.variables))
        level[model.places(copy)] = frame[:, k]
        level[model.places(base)] -= frame[:, k]
        rows.append(level)
    return Circle(tuple(copies), k, f, float(degrees[0]), centre, tuple(rows))


def _centres(
    model: Model, vector: Floats, copies: list[int], flat: Floats, u: Floats, v: Floats
) -> Iterator[tuple[Floats, tuple[Floats, Floats]]]:
    """Where a circle may have its centre: the origin, other parts, the copies' own middle."""
    nothing = np.zeros(len(model.variables))
    yield np.zeros(2), (nothing, nothing)
    for other in model.firsts.tolist():
        if other in copies or len(model.leaves[int(model.leaf_of[other])].copies) > 1:
            continue
        rows = _offset(model, other, u, v, (nothing, nothing))
        yield np.array([rows[0] @ vector, rows[1] @ vector]), rows
    middle = [_offset(model, c, u, v, (nothing, nothing)) for c in copies]
    mean = (np.mean([m[0] for m in middle], axis=0), np.mean([m[1] for m in middle], axis=0))
    yield flat.mean(axis=0), mean


def _alike(numbers: Floats, reach: float) -> list[list[int]]:
    """Rows (n, d) within `reach` of the first of their group."""
    groups: list[list[int]] = []
    for i, row in enumerate(numbers):
        for group in groups:
            if np.abs(numbers[group[0]] - row).max() <= reach:
                group.append(i)
                break
        else:
            groups.append([i])
    return groups


def _plane(frame: Floats, k: int) -> tuple[Floats, Floats]:
    return frame[:, (k + 1) % 3], frame[:, (k + 2) % 3]


def _about(frame: Floats, k: int, degrees: float) -> Floats:
    about = np.zeros(3)
    about[k] = degrees
    return np.asarray(frame @ rotation_of(*about.tolist()) @ frame.T)


def _offset(
    model: Model, copy: int, u: Floats, v: Floats, centre: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Rows of a copy's place in the plane of u and v, from the centre."""
    rows = []
    for direction, middle in zip((u, v), centre, strict=True):
        row = np.zeros(len(model.variables))
        row[model.places(copy)] = direction
        rows.append(row - middle)
    return rows[0], rows[1]


def mirror_pairs(
    model: Model,
    vector: Floats,
    frames: Frames,
    planes: Sequence[Feature],
    axis: int,
    frame: int,
    reach: float,
) -> Iterator[tuple[int, int, Floats]]:
    """Pairs of equal copies on both sides of a plane across an axis of a frame, and the equation (equal to 0)
    that puts them there. planes: centres along that axis, the best supported first."""
    directions = frames.rotations[frame]
    for copies in [*_classes(model, vector, reach), *_pairs(model, vector, reach)]:
        lying = [c for c in copies if aligned(directions, model.rotations[c], model.freely(c)) is not None]
        places = {c: directions.T @ vector[model.places(c)] for c in lying}
        for i, a in enumerate(lying):
            for b in lying[i + 1 :]:
                apart = np.abs(places[a] - places[b])
                if apart[axis] < 2 * reach or np.delete(apart, axis).max() > reach:
                    continue
                middle = (places[a][axis] + places[b][axis]) / 2
                for plane in planes:
                    if abs(plane.value(vector) - middle) <= reach and plane.owner not in (a, b):
                        row = np.zeros(len(model.variables))
                        row[model.places(a)] = directions[:, axis] / 2
                        row[model.places(b)] += directions[:, axis] / 2
                        yield a, b, row - plane.row
                        break


def _pairs(model: Model, vector: Floats, reach: float) -> list[list[int]]:
    """Two copies, or two equal parts of one each: too few for a circle."""
    groups = [*equal_leaves(model, vector, reach), *([leaf] for leaf in range(len(model.leaves)))]
    classes = [np.flatnonzero(np.isin(model.leaf_of, group)).tolist() for group in groups]
    return [copies for copies in classes if len(copies) == 2]


def same_numbers(a: Part, b: Part, same: float) -> bool:
    """Whether two leaves have the same field and blend, to rounding."""
    if type(a.field) is not type(b.field) or abs(a.blend - b.blend) > same:
        return False
    return bool(np.abs(values(a.field) - values(b.field)).max() <= same)
