"""Geoms of MJCF that are solids already."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.assembly import Part, Similarity
from partwright.errors import ParameterError, RobotError
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.robots.mjcf_defaults import span, values

_NONE = ("plane", "hfield", "sdf", "mesh")


def native_geom(said: Mapping[str, str], pose: np.ndarray, link: str) -> Part | None:
    """The solid of a geom with these attributes at a pose (4, 4); None for a plane, a field of heights, or
    what a mesh says.

    Raises:
        RobotError: a size is no length.
    """
    kind = said.get("type", "sphere")
    if kind in _NONE or "mesh" in said:
        return None
    try:
        field = _field(kind, _size(kind, said, f"link {link!r}: geom"))
    except ParameterError as error:
        raise RobotError(f"link {link!r}: geom: {error}") from error
    if field is None:
        return None
    place = Similarity.from_matrix(pose)
    return Part(field, place.translation, place.rotation)


def _size(kind: str, said: Mapping[str, str], where: str) -> list[float]:
    """As `size` has it without ends, which say the length instead; both sides of a box are then the first."""
    size: list[float] = values(said, "size", (), where).tolist()
    if "fromto" not in said or not size:
        return size
    half = span(said, where) / 2
    return [size[0], half] if kind in ("cylinder", "capsule") else [size[0], size[0], half]


def _field(kind: str, size: list[float]) -> Field | None:
    match kind, size:
        case "box", [x, y, z]:
            return Box((2 * x, 2 * y, 2 * z))
        case "sphere", [radius, *_]:
            return Sphere(radius)
        case "cylinder", [radius, half, *_]:
            return Cylinder(radius, 2 * half)
        case "capsule", [radius, half, *_]:
            return Capsule(radius, 2 * half)
        case "ellipsoid", [x, y, z]:
            return Ellipsoid((x, y, z))
    return None
