"""Collision elements of URDF and SDFormat that are solids already."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from partwright.approximation.ellipsoid import Ellipsoid
from partwright.assembly import Part, Similarity
from partwright.errors import RobotError
from partwright.fields import Box, Capsule, Cylinder, Field, Sphere
from partwright.robots.xml_files import three

Read = Callable[[Any, str], str | None]
"""The text of an element's property of that name: URDF has attributes, SDFormat has children."""


def native_solids(
    collision: Any, place: np.ndarray, read: Read, kinds: tuple[type[Field], ...], where: str, path: Path
) -> list[Part]:
    """The solid of a collision element that is one, at its place (4, 4); one that the format lacks, which is
    told by `kinds`, stays in the file and is not measured.

    Raises:
        RobotError: a size is missing, or no length.
    """
    fields: list[Field] = []
    for element in collision.iterfind("geometry/*"):
        match element.tag:
            case "box":
                x, y, z = three(read(element, "size") or "", path, where)
                fields.append(Box((x, y, z)))
            case "ellipsoid" if Ellipsoid in kinds:
                x, y, z = three(read(element, "radii") or "", path, where)
                fields.append(Ellipsoid((x, y, z)))
            case "sphere":
                fields.append(Sphere(_length(read(element, "radius"), "radius", path, where)))
            case "cylinder" | "capsule":
                kind = Cylinder if element.tag == "cylinder" else Capsule
                fields.append(
                    kind(*(_length(read(element, k), k, path, where) for k in ("radius", "length")))
                )
    pose = Similarity.from_matrix(place)
    return [Part(field, pose.translation, pose.rotation) for field in fields]


def _length(text: str | None, key: str, path: Path, where: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or value <= 0:
        raise RobotError(f"{path}: {where}: {key} is {text!r}, expected a length")
    return value
