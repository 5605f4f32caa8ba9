"""Fields that depend on those beside them: learned parts, which adapt to one another."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from partwright.fields.base import Field

if TYPE_CHECKING:
    import trimesh


class Member(NamedTuple):
    """A field of the same shape and its pose, as seen from the field that is told of it: translation (3,),
    rotation a unit quaternion (w, x, y, z)."""

    field: JointField
    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


class JointField(Field):
    """One of several fields that are decoded together. An assembly tells its leaves of one another.

    members: those of its shape, in the order of the assembly, itself among them; empty for a field alone.
    """

    members: tuple[Member, ...]

    @property
    @abstractmethod
    def shape_key(self) -> object:
        """What fields share that can stand in one shape."""

    @property
    @abstractmethod
    def role(self) -> str:
        """Which part it is; a shape has each role at most once."""

    @abstractmethod
    def among(self, members: Sequence[Member], shared: dict[Any, Any]) -> Self:
        """This field as it is beside others (in the order of the assembly, itself among them).

        shared: one dictionary for them all, for what is made of the whole shape once.
        """

    @abstractmethod
    def preview(self) -> trimesh.Trimesh:
        """A mesh of its own frame that is quickly made, for a picture; of all members in one pass.

        Raises NoSurfaceError where it has none.
        """

    def whole(self, cell: float) -> trimesh.Trimesh | None:
        """The union of all members as a closed mesh of this field's own frame, in cells of this length or
        shorter where a wall is thin; None where it has no quicker way than any other field.

        Raises NoSurfaceError where nothing is left of it.
        """
        return None

    @abstractmethod
    def together(self, points: np.ndarray, fields: Sequence[JointField]) -> list[np.ndarray]:
        """Distances (N,) of several members of the same shape at points (N, 3) of this field's own frame."""
