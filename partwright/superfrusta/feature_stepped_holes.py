"""Drilled holes that go on from one another on one axis, as a counterbore and the hole below it do: one
turned hole, which is how they are drawn."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from manifold3d import CrossSection, FillRule
from numpy.typing import NDArray

from partwright.approximation.profile_parts import revolved_part
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder, Revolution
from partwright.fields.profile import Profile
from partwright.shapes.topology import components
from partwright.superfrusta.feature_mouths import ASIDE, PARALLEL, Distance, around

Floats = NDArray[np.float64]
Wall = list[tuple[float, float]]
"""Distances from an axis and heights along it, from the lower end to the upper."""

_STEP = 2e-3  # unit lengths, by which radii differ where there is a step
_WIDEST = 3.0  # times the narrower radius: a pocket with a hole in its floor is wider than a counterbore
_INNER = 0.1  # unit lengths: how far sections reach across the axis: no side of theirs is on it
_OVER = Similarity(rotation=(0.0, 1.0, 0.0, 0.0))  # half a turn about x
_EXACT = 1e-6  # unit lengths: what is nearer is the same
_LEVELS = (0.1, 0.3, 0.5, 0.7, 0.9)  # of what is looked at along an axis
_ACROSS = (0.1, 0.9)  # of the width of a step, at which it is looked at


@dataclass(frozen=True)
class _Bore:
    """A copy of a hole: the number of the hole, that of the copy, and the copy."""

    hole: int
    copy: int
    part: Part

    @cached_property
    def axis(self) -> Floats:
        return np.asarray(rotation_matrix(self.part.rotation)[:, 2])

    @cached_property
    def wall(self) -> Wall:
        """Along its own axis, from its own origin."""
        field = self.part.field
        if isinstance(field, Cylinder):
            return [(field.radius, -field.height / 2), (field.radius, field.height / 2)]
        assert isinstance(field, Revolution)
        return _upwards([(r, z) for r, z, _ in field.profile.outline])

    def seen_from(self, lead: _Bore) -> Wall:
        """The wall along the axis of another on it, from that one's origin."""
        offset = float(np.subtract(self.part.translation, lead.part.translation) @ lead.axis)
        if self.axis @ lead.axis > 0:
            return [(r, offset + z) for r, z in self.wall]
        return [(r, offset - z) for r, z in reversed(self.wall)]

    def goes_on_in(self, other: _Bore) -> bool:
        """Whether another whose middle is on its axis overlaps it, one wider than the other, as a counterbore
        may be."""
        if abs(float(self.axis @ other.axis)) < 1 - PARALLEL:
            return False
        (narrow, low, high), (wide, bottom, top) = sorted(_extent(b.seen_from(self)) for b in (self, other))
        return wide - narrow > _STEP and wide < _WIDEST * narrow and max(low, bottom) < min(high, top)


@dataclass
class _Stepped:
    """Copies of one turned hole. wall: as the first lead sees it; leads: of each copy the first of its cuts,
    and whether that sees it upside down; bores: all cuts."""

    wall: Wall
    leads: list[tuple[_Bore, bool]]
    bores: list[_Bore]

    @property
    def hole(self) -> int:
        """The number of the one whose copies the leads are."""
        return self.leads[0][0].hole

    def joined(self, wall: Wall, bores: list[_Bore]) -> bool:
        """Whether others are one more copy; then they are so from now on. wall: as their first sees it."""
        for seen, over in ((wall, False), (_flipped(wall), True)):
            alike = bores[0].hole == self.hole and len(seen) == len(self.wall)
            if alike and np.allclose(seen, self.wall, rtol=0, atol=ASIDE):
                self.leads.append((bores[0], over))
                self.bores += bores
                return True
        return False

    def part(self, hole: Part) -> Part:
        """hole: the one whose copies the leads are."""
        first = self.leads[0][0]
        frame, pose = rotation_matrix(first.part.rotation), first.part.pose
        x, y, z = (frame.T @ np.array(first.part.translation)).tolist()
        profile = Profile.polygon([(0.0, self.wall[0][1]), *self.wall, (0.0, self.wall[-1][1])])
        whole = revolved_part(profile.moved((0.0, z)), frame, np.array([x, y, 0.0]))
        turned = pose @ _OVER @ pose.inverse()
        moves = _moves(hole, [bore.copy for bore, _ in self.leads])
        upside_down = (over for _, over in self.leads[1:])
        instances = (move @ turned if over else move for move, over in zip(moves, upside_down, strict=True))
        return replace(whole, instances=tuple(instances))


def with_stepped_holes(holes: Sequence[Part], empty: Distance) -> list[Part]:
    """Drilled holes, cylinders or turned, each with its copies, in which there is nothing of the shape: those
    that are drilled into one another, from either end, as one. What is wider within than at its ends stays
    as it is, and so do holes that would be more than they are.

    empty: distance (N,) of the shape at points (N, 3), unit lengths like the holes.
    """
    bores = [_Bore(k, i, copy) for k, hole in enumerate(holes) for i, copy in enumerate(hole.copies)]
    found: list[_Stepped] = []
    for stack in _stacks(bores):
        wall = _drilled(stack, empty)
        if wall is not None and not any(other.joined(wall, stack) for other in found):
            found.append(_Stepped(wall, [(stack[0], False)], stack))
    pairs = np.array([(one.hole, bore.hole) for one in found for bore in one.bores], int)
    family = components(len(holes), *pairs.reshape(-1, 2).T)
    result: list[Part] = []
    for label in dict.fromkeys(family.tolist()):
        own = np.flatnonzero(family == label).tolist()
        stepped = [one for one in found if one.hole in own]
        taken = {(bore.hole, bore.copy) for one in stepped for bore in one.bores}
        left = (part for k in own for part in _without(holes[k], [i for hole, i in taken if hole == k]))
        made = [*(one.part(holes[one.hole]) for one in stepped), *left]
        result += made if len(made) <= len(own) else [holes[k] for k in own]
    return result


def _stacks(bores: Sequence[_Bore]) -> Iterator[list[_Bore]]:
    """Those that go on in one another, more than one."""
    hole = np.array([bore.hole for bore in bores], int)
    places = np.array([bore.part.translation for bore in bores]).reshape(-1, 3)
    pairs: list[tuple[int, int]] = []
    for i, bore in enumerate(bores):
        ways = places - places[i]
        aside = np.linalg.norm(ways - np.outer(ways @ bore.axis, bore.axis), axis=1)
        near = np.flatnonzero((hole > bore.hole) & (aside < ASIDE)).tolist()
        pairs += [(i, j) for j in near if bore.goes_on_in(bores[j])]
    label = components(len(bores), *np.array(pairs, int).reshape(-1, 2).T)
    for k in dict.fromkeys(label.tolist()):
        stack = [bores[i] for i in np.flatnonzero(label == k).tolist()]
        if len(stack) > 1:
            yield stack


def _drilled(stack: Sequence[_Bore], empty: Distance) -> Wall | None:
    """The wall of them all, as the first sees it; None where it is wider within than towards an end."""
    lead = stack[0]
    walls = [bore.seen_from(lead) for bore in stack]
    sections = [[(-_INNER, wall[0][1]), *wall, (-_INNER, wall[-1][1])] for wall in walls]
    outline = CrossSection(sections, FillRule.NonZero).simplify(_EXACT).to_polygons()[0]
    known = np.concatenate(walls)
    wall = _upwards([(_snapped(r, known[:, 0]), _snapped(z, known[:, 1])) for r, z in outline.tolist()])
    wall = _without_open_end(lead.part, 1.0, wall, empty)
    wall = _flipped(_without_open_end(lead.part, -1.0, _flipped(wall), empty))
    radii = np.array([r for r, _ in wall])
    narrowest = int(radii.argmin())
    down, up = np.diff(radii[: narrowest + 1]), np.diff(radii[narrowest:])
    return wall if (down < ASIDE).all() and (up > -ASIDE).all() else None


def _without_open_end(copy: Part, side: float, wall: Wall, empty: Distance) -> Wall:
    """The wall as it is seen towards one side, without what goes on narrower there in the open."""
    while len(wall) > 3 and wall[-1][0] < wall[-3][0] and wall[-2][1] - wall[-3][1] < ASIDE:
        (wide, low), _, (narrow, high) = wall[-3:]
        rings = [
            (narrow + share * (wide - narrow), low + level * (high - low))
            for share in _ACROSS
            for level in _LEVELS
        ]
        if not bool((empty(around(copy, side, rings)) > 0).all()):
            break
        wall = wall[:-2]
    return wall


def _upwards(loop: Wall) -> Wall:
    """The corners of a section that lie off the axis, from the lower end on."""
    on_axis = [k for k, (r, _) in enumerate(loop) if r < ASIDE]
    last = next(k for k in on_axis if (k + 1) % len(loop) not in on_axis)
    turned = [*loop[last + 1 :], *loop[: last + 1]]
    wall = [corner for corner in turned if corner[0] >= ASIDE]
    return wall if wall[0][1] < wall[-1][1] else wall[::-1]


def _snapped(value: float, known: Floats) -> float:
    """The one of known numbers (N,) that it is but for single precision, or the value."""
    nearest = float(known[np.abs(known - value).argmin()])
    return nearest if abs(nearest - value) < _EXACT else value


def _flipped(wall: Wall) -> Wall:
    return [(r, -z) for r, z in reversed(wall)]


def _extent(wall: Wall) -> tuple[float, float, float]:
    """The largest radius, and from where to where."""
    return max(r for r, _ in wall), wall[0][1], wall[-1][1]


def _moves(hole: Part, copies: Sequence[int]) -> tuple[Similarity, ...]:
    """That take the first of some copies of a hole to the others."""
    moves = (Similarity(), *hole.instances)
    back = moves[copies[0]].inverse()
    return tuple(moves[k] @ back for k in copies[1:])


def _without(hole: Part, gone: Collection[int]) -> Iterator[Part]:
    """The hole with its other copies, if there are any."""
    left = [k for k in range(len(hole.copies)) if k not in gone]
    if left:
        yield replace(hole.copies[left[0]], instances=_moves(hole, left)) if gone else hole
