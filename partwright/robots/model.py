"""What all robot files have in common: links with meshes, where they rest, and what may stand for a mesh."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np

if TYPE_CHECKING:
    import trimesh

    from partwright.assembly import Part
    from partwright.fields import Field


@dataclass(frozen=True, eq=False)
class MeshUse:
    """A mesh file where a link uses it.

    matrix: (4, 4) from the file's coordinates to the link's, with the scale, which may mirror. inline: the
    mesh itself, for formats that hold it. submesh: the name of what of the file is meant, where it is not
    all; centred: whether the middle of its box is first moved to the origin."""

    source: Path
    matrix: np.ndarray
    inline: trimesh.Trimesh | None = None
    submesh: str | None = None
    centred: bool = False

    @property
    def mesh(self) -> tuple[Path, str | None, bool]:
        """What it is, wherever it is placed: the same mesh for all uses for which this is."""
        return self.source, self.submesh, self.centred


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid body of a robot.

    pose: (4, 4) link to world at rest, every joint at zero. parents: the links that its joints hang on,
    several where joints close a loop, which URDF cannot hold. collisions: meshes that collide, all of which
    are replaced. visuals: meshes that are seen. natives: solids that collide already, in the link's frame;
    they stay.
    """

    name: str
    pose: np.ndarray
    parents: tuple[str, ...]
    collisions: tuple[MeshUse, ...]
    visuals: tuple[MeshUse, ...] = ()
    natives: tuple[Part, ...] = ()


@dataclass(frozen=True, eq=False)
class Shape:
    """What stands for a mesh, or a piece of it, in the link's frame: a placed native solid, or a convex
    mesh."""

    name: str
    part: Part | None = None
    mesh: trimesh.Trimesh | None = None

    @property
    def kind(self) -> str:
        return self.part.field.kind if self.part is not None else "hull"


@dataclass(frozen=True)
class Files:
    """The files of a robot, by paths relative to the folder that they go into, "/" between names.

    written: bytes of those that are new. copied: those that are as they were, from where.
    """

    written: dict[str, bytes] = field(default_factory=dict)
    copied: dict[str, Path] = field(default_factory=dict)


class RobotFile(ABC):
    """A robot as its file has it: read once, written again with other collision shapes and else unchanged."""

    kinds: ClassVar[tuple[type[Field], ...]]
    """Solids that the format has natively."""
    composed: ClassVar[tuple[type[Field], ...]] = ()
    """Those that it can say by several of its own: taken only where they are asked for by name."""
    path: Path
    links: Sequence[Link]

    @abstractmethod
    def replaced(self, shapes: Mapping[str, Sequence[Shape]]) -> Files:
        """The files of the robot with these shapes for the collision meshes of the links of these names."""


def mirrored(matrix: np.ndarray) -> bool:
    """Whether a (4, 4) turns a mesh inside out, so that its triangles must be turned round."""
    return bool(np.linalg.det(matrix[:3, :3]) < 0)


def frame(rotation: np.ndarray, translation: Sequence[float] | np.ndarray) -> np.ndarray:
    """(4, 4) of a (3, 3) and a (3,)."""
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation, translation
    return result


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """(3, 3) of angles about the fixed x, y and z axes, in that order, as URDF and SDFormat have them."""
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
