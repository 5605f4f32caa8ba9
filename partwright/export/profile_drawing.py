"""The profiles of an assembly, side by side as on a sheet: what the drawings, SVG and DXF, hold."""

from __future__ import annotations

from typing import NamedTuple

from partwright.assembly import Assembly
from partwright.errors import UnsupportedFormatError
from partwright.fields import Box, Cylinder, Field, HollowBox, Profile, Swept, Tube
from partwright.fields.profile import circle

_GAP = 0.1  # between neighbours, of the larger one's width


class Drawn(NamedTuple):
    """A profile, where it lies on the sheet, and the part whose it is."""

    name: str
    profile: Profile


def profile_of(field: Field) -> Profile | None:
    """What the field is swept of: its own profile, or the cross-section of a box, cylinder or tube."""
    if isinstance(field, Swept):
        return field.profile
    if isinstance(field, Cylinder):
        return Profile.circle(field.radius)
    if isinstance(field, Tube):
        return Profile(circle(field.radius), (circle(field.radius - field.thickness),))
    if isinstance(field, Box | HollowBox) and min(field.size[:2]) > 0:
        outer = Profile.rectangle(*field.size[:2])
        if isinstance(field, Box):
            return outer
        inner = (side - 2 * field.thickness for side in field.size[:2])
        return Profile(outer.outline, (Profile.rectangle(*inner).outline,))
    return None


def drawn_profiles(assembly: Assembly, form: str) -> list[Drawn]:
    """A profile a part that has one, repeated parts once: the first at its own coordinates, each next one to
    the right of those before it. form: what errors call the format.

    Raises:
        UnsupportedFormatError: no part has one.
    """
    found = [(part.name, profile_of(part.field)) for part in assembly.parts]
    drawn: list[Drawn] = []
    for name, profile in found:
        if profile is None:
            continue
        placed = profile
        if drawn:
            (low, _), (high, _) = profile.bounds()
            edge, before = drawn[-1].profile.bounds()[1][0], drawn[-1].profile.bounds()[0][0]
            gap = _GAP * max(high - low, edge - before)
            placed = profile.moved((float(edge + gap - low), 0.0))
        drawn.append(Drawn(name, placed))
    if not drawn:
        kinds = "extrusions, revolutions, boxes, cylinders and tubes"
        raise UnsupportedFormatError(f"{form} holds profiles, those of {kinds}, and no part is one of them")
    return drawn
