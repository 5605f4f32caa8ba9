"""What MJCF leaves unsaid: classes of defaults, and the many ways to say an orientation."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from partwright.assembly.similarity import rotation_matrix
from partwright.errors import RobotError
from partwright.robots.model import frame

MAIN = "main"


@dataclass(frozen=True)
class Compiler:
    """What the <compiler> elements say that matters here, the last word of each."""

    meshdir: str = ""
    texturedir: str = ""
    degrees: bool = True
    eulerseq: str = "xyz"
    strippath: bool = False
    inertia_from_geoms: bool = False

    @classmethod
    def of(cls, elements: Iterable[Any]) -> Compiler:
        said: dict[str, str] = {}
        for element in elements:
            said |= dict(element.attrib)
        both = said.get("assetdir", "")
        return cls(
            said.get("meshdir", both),
            said.get("texturedir", both),
            said.get("angle", "degree") == "degree",
            said.get("eulerseq", "xyz"),
            said.get("strippath") == "true",
            said.get("inertiafromgeom") == "true",
        )


class Defaults:
    """Attributes that elements get from their class."""

    def __init__(self, elements: Iterable[Any]) -> None:
        self._of: dict[tuple[str, str], dict[str, str]] = {}
        for element in elements:
            self._add(element, None)

    def attributes(self, element: Any, inherited: str | None) -> dict[str, str]:
        """All attributes of an element, its own first. inherited: the childclass that it is in, if any."""
        name = element.get("class") or inherited or MAIN
        return {**self._of.get((name, element.tag), self._of.get((MAIN, element.tag), {})), **element.attrib}

    def _add(self, default: Any, parent: str | None) -> None:
        name = default.get("class") or MAIN
        for tag in ("geom", "mesh"):
            above = self._of.get((parent, tag), {}) if parent else self._of.get((name, tag), {})
            own = default.find(tag)
            self._of[name, tag] = {**above, **(dict(own.attrib) if own is not None else {})}
        for child in default.findall("default"):
            self._add(child, name)


def values(said: Mapping[str, str], key: str, default: Sequence[float], where: str) -> np.ndarray:
    """The finite numbers of an attribute.

    Raises:
        RobotError: they are none, or too few.
    """
    text = said.get(key)
    if text is None:
        return np.array(default, float)
    try:
        found = np.array([float(word) for word in text.split()])
    except ValueError:
        found = np.array([np.nan])
    if not np.isfinite(found).all() or len(found) < len(default):
        raise RobotError(f"{where}: {key}: expected {len(default)} numbers, got {text!r}")
    return found


def pose_of(said: Mapping[str, str], compiler: Compiler, where: str) -> np.ndarray:
    """(4, 4) of pos and whichever orientation is said."""
    place = values(said, "pos", (0, 0, 0), where)[:3]
    return frame(_rotation(said, compiler, where), place)


def geom_pose(said: Mapping[str, str], compiler: Compiler, where: str) -> np.ndarray:
    """(4, 4) of a geom: by its two ends, z from one to the other, where it says them."""
    if "fromto" not in said:
        return pose_of(said, compiler, where)
    ends = values(said, "fromto", (0,) * 6, where)[:6].reshape(2, 3)
    return frame(_along(ends[1] - ends[0], where), ends.mean(axis=0))


def span(said: Mapping[str, str], where: str) -> float:
    """Distance of the two ends of a geom."""
    ends = values(said, "fromto", (0,) * 6, where)[:6].reshape(2, 3)
    return float(np.linalg.norm(ends[1] - ends[0]))


def _rotation(said: Mapping[str, str], compiler: Compiler, where: str) -> np.ndarray:
    unit = np.pi / 180 if compiler.degrees else 1.0
    if "quat" in said:
        return _quaternion(values(said, "quat", (1, 0, 0, 0), where), where)
    if "axisangle" in said:
        four = values(said, "axisangle", (0, 0, 1, 0), where)
        return _about(four[:3], unit * float(four[3]), where)
    if "euler" in said:
        result = np.eye(3)
        for letter, angle in zip(compiler.eulerseq, values(said, "euler", (0, 0, 0), where), strict=False):
            turn = _about(np.eye(3)["xyz".index(letter.lower())], unit * angle, where)
            result = result @ turn if letter.islower() else turn @ result
        return result
    if "xyaxes" in said:
        x, y = values(said, "xyaxes", (1, 0, 0, 0, 1, 0), where)[:6].reshape(2, 3)
        x = x / np.linalg.norm(x)
        y = y - (x @ y) * x
        y = y / np.linalg.norm(y)
        return np.column_stack([x, y, np.cross(x, y)])
    if "zaxis" in said:
        return _along(values(said, "zaxis", (0, 0, 1), where)[:3], where)
    return np.eye(3)


def _along(z: np.ndarray, where: str) -> np.ndarray:
    """(3, 3) that turns the z axis to a direction, the shortest way."""
    if not np.linalg.norm(z) > 0:
        raise RobotError(f"{where}: an axis without length")
    z = z / np.linalg.norm(z)
    axis = np.cross((0, 0, 1), z)
    if np.linalg.norm(axis) < 1e-12:
        return np.eye(3) if z[2] >= 0 else np.diag([1.0, -1.0, -1.0])
    return _about(axis, float(np.arctan2(np.linalg.norm(axis), z[2])), where)


def _about(axis: np.ndarray, angle: float, where: str) -> np.ndarray:
    length = float(np.linalg.norm(axis))
    if length == 0:
        raise RobotError(f"{where}: an axis without length")
    half = angle / 2
    return _quaternion(np.array([np.cos(half), *(np.sin(half) * axis / length)]), where)


def _quaternion(quaternion: np.ndarray, where: str) -> np.ndarray:
    w, x, y, z = quaternion[:4].tolist()
    length = float(np.linalg.norm([w, x, y, z]))
    if length == 0:
        raise RobotError(f"{where}: a quaternion without length")
    return rotation_matrix((w / length, x / length, y / length, z / length))


def mesh_matrix(said: Mapping[str, str], where: str) -> np.ndarray:
    """(4, 4) from a mesh file's coordinates to those of the asset: moved, turned, then scaled."""
    turn = _quaternion(values(said, "refquat", (1, 0, 0, 0), where), where).T
    scale = values(said, "scale", (1, 1, 1), where)[:3]
    back = frame(np.eye(3), -values(said, "refpos", (0, 0, 0), where)[:3])
    return frame(np.diag(scale) @ turn, (0, 0, 0)) @ back


def kept_path(text: str) -> str:
    """A path within the new folder: without steps up."""
    parts = Path(text).parts
    return "/".join(part for part in parts if part not in ("..", ".", "/"))
