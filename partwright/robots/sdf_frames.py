"""Frames of SDFormat: what the poses of a model's links, joints and nested models are relative to."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from partwright.errors import RobotError
from partwright.robots.model import frame, from_roll_pitch_yaw
from partwright.robots.xml_files import three

_OWN = ("__model__", "world", "__root__")  # of the model itself, or the world
_WITH_FRAMES = ("link", "joint", "frame", "model")


class SdfFrames:
    """Resolves `relative_to`, as of SDFormat 1.7: a name of the same model, of a nested one as MODEL::NAME.

    Without it a link or nested model is placed in its model, a joint in its child link, a frame in what it is
    attached to.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._found: dict[Any, np.ndarray] = {}
        self._asked: list[Any] = []

    def placed(self, element: Any) -> np.ndarray:
        """(4, 4) of a link, joint, frame or model in the model, or world, that it is in.

        Raises:
            RobotError: its pose is no six numbers, or relative to what is not there, or to itself.
        """
        if element not in self._found:
            if element in self._asked:
                raise RobotError(f"{self._path}: the pose of {element.get('name')!r} is relative to itself")
            self._asked.append(element)
            self._found[element] = self._placed(element)
            self._asked.pop()
        return self._found[element]

    def within(self, element: Any, link: Any) -> np.ndarray:
        """(4, 4) of a collision or visual in the link that it is in."""
        pose, other = self._own(element, link.get("name"))
        if not other:
            return pose
        return np.linalg.inv(self.placed(link)) @ self._named(link.getparent(), other, link) @ pose

    def _placed(self, element: Any) -> np.ndarray:
        pose, other = self._own(element, element.get("name"))
        scope = element.getparent()
        if not other and element.tag == "joint":
            other = element.findtext("child", "").strip()
        if not other and element.tag == "frame":
            other = element.get("attached_to")
        if other:
            pose = self._named(scope, other, element) @ pose
        if element.tag == "model" and element.get("placement_frame"):
            pose = pose @ np.linalg.inv(self._named(element, element.get("placement_frame"), element))
        return pose

    def _named(self, scope: Any, name: str, asking: Any) -> np.ndarray:
        """(4, 4) of what has this name, in the frame of a model or the world."""
        if name in _OWN:
            return np.eye(4)
        first, _, rest = name.partition("::")
        for child in scope:
            if child.tag in _WITH_FRAMES and child.get("name") == first:
                return self.placed(child) @ (self._named(child, rest, asking) if rest else np.eye(4))
        raise RobotError(
            f"{self._path}: {asking.get('name')!r}: its pose is relative to {name!r}, which is not there"
        )

    def _own(self, element: Any, name: str) -> tuple[np.ndarray, str | None]:
        """(4, 4) that the element says, and what it says that this is relative to."""
        pose = element.find("pose")
        if pose is None:
            return np.eye(4), None
        other = pose.get("relative_to") or pose.get("frame")
        words = (pose.text or "").split()
        if not words:
            return np.eye(4), other
        if len(words) != 6:
            raise RobotError(f"{self._path}: {name!r}: pose: expected six numbers, got {pose.text.strip()!r}")
        place = three(" ".join(words[:3]), self._path, f"{name!r}: pose")
        angles = three(" ".join(words[3:]), self._path, f"{name!r}: pose")
        if pose.get("degrees") in ("true", "1"):
            angles = np.radians(angles).tolist()
        return frame(from_roll_pitch_yaw(*angles), place), other
