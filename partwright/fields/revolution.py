"""The revolution: a profile turned about z."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.base import LARGEST, checked, normalise, number
from partwright.fields.operations import library
from partwright.fields.profile import Loop, Profile
from partwright.fields.profile_distance import profile_distance, profile_gradients
from partwright.fields.profile_growth import grown_profile
from partwright.fields.swept import Swept, SweptGradients

_TINY = 1e-30
_ON_AXIS = 1e-9  # of the profile's size


@dataclass(frozen=True)
class Revolution(Swept):
    """The profile, whose x is the distance from the axis and whose y is z, turned about z.

    angle: degrees, from the half-plane towards +x counter-clockwise; 360 all around. The profile may touch
    the axis, where it bounds nothing, and not cross it. The distance is exact.

    Raises:
        ParameterError: the profile crosses the axis, or the angle is not above 0 and at most 360.
    """

    kind: ClassVar[str] = "revolution"
    profile: Profile
    angle: float = 360.0

    def __post_init__(self) -> None:
        self._check_profile()
        normalise(self, angle=number(self, "angle", 0.0, 360.0, above=True))
        left, near = float(self.profile.bounds()[0][0]), _ON_AXIS * self.profile.size
        if left < -near:
            raise ParameterError(
                f"revolution: its profile reaches x = {left:.6g}; expected x >= 0, the distance from the axis"
            )
        if any(0 < abs(x) <= near for loop in self.profile.loops for x, _, _ in loop):
            loops = [_snapped(loop, near) for loop in self.profile.loops]
            object.__setattr__(self, "profile", Profile.of_loops(loops))

    @cached_property
    def _off_axis(self) -> np.ndarray:
        """(V,) which sides bound the solid: all but those along the axis."""
        sides = [side for loop in self.profile.sides for side in loop]
        return np.array([s.centre is not None or s.start[0] != 0 or s.end[0] != 0 for s in sides])

    def grown_profile(self, by: float) -> Profile:
        """The profile with all sides but those on the axis further out; see `profile_growth`."""
        return grown_profile(self.profile, by, still=np.flatnonzero(~self._off_axis).tolist())

    @property
    def full(self) -> bool:
        return self.angle >= 360.0

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        directions = np.asarray(directions, dtype=np.float64)
        outwards = np.linalg.norm(directions[:, :2], axis=1)
        if not self.full:
            end = math.radians(self.angle)
            towards = np.arctan2(directions[:, 1], directions[:, 0]) % (2 * math.pi)
            ends = np.maximum(directions[:, 0], directions[:, :2] @ (math.cos(end), math.sin(end)))
            outwards = np.where(towards <= end, outwards, ends)
        return np.asarray(self.profile.support(np.column_stack([outwards, directions[:, 2]])) + level)

    def scaled(self, factor: float) -> Revolution:
        factor = checked(f"{self.kind}: scale factor", factor, 0.0, LARGEST, above=True)
        return Revolution(self.profile.scaled(factor), self.angle)

    def _distance(self, points: Any) -> Any:
        xp, z = library(points), points[:, 2]
        radius = xp.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2 + _TINY)
        side = profile_distance(self.profile, xp.stack([radius, z], -1), self._off_axis)
        if self.full:
            return side
        caps = [self._cap(points, turn) for turn in (0.0, math.radians(self.angle))]
        outside = xp.minimum(caps[0], caps[1])
        inside = xp.where(side < 0, -xp.minimum(-side, outside), side)
        return xp.where(self._within(points), inside, outside)

    def _within(self, points: Any) -> Any:
        """(N,) whether points (N, 3) lie at an angle through which the profile is turned."""
        xp, end = library(points), math.radians(self.angle)
        turn = xp.arctan2(points[:, 1], points[:, 0])
        return xp.where(turn < 0, turn + 2 * math.pi, turn) <= end

    def _cap(self, points: Any, turn: float) -> Any:
        """(N,) distance, without sign, to the flat end at an angle."""
        xp = library(points)
        flat, across = self._onto(points, turn)
        beyond = xp.clip(profile_distance(self.profile, flat), 0.0, None)
        return xp.sqrt(beyond * beyond + across * across + _TINY)

    @staticmethod
    def _onto(points: Any, turn: float) -> tuple[Any, Any]:
        """Points in the plane of the flat end at an angle, (N, 2), and their distance from it (N,)."""
        xp, (x, y) = library(points), (points[:, 0], points[:, 1])
        c, s = math.cos(turn), math.sin(turn)
        return xp.stack([c * x + s * y, points[:, 2]], -1), c * y - s * x

    def gradients(self, points: np.ndarray, upstream: np.ndarray) -> SweptGradients:
        points, upstream = np.asarray(points, np.float64), np.asarray(upstream, np.float64)
        radial = np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
        if self.full:
            corners, _ = profile_gradients(self.profile, radial, upstream, self._off_axis)
            return SweptGradients(corners, np.zeros(1))
        side = profile_distance(self.profile, radial, self._off_axis)
        end, within = math.radians(self.angle), self._within(points)
        caps = np.stack([self._cap(points, turn) for turn in (0.0, end)])
        nearer = caps.argmin(axis=0)
        lateral = within & ((side >= 0) | (-side <= caps.min(axis=0)))
        corners, _ = profile_gradients(self.profile, radial, upstream * lateral, self._off_axis)
        sign, by_angle = np.where(within, -1.0, 1.0), 0.0
        for i, turn in enumerate((0.0, end)):
            flat, across = self._onto(points, turn)
            beyond = np.maximum(profile_distance(self.profile, flat), 0.0)
            weight = upstream * sign * (~lateral & (nearer == i)) / np.maximum(caps[i], _TINY)
            more, by_point = profile_gradients(self.profile, flat, weight * beyond)
            corners = corners + more
            if i:  # the plane's axes turn into one another
                slope = beyond * by_point[:, 0] * across - across * flat[:, 0]
                by_angle = float(weight @ slope) * math.pi / 180
        return SweptGradients(corners, np.array([by_angle]))


def _snapped(loop: Loop, near: float) -> Loop:
    return tuple((0.0 if abs(x) <= near else x, y, b) for x, y, b in loop)
