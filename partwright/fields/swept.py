"""What extrusions and revolutions share: solids of a profile."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.base import Array, Field
from partwright.fields.operations import is_tensor
from partwright.fields.profile import Profile


class SweptGradients(NamedTuple):
    """Derivatives of a weighted sum of distances.

    corners: (V, 3) by x, y and bulge of the profile's corners, loop after loop. numbers: by the field's own
    numbers, in order (angles in degrees).
    """

    corners: np.ndarray
    numbers: np.ndarray


class Swept(Field):
    """A profile that is moved or turned through space."""

    profile: Profile

    def __call__(self, points: Array) -> Array:
        if is_tensor(points):
            return self._distance(points)
        return self._distance(np.asarray(points, dtype=np.float64)).astype(np.float32)

    @abstractmethod
    def _distance(self, points: Any) -> Any:
        """(N,) at points (N, 3), float64 or tensors."""

    @abstractmethod
    def gradients(self, points: np.ndarray, upstream: np.ndarray) -> SweptGradients:
        """Derivatives of sum(upstream * distance) over points (N, 3), upstream (N,), by every number."""

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        reach = self.support(np.vstack([-np.eye(3), np.eye(3)]))
        return -reach[:3], reach[3:]

    @property
    def lipschitz(self) -> float:
        return 1.0

    def to_dict(self) -> dict[str, Any]:
        return super().to_dict() | {"profile": self.profile.to_dict()}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        if "profile" in data:
            data = {**data, "profile": Profile.from_dict(data["profile"])}
        return super().from_dict(data)

    def _check_profile(self) -> None:
        if not isinstance(self.profile, Profile):
            raise ParameterError(f"{self.kind}: profile is {self.profile!r:.80}; expected a Profile")
