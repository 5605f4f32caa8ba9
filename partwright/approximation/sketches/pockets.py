"""A wall all around and a floor that closes it: what a person draws as a solid with a pocket."""

from __future__ import annotations

import dataclasses

import numpy as np

from partwright.approximation.profile_parts import extruded_part
from partwright.approximation.sketches.holes import hole_parts
from partwright.assembly import Part
from partwright.assembly.similarity import rotation_matrix
from partwright.fields import Box, Cylinder, Extrusion
from partwright.fields.profile import Loop, Profile, circle
from partwright.fields.profile_distance import profile_distance

_FLUSH = 3e-3  # unit lengths: how far ends, and outlines, that are one may lie apart
_PARALLEL = 1e-6  # of a cosine
_LATTICE = 20
_THICKEST = 0.9  # of the wall's height, that the floor has


def as_pocket(wall: Part, floor: Part) -> tuple[Part, tuple[Part, ...], tuple[Part, ...]] | None:
    """The wall without the holes that the floor closes at one end, the pockets that are left of these, and
    the floor's own holes. None where the floor closes none, or reaches beyond the wall.

    Lengths in the unit frame.
    """
    field, lid = wall.field, _upright(floor)
    if not isinstance(field, Extrusion) or field.taper or field.has_rims or wall.instances or lid is None:
        return None
    frame, other = rotation_matrix(wall.rotation), rotation_matrix(floor.rotation)
    if abs(float(frame[:, 2] @ other[:, 2])) < 1 - _PARALLEL or lid.height > _THICKEST * field.height:
        return None
    at = float(frame[:, 2] @ np.subtract(floor.translation, wall.translation))
    low, high, half = at - lid.height / 2, at + lid.height / 2, field.height / 2
    if abs(low + half) < _FLUSH:
        left = (high, half)
    elif abs(high - half) < _FLUSH:
        left = (-half, low)
    else:
        return None

    def onto_floor(flat: np.ndarray) -> np.ndarray:
        """(N,) of the floor's outline at points of the wall's plane (N, 2)."""
        points = np.column_stack([flat, np.full(len(flat), at)]) @ frame.T + wall.translation
        local = (points - floor.translation) @ other
        return np.asarray(profile_distance(Profile(lid.profile.outline), local[:, :2]))

    def onto_wall(flat: np.ndarray) -> np.ndarray:
        points = np.column_stack([flat, np.zeros(len(flat))]) @ other.T + floor.translation
        local = (points - wall.translation) @ frame
        return np.asarray(profile_distance(Profile(field.profile.outline), local[:, :2]))

    edge = np.concatenate(Profile(lid.profile.outline).polylines(1e-2))
    closed = [loop for loop in field.profile.holes if (onto_floor(_within(loop)) < _FLUSH).all()]
    if not closed or (onto_wall(edge) > _FLUSH).any():
        return None
    rest = tuple(loop for loop in field.profile.holes if loop not in closed)
    middle = frame.T @ np.array(wall.translation)

    def extruded(profile: Profile, ends: tuple[float, float]) -> Part:
        return extruded_part(profile.moved(middle[:2]), frame, middle[2] + ends[0], middle[2] + ends[1])

    body = extruded(Profile(field.profile.outline, rest), (-half, half))
    pockets = tuple(extruded(Profile(loop), left) for loop in closed)
    holes = hole_parts(dataclasses.replace(floor, field=lid)) if lid.profile.holes else ()
    return dataclasses.replace(body, name=wall.name), pockets, holes


def _upright(part: Part) -> Extrusion | None:
    field = part.field
    if part.instances:
        return None
    if isinstance(field, Box):
        return Extrusion(Profile.rectangle(*field.size[:2]), field.size[2])
    if isinstance(field, Cylinder):
        return Extrusion(Profile(circle(field.radius)), field.height)
    return field if isinstance(field, Extrusion) and not field.taper and not field.has_rims else None


def _within(loop: Loop) -> np.ndarray:
    """(N, 2) points in it."""
    profile = Profile(loop)
    low, high = profile.bounds()
    steps = (np.arange(_LATTICE) + 0.5) / _LATTICE
    grid = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    flat = low + grid * (high - low)
    return np.asarray(flat[profile_distance(profile, flat) < 0])
