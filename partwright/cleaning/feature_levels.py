"""Where features end and are centred along the axes of their frame, and how large they are round."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Part
from partwright.assembly.euler_angles import typed_turn
from partwright.assembly.similarity import rotation_matrix
from partwright.cleaning.dimensions import dimensions, flat, reaches, turned_freely, values
from partwright.cleaning.orientations import CUBE, along
from partwright.cleaning.outline_equations import arc
from partwright.fields import Extrusion, Pipe, Revolution, Swept
from partwright.fields.extrusion import RIMS
from partwright.fields.profile import circle_of

Floats = NDArray[np.float64]
Key = tuple[str | int, ...]

ROUND = ("radius", "bottom_radius", "top_radius", "major_radius", "minor_radius")
_SHORT = 3.0  # tolerances: shorter sides have no direction


@dataclass(frozen=True)
class Lying:
    """A part along the axes of a frame: local = turn.T @ (frame.T @ point - at)."""

    part: Part
    frame: Floats
    """(3, 3), its columns the axes."""
    turn: Floats
    """(3, 3), one of the 24 turns of a cube."""
    at: Floats
    """(3,) the part's place along the axes."""

    def axis(self, local: int) -> tuple[int, float]:
        """Which axis of the frame a local one lies along, and whether forwards (1) or backwards (-1)."""
        k = int(np.abs(self.turn[:, local]).argmax())
        return k, float(self.turn[k, local])


@dataclass(frozen=True)
class Level:
    """A flat face or a centre of a part, at a place along an axis of its frame."""

    part: int
    kind: str
    """"face" or "centre"."""
    local: int
    """The part's own axis."""
    key: Key
    """("end", 0 or 1), ("side", corner, next), ("arc", corner, next), ("circle", loop), ("place",), or of a
    pipe ("corner", index)."""
    axis: int
    value: float


@dataclass(frozen=True)
class Size:
    """A radius of a part, or the length of a chamfer."""

    part: int
    key: Key
    """("number", index), ("arc" or "turned", corner, next), ("circle", loop), ("rim", name), or of a pipe
    ("radius",), ("thickness",) or ("bend", index)."""
    value: float
    whole: bool
    """Whether it goes all around, so that a drawing gives the diameter."""
    name: str


def lying(part: Part, frames: list[Floats], tolerance: float) -> Lying:
    """The part along the first frame that it nearly lies in, its surface moving no more than the tolerance;
    else its own frame is a further one."""
    rotation = rotation_matrix(part.rotation)
    size = float(np.ptp(np.array(part.field.bounds()), axis=0).max())
    most = 2 * tolerance / max(size, tolerance)
    for frame in frames:
        local = frame.T @ rotation
        free = freely(part)
        if free:  # only the direction of the axis counts
            k = int(np.abs(local[:, 2]).argmax())
            axis = np.zeros(3)
            axis[k] = np.sign(local[k, 2])
            turn = along(axis, "arrow")
            near = float(np.linalg.norm(local[:, 2] - axis)) <= most
        else:
            turn = max(CUBE, key=lambda t: float((t * local).sum()))
            near = float(np.linalg.norm(local - turn, axis=0).max()) <= most
        if near:
            return Lying(part, frame, np.asarray(turn), frame.T @ np.array(part.translation))
    rotation = rotation_matrix(typed_turn(part.rotation))
    frames.append(rotation)
    return Lying(part, rotation, np.eye(3), rotation.T @ np.array(part.translation))


def freely(part: Part) -> bool:
    """Whether the part, alone, may be turned about its own z without a difference."""
    if part.instances:
        return False
    if isinstance(part.field, Revolution):
        return part.field.full
    return not isinstance(part.field, Swept | Pipe) and turned_freely(part.field) in ("axis", "arrow", "all")


def levels(index: int, one: Lying, tolerance: float) -> Iterator[Level]:
    """Of a part, in its frame."""
    field = one.part.field
    if isinstance(field, Extrusion):
        if not field.taper:
            yield from (
                _level(index, one, "face", 2, ("end", k), z * field.height) for k, z in ((0, -0.5), (1, 0.5))
            )
        yield from _of_profile(index, one, (0, 1), _SHORT * tolerance)
    elif isinstance(field, Revolution):
        yield from (_level(index, one, "centre", k, ("place",), 0.0) for k in (0, 1))
        yield from _of_profile(index, one, (None, 2), _SHORT * tolerance)
    elif isinstance(field, Pipe):
        for i, corner in enumerate(field.path):
            yield from (_level(index, one, "centre", k, ("corner", i), corner[k]) for k in range(3))
    else:
        reach = reaches(field)
        for k in range(3):
            if reach is not None and flat(field)[k]:
                half = float(reach[k] @ values(field))
                yield from (_level(index, one, "face", k, ("end", s > 0), s * half) for s in (-1, 1))
            else:
                yield _level(index, one, "centre", k, ("place",), 0.0)


def _of_profile(index: int, one: Lying, axes: Sequence[int | None], least: float) -> Iterator[Level]:
    """axes: the part's own that the profile's x and y lie along."""
    assert isinstance(one.part.field, Swept)
    profile = one.part.field.profile
    for number, (loop, sides) in enumerate(zip(profile.loops, profile.sides, strict=True)):
        whole = circle_of(loop)
        if whole is not None:
            for k, local in enumerate(axes):
                if local is not None:
                    yield _level(index, one, "centre", local, ("circle", number), whole[1][k])
            continue
        for (a, b), side in zip(sides_of(one.part.field, number), sides, strict=True):
            for k, local in enumerate(axes):
                if local is None:
                    continue
                if side.centre is not None:
                    yield _level(index, one, "centre", local, ("arc", a, b), side.centre[k])
                elif (
                    abs(side.end[k] - side.start[k])
                    <= least / _SHORT
                    < least
                    <= abs(side.end[1 - k] - side.start[1 - k])
                ):
                    middle = (side.start[k] + side.end[k]) / 2
                    yield _level(index, one, "face", local, ("side", a, b), middle)


def sides_of(field: Swept, loop: int) -> Iterator[tuple[int, int]]:
    """Corners, counted over all loops, between which the sides of a loop run."""
    start, end = field.profile.starts[loop : loop + 2].tolist()
    for k in range(start, end):
        yield k, k + 1 if k + 1 < end else start


def _level(index: int, one: Lying, kind: str, local: int, key: Key, value: float) -> Level:
    k, sign = one.axis(local)
    return Level(index, kind, local, key, k, float(one.at[k] + sign * value))


def sizes(index: int, one: Lying, tolerance: float) -> Iterator[Size]:
    """Radii of a part."""
    field = one.part.field
    if isinstance(field, Pipe):
        yield Size(index, ("radius",), field.radius, True, "radius")
        if field.thickness:
            yield Size(index, ("thickness",), field.thickness, False, "thickness")
        bends = ((i, bend) for i, (*_, bend) in enumerate(field.path) if bend)
        yield from (Size(index, ("bend", i), bend, False, "bend") for i, bend in bends)
        return
    if not isinstance(field, Swept):
        for k, dimension in enumerate(dimensions(type(field))):
            if dimension.name in ROUND:
                yield Size(index, ("number", k), float(values(field)[k]), True, dimension.name)
        return
    if isinstance(field, Extrusion):
        rims = ((name, getattr(field, name)) for name in RIMS)
        yield from (
            Size(index, ("rim", name), value, False, name.replace("_", " ")) for name, value in rims if value
        )
    turned = isinstance(field, Revolution)
    corners = field.profile.corners
    for number, (loop, sides) in enumerate(zip(field.profile.loops, field.profile.sides, strict=True)):
        whole = circle_of(loop)
        if whole is not None:
            yield Size(index, ("circle", number), whole[0], not turned, "radius")
            continue
        for (a, b), side in zip(sides_of(field, number), sides, strict=True):
            if side.centre is not None:
                yield Size(index, ("arc", a, b), arc(corners, a, b)[2], False, "radius")
            elif turned and abs(side.end[0] - side.start[0]) <= tolerance and side.start[0] > tolerance:
                middle = (side.start[0] + side.end[0]) / 2
                yield Size(index, ("turned", a, b), middle, True, "radius")


def with_place(one: Lying, at: Floats, **changes: object) -> Part:
    """The part at another place along its frame, and otherwise as told."""
    from partwright.cleaning.model import quaternion_of

    x, y, z = (one.frame @ at).tolist()
    rotation = quaternion_of(one.frame @ one.turn)
    part = dataclasses.replace(one.part, translation=(x, y, z), rotation=rotation)
    return dataclasses.replace(part, **changes)  # type: ignore[arg-type]
