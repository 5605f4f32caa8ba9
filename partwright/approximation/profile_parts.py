"""Profiles that are moved or turned, as posed parts: by the name of a solid where they have one."""

from __future__ import annotations

import dataclasses

import numpy as np

from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Cone, Cylinder, Extrusion, Field, Frustum, Revolution, Sphere, Tube
from partwright.fields.profile import Loop, Profile, circle, circle_of
from partwright.fields.profile_distance import profile_distance
from partwright.fields.rims import Rim

_SAME = 1e-5  # of the size: lengths that differ by less are equal
_SQUARE = 0.01
_TURNED = 1e-4  # of a frame's directions, that are equal


def extruded_part(
    profile: Profile,
    frame: np.ndarray,
    low: float,
    high: float,
    taper: float = 0.0,
    rims: tuple[Rim, Rim] | None = None,
) -> Part:
    """The profile from one height to another along the frame's third column: a box, cylinder or tube where it
    is one, and rims of the bottom and the top are sharp. frame: (3, 3) local to world.

    Raises:
        ParameterError: the profile has no room for the rims, or the taper.
    """
    height, middle = high - low, (low + high) / 2
    round_ = circle_of(profile.outline)
    plain = not taper and rims is None
    if round_ is not None and plain:
        radius, (x, y) = round_
        place = frame @ (x, y, middle)
        if not profile.holes:
            return _placed(Cylinder(radius, height), frame, place)
        bore = circle_of(profile.holes[0]) if len(profile.holes) == 1 else None
        if bore is not None and np.hypot(bore[1][0] - x, bore[1][1] - y) < _SAME * radius:
            return _placed(Tube(radius, radius - bore[0], height), frame, place)
    box = _rectangle(profile.outline) if not profile.holes else None
    if box is not None and plain:
        (width, depth), along, (x, y) = box
        turned = frame @ np.array([[along[0], -along[1], 0], [along[1], along[0], 0], [0, 0, 1]])
        return _placed(Box((width, depth, height)), turned, frame @ (x, y, middle))
    lower, upper = profile.bounds()
    x, y = ((lower + upper) / 2).tolist()
    own = (
        {}
        if rims is None
        else {
            name: value
            for rim, end in zip(rims, ("bottom", "top"), strict=True)
            for name, value in ((f"{end}_fillet", rim.fillet), (f"{end}_chamfer", rim.chamfer))
        }
    )
    field = Extrusion(profile.moved((-x, -y)), height, taper, **own)
    return _placed(field, frame, frame @ (x, y, middle))


def with_profile(part: Part, profile: Profile) -> Part:
    """What an extrusion without taper and rims is with another profile, in its frame: no copies, no name."""
    assert isinstance(part.field, Extrusion)
    frame, half = rotation_matrix(part.rotation), part.field.height / 2
    x, y, z = (frame.T @ np.array(part.translation)).tolist()
    return extruded_part(profile.moved((x, y)), frame, z - half, z + half)


def stacked(one: Part, other: Part, near: float) -> Part | None:
    """Two extrusions of the same profile, one at the end of the other in the same frame, as one as long as
    both: None of others. Copies and the name are those of the first; neither has rims.

    near: lengths that differ by less are equal.
    """
    first, second = drawn_profile(one.field), drawn_profile(other.field)
    if first is None or second is None:
        return None
    way = one.pose.inverse() @ other.pose
    x, y, z = way.translation
    (profile, height), (its, more) = first, second
    apart = abs(z) - (height + more) / 2
    if not np.allclose(rotation_matrix(way.rotation), np.eye(3), atol=_TURNED) or abs(apart) > near:
        return None
    rims = [f.rims for f in (one.field, other.field) if isinstance(f, Extrusion)]
    if any(rim.depth for both in rims for rim in both):
        return None
    if not _are_same(profile, its.moved((x, y)), near):
        return None
    axis = rotation_matrix(one.rotation)[:, 2]
    place = np.array(one.translation) + axis * np.copysign((more + apart) / 2, z)
    assert isinstance(one.field, Extrusion | Cylinder | Tube)
    field = dataclasses.replace(one.field, height=height + more + apart)
    a, b, c = place.tolist()
    return dataclasses.replace(one, field=field, translation=(a, b, c))


def _are_same(one: Profile, other: Profile, near: float) -> bool:
    """Whether the lines of each lie on those of the other, wherever their arcs are cut in two."""
    lines = (np.concatenate(profile.polylines(near / 4)) for profile in (one, other))
    off = (np.abs(profile_distance(p, line)).max() for p, line in zip((other, one), lines, strict=True))
    return len(one.holes) == len(other.holes) and max(off) < near


def drawn_profile(field: Field) -> tuple[Profile, float] | None:
    """The profile that is extruded along z, without taper, and how far; None of what is no such solid. Rims
    are left out."""
    if isinstance(field, Extrusion):
        return (field.profile, field.height) if not field.taper else None
    if isinstance(field, Cylinder):
        return Profile(circle(field.radius)), field.height
    if isinstance(field, Tube):
        inner = circle(field.radius - field.thickness)
        return Profile(circle(field.radius), (inner,)), field.height
    return None


def _rectangle(loop: Loop) -> tuple[tuple[float, float], np.ndarray, tuple[float, float]] | None:
    """Width, depth, direction of the width and centre of a loop of four square corners."""
    if len(loop) != 4 or any(abs(b) > 1e-9 for _, _, b in loop):
        return None
    corners = np.array(loop)[:, :2]
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    if any(
        abs(sides[i] @ sides[(i + 1) % 4]) > _SQUARE * lengths[i] * lengths[(i + 1) % 4] for i in range(4)
    ):
        return None
    first = int(np.abs(sides[:, 0] / lengths).argmax())
    along = sides[first] / lengths[first] * (1 if sides[first, 0] > 0 else -1)
    width, depth = (lengths[i] + lengths[(i + 2) % 4] for i in (first, first - 1))
    x, y = corners.mean(axis=0).tolist()
    return (float(width / 2), float(depth / 2)), along, (x, y)


def revolved_part(profile: Profile, frame: np.ndarray, foot: np.ndarray, angle: float = 360.0) -> Part:
    """The profile turned about the frame's third column: a cylinder, cone, frustum or sphere where it is one.
    foot: (3,) of the axis, in the frame. angle: degrees, from the frame's x on."""
    size = profile.size
    loops = [tuple((0.0 if abs(x) < _SAME * size else x, y, b) for x, y, b in loop) for loop in profile.loops]
    heights = [y for _, y, _ in loops[0]]
    low, high = min(heights), max(heights)
    named = _named(loops[0], low, high) if len(loops) == 1 and angle >= 360 else None
    if named is not None:
        field, middle, over = named
        turned = frame @ np.diag([1.0, -1.0, -1.0]) if over else frame
        return _placed(field, turned, frame @ (foot[0], foot[1], middle))
    middle = (low + high) / 2
    moved = Profile.of_loops(loops).moved((0.0, -middle))
    return _placed(Revolution(moved, angle), frame, frame @ (foot[0], foot[1], middle))


def _named(loop: Loop, low: float, high: float) -> tuple[Field, float, bool] | None:
    """The solid, the height of its middle, and whether it stands on its head."""
    arcs = [b for _, _, b in loop if abs(b) > 1e-9]
    middle, height = (low + high) / 2, high - low
    same = _SAME * max(height, max(x for x, _, _ in loop))
    if arcs:
        whole = len(arcs) == 1 and len(loop) == 2 and abs(arcs[0] - 1) < 1e-4
        return (Sphere(height / 2), middle, False) if whole else None
    bottom = max(x for x, y, _ in loop if y <= low + same)
    top = max(x for x, y, _ in loop if y >= high - same)
    on_axis = sum(x == 0 for x, _, _ in loop)
    if on_axis != 2 or len(loop) != 2 + (bottom > same) + (top > same):
        return None
    if abs(bottom - top) <= same:
        return Cylinder((bottom + top) / 2, height), middle, False
    wide, narrow, over = (bottom, top, False) if bottom > top else (top, bottom, True)
    if narrow <= same:
        return Cone(wide, height), middle, over
    return Frustum(wide, narrow, height), middle, over


def _placed(field: Field, frame: np.ndarray, place: np.ndarray) -> Part:
    """frame: (3, 3) local to world. place: (3,) of the field's origin."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = frame, place
    move = Similarity.from_matrix(pose)
    tidy = [0.0 if abs(v) < 1e-12 else v for v in move.rotation]
    x, y, z = place.tolist()
    return Part(field, (x, y, z), (tidy[0], tidy[1], tidy[2], tidy[3]))
