"""Round holes of an extrusion's profile as cylinders that are cut from it: what a person drills."""

from __future__ import annotations

import dataclasses

import numpy as np

from partwright.approximation.profile_parts import extruded_part
from partwright.assembly import Part, Similarity
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Cylinder, Extrusion
from partwright.fields.profile import Loop, circle_of

_SAME = 2e-3  # of the radius, by which holes of one size may differ
_BEYOND = 0.03  # unit lengths: how far holes reach beyond what they go through


def holes_apart(part: Part) -> tuple[Part, tuple[Part, ...]]:
    """The part without round holes in its profile, and cylinders, one for each size with a copy a hole.

    A part that is no extrusion, or tapers, stays as it is.
    """
    field = part.field
    if not isinstance(field, Extrusion) or field.taper or not field.profile.holes:
        return part, ()
    kept: list[Loop] = []
    sizes: list[tuple[float, list[tuple[float, float]]]] = []
    for loop in field.profile.holes:
        round_ = circle_of(loop)
        if round_ is None:
            kept.append(loop)
            continue
        radius, centre = round_
        same = next((s for s in sizes if abs(s[0] - radius) < _SAME * radius), None)
        if same is None:
            sizes.append((radius, [centre]))
        else:
            same[1].append(centre)
    if not sizes:
        return part, ()
    frame, height = rotation_matrix(part.rotation), field.height
    profile = dataclasses.replace(field.profile, holes=tuple(kept))
    middle = np.array(part.translation)
    level = float(middle @ frame[:, 2])
    flat = frame.T @ middle
    body = extruded_part(profile.moved(flat[:2]), frame, level - height / 2, level + height / 2)
    body = dataclasses.replace(body, instances=part.instances, name=part.name)
    holes = []
    for radius, centres in sizes:
        first, *others = (middle + frame @ (x, y, 0.0) for x, y in centres)
        own = [Similarity(translation=_vector(other - first)) for other in others]
        hole = _cylinder(radius, height + 2 * _BEYOND, part, first)
        moves = [*own, *(move @ inner for move in part.instances for inner in (Similarity(), *own))]
        holes.append(dataclasses.replace(hole, instances=tuple(moves)))
    return body, tuple(holes)


def _cylinder(radius: float, height: float, part: Part, place: np.ndarray) -> Part:
    x, y, z = place.tolist()
    return Part(Cylinder(radius, height), (x, y, z), part.rotation)


def _vector(offset: np.ndarray) -> tuple[float, float, float]:
    x, y, z = offset.tolist()
    return x, y, z
