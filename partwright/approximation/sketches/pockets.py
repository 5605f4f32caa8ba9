"""A wall all around, or an opening, and a floor that closes it: what a person draws as a pocket."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType

from partwright.approximation.profile_parts import extruded_part
from partwright.approximation.sketches.holes import hole_parts
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Cylinder, Extrusion
from partwright.fields.profile import Loop, Profile, circle

_FLUSH = 3e-3  # unit lengths: how far ends, and outlines, that are one may lie apart
_PARALLEL = 1e-6  # of a cosine
_THICKEST = 0.9  # of the wall's height, that the floor has


Pocketed = tuple[Part, tuple[Part, ...], tuple[Part, ...]]


def as_pockets(wall: Part, floor: Part) -> Iterator[Pocketed]:
    """The wall without the holes that the floor closes, the pockets that are left of these, those that are
    alike as copies of one, and the floor's own holes; nothing where the floor closes none, or reaches beyond
    the wall.

    A floor that ends where the wall does leaves one pocket. Another may have more than itself on either side,
    so it gives several possibilities; what of it is beyond the wall's ends is left out. Of walls that are
    there more than once each has a copy of the floor.
    Lengths in the unit frame.
    """
    if len(wall.copies) != len(floor.copies):
        return
    alone = dataclasses.replace(wall, instances=())
    for copy in floor.copies:
        for body, *cuts in _pocketed(alone, copy):
            pockets, holes = ([_repeated(cut, wall) for cut in own] for own in cuts)
            yield _repeated(body, wall), tuple(pockets), tuple(holes)


def _repeated(part: Part, like: Part) -> Part:
    """With the copies of another part, and of each its own."""
    own = part.instances
    moves = (*own, *(move @ inner for move in like.instances for inner in (Similarity(), *own)))
    return dataclasses.replace(part, instances=moves)


def _pocketed(wall: Part, floor: Part) -> Iterator[Pocketed]:
    field, lid = wall.field, _upright(floor)
    if not isinstance(field, Extrusion) or field.taper or field.has_rims or lid is None:
        return
    frame, other = rotation_matrix(wall.rotation), rotation_matrix(floor.rotation)
    if abs(float(frame[:, 2] @ other[:, 2])) < 1 - _PARALLEL:
        return
    at = float(frame[:, 2] @ np.subtract(floor.translation, wall.translation))
    half = field.height / 2
    low, high = max(at - lid.height / 2, -half), min(at + lid.height / 2, half)
    if not 0 < high - low < _THICKEST * field.height:
        return
    below, above = (-half, low), (high, half)
    choices: list[tuple[tuple[float, float], ...]]
    if abs(low + half) < _FLUSH:
        choices = [(above,)]
    elif abs(high - half) < _FLUSH:
        choices = [(below,)]
    else:
        choices = [(above,), (below,), (below, above)]

    # As it lies in the wall's plane, whichever side of it is up.
    lines = np.concatenate(Profile(lid.profile.outline).polylines(_FLUSH / 4))
    placed = np.column_stack([lines, np.zeros(len(lines))]) @ other.T + floor.translation
    cover = _section([((placed - wall.translation) @ frame)[:, :2]])
    closed = [loop for loop in field.profile.holes if _holds(cover, _filled(loop))]
    if not closed or not _holds(_filled(field.profile.outline), cover):
        return
    rest = tuple(loop for loop in field.profile.holes if loop not in closed)
    middle = frame.T @ np.array(wall.translation)

    def extruded(profile: Profile, ends: tuple[float, float]) -> Part:
        return extruded_part(profile.moved(middle[:2]), frame, middle[2] + ends[0], middle[2] + ends[1])

    body = extruded(Profile(field.profile.outline, rest), (-half, half))
    holes = hole_parts(dataclasses.replace(floor, field=lid)) if lid.profile.holes else ()
    for left in choices:
        walls = (extruded(Profile(field.profile.outline, tuple(closed)), ends) for ends in left)
        pockets = tuple(pocket for one in walls for pocket in hole_parts(one))
        yield dataclasses.replace(body, name=wall.name), pockets, holes


def closed_by(cut: Part, floor: Part) -> Iterator[Part]:
    """A cut as far as a floor does not fill one of its ends, in each direction in which it does.

    Of a cut that is there more than once each has a copy of the floor. Lengths in the unit frame.
    """
    field = cut.field
    shaped = isinstance(field, Extrusion) and (field.taper or field.has_rims)
    if shaped or not isinstance(field, Box | Cylinder | Extrusion) or len(cut.copies) != len(floor.copies):
        return
    frame = rotation_matrix(cut.rotation)
    corners = np.array(floor.field.bounds())
    room = (corners[1] - corners[0]) / 2
    for copy, k in product(floor.copies, range(3) if isinstance(field, Box) else (2,)):
        axis, turn = frame[:, k], rotation_matrix(copy.rotation)
        middle = float(axis @ (turn @ corners.mean(axis=0) + copy.translation - cut.translation))
        reach = float(np.abs(axis @ turn) @ room)
        low, high = middle - reach, middle + reach
        half = (field.size[k] if isinstance(field, Box) else field.height) / 2
        if low < _FLUSH - half < high < half:
            filled, left = (-half, high), (high, half)
        elif -half < low < half - _FLUSH < high:
            filled, left = (low, half), (-half, low)
        else:
            continue
        if _is_within(_between(cut, k, *filled), copy):
            yield _between(cut, k, *left)


def _is_within(one: Part, other: Part) -> bool:
    """Whether the box of one part, without copies, lies within that of another."""
    (low, high), (least, most) = (part.copies[0].bounds() for part in (one, other))
    return bool((low > least - _FLUSH).all() and (high < most + _FLUSH).all())


def _between(cut: Part, axis: int, low: float, high: float) -> Part:
    """From one height to another along an axis of its own."""
    x, y, z = (cut.translation + rotation_matrix(cut.rotation)[:, axis] * (low + high) / 2).tolist()
    field: Box | Cylinder | Extrusion
    if isinstance(cut.field, Box):
        width, depth, height = (high - low if k == axis else v for k, v in enumerate(cut.field.size))
        field = dataclasses.replace(cut.field, size=(width, depth, height))
    else:
        assert isinstance(cut.field, Cylinder | Extrusion)
        field = dataclasses.replace(cut.field, height=high - low)
    return dataclasses.replace(cut, field=field, translation=(x, y, z))


def _upright(part: Part) -> Extrusion | None:
    field = part.field
    if isinstance(field, Box):
        return Extrusion(Profile.rectangle(*field.size[:2]), field.size[2])
    if isinstance(field, Cylinder):
        return Extrusion(Profile(circle(field.radius)), field.height)
    return field if isinstance(field, Extrusion) and not field.taper and not field.has_rims else None


def _filled(loop: Loop) -> CrossSection:
    return _section(Profile(loop).polylines(_FLUSH / 4))


def _section(lines: Sequence[np.ndarray]) -> CrossSection:
    return CrossSection(list(lines), FillRule.EvenOdd)


def _holds(one: CrossSection, other: CrossSection) -> bool:
    """Whether a region holds another, but for what is flush."""
    return bool((other - one.offset(_FLUSH, JoinType.Miter)).is_empty())
