"""The extrusion: a profile moved along z, with straight or leaning walls and sharp, rounded or cut rims."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.base import LARGEST, checked, normalise, number
from partwright.fields.operations import library
from partwright.fields.profile import Profile
from partwright.fields.profile_collapses import Stage, section, stages
from partwright.fields.profile_distance import profile_distance, profile_gradients
from partwright.fields.profile_offset import Wall, offset
from partwright.fields.rims import Rim
from partwright.fields.swept import Swept, SweptGradients

_STEEPEST = 89.0
_TINY = 1e-30
_VANISHING = 1e-6  # of a rim's depth: what may be left of a side there, a corner as round as the rim
RIMS = ("bottom_fillet", "top_fillet", "bottom_chamfer", "top_chamfer")
"""The numbers of rims, in the order of `gradients`."""


@dataclass(frozen=True)
class Extrusion(Swept):
    """The profile from z = -height/2 to z = height/2.

    taper: degrees by which walls lean inwards on their way up (the draft of a mould). At a height h above the
    bottom lies what is at least h tan(taper) deep within the profile, so lines become planes, arcs cones, and
    corners that point inwards are rounded. Every side has to reach the top.

    bottom_fillet, top_fillet: radius by which the edges of that end are rounded, those of holes as well.
    bottom_chamfer, top_chamfer: lengths by which they are cut off at 45 degrees instead. Rims need upright
    walls, and what lies so deep within the profile in one piece; sides that vanish on the way there, corners
    less round than the rim is deep, end on it, and what is beside them meets in a mitre.

    Without taper and rims the distance is exact. With them it is wherever the nearest point lies on a wall
    that the nearest side of the profile makes, and beyond the edges between such walls, outside of corners
    that are sharp, it never exceeds the true one.

    Raises:
        ParameterError: the height is not positive, the taper is not from 0 to 89 degrees, or too much for the
            profile; rims are more than the height or than the profile has room for, an end has two, or a
            leaning wall has one.
    """

    kind: ClassVar[str] = "extrusion"
    profile: Profile
    height: float
    taper: float = 0.0
    bottom_fillet: float = 0.0
    top_fillet: float = 0.0
    bottom_chamfer: float = 0.0
    top_chamfer: float = 0.0

    def __post_init__(self) -> None:
        self._check_profile()
        normalise(self, height=number(self, "height", 0.0, LARGEST, above=True))
        normalise(self, taper=number(self, "taper", 0.0, _STEEPEST))
        for name in RIMS:
            normalise(self, **{name: number(self, name, 0.0, LARGEST)})
        if self.taper:
            _ = self.top
        self._check_rims()

    def _check_rims(self) -> None:
        if not self.has_rims:
            return
        if any(rim.fillet and rim.chamfer for rim in self.rims):
            raise ParameterError(f"{self.kind}: an end has a fillet and a chamfer; expected one of them")
        if self.taper:
            raise ParameterError(
                f"{self.kind}: a taper and rims; expected upright walls under a fillet or chamfer"
            )
        total = sum(rim.depth for rim in self.rims)
        if total > self.height * (1 + 1e-9):
            raise ParameterError(f"{self.kind}: rims take {total:.6g} of a height of {self.height:.6g}")
        for depth in (*(depth for depth in self.collapses if depth < self.deepest), self.deepest):
            _ = self.within(depth)  # on the way, too, where nothing may fall apart that meshes have to pass

    @property
    def has_rims(self) -> bool:
        """Whether any is not sharp."""
        return any(getattr(self, name) for name in RIMS)

    @property
    def rims(self) -> tuple[Rim, Rim]:
        """Of the bottom and of the top."""
        return Rim(self.bottom_fillet, self.bottom_chamfer), Rim(self.top_fillet, self.top_chamfer)

    @property
    def rounds_inner_corners(self) -> bool:
        """Whether the profile has corners that turn inwards: leaning walls and rims run in an arc about them.

        CAD programs let them meet there in a mitre."""
        walls = self.walls if self.taper else self.within(self.deepest)[1]
        return any(wall.below is None for loop in walls for wall in loop)

    @property
    def deepest(self) -> float:
        """How deep its rims go."""
        return max(rim.depth for rim in self.rims)

    @property
    def collapses(self) -> list[float]:
        """Depths along its rims right before and right after sides of the profile vanish."""
        depths: list[float] = []
        for stage in self._stages[1:]:
            if not depths or stage.depth > depths[-1]:
                depths += [stage.depth, stage.depth * (1 + 3 * _VANISHING)]
        return depths

    @cached_property
    def _stages(self) -> list[Stage]:
        return stages(self.profile, self.deepest * (1 - _VANISHING))

    def within(self, depth: float) -> tuple[Profile, list[list[Wall]]]:
        """The section that lies so deep, at most as deep as a rim goes, within the profile, and how its sides
        grow out of the profile's: those that have vanished end in a point."""
        if depth <= 0:
            return self.profile, []
        known: dict[float, tuple[Profile, list[list[Wall]]]] = self.__dict__.setdefault("_sections", {})
        if depth not in known:
            known[depth] = section(self.profile, self._stages, depth * (1 - _VANISHING))
        return known[depth]

    @cached_property
    def top(self) -> Profile:
        """The cross-section at z = height/2."""
        return self._walls[0]

    @property
    def walls(self) -> list[list[Wall]]:
        """How the top's sides grow out of the profile's, loop by loop; only with a taper."""
        return self._walls[1]

    @cached_property
    def _walls(self) -> tuple[Profile, list[list[Wall]]]:
        if not self.taper:
            return self.profile, []
        return offset(self.profile, self.height * math.tan(math.radians(self.taper)))

    @property
    def wall(self) -> float:
        return self.height

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        directions = np.asarray(directions, dtype=np.float64)
        half = self.height / 2
        levels = [(self.profile, -half), (self.top, half)]
        if self.has_rims:
            corners = [
                (depth, sign * (half - off))
                for rim, sign in zip(self.rims, (-1, 1), strict=True)
                for depth, off in rim.around()
            ]
            levels = [(self.within(depth)[0], z) for depth, z in corners]
        reach = [profile.support(directions[:, :2]) + z * directions[:, 2] for profile, z in levels]
        return np.asarray(np.maximum.reduce(reach) + level)

    def scaled(self, factor: float) -> Extrusion:
        factor = checked(f"{self.kind}: scale factor", factor, 0.0, LARGEST, above=True)
        rims = {name: factor * getattr(self, name) for name in RIMS}
        return Extrusion(self.profile.scaled(factor), factor * self.height, self.taper, **rims)

    def to_dict(self) -> dict[str, Any]:
        given = super().to_dict()
        return {name: value for name, value in given.items() if name not in RIMS or value}

    def _distance(self, points: Any) -> Any:
        q, z = profile_distance(self.profile, points[:, :2]), points[:, 2]
        if not self.has_rims:
            return self._folded(q, z + self.height / 2)
        bottom, top = self.rims
        below, above = -z - self.height / 2, z - self.height / 2
        return library(q).maximum(bottom.distance(q, below), top.distance(q, above))

    def _folded(self, q: Any, z: Any) -> Any:
        """From the distances to the profile and heights above the bottom, both (N,): to the quad between the
        wall from (0, 0) to (-lean, height) and the two ends."""
        xp, (sine, cosine, lean, slant) = library(q), self._wall
        wall = q * cosine + z * sine
        along = z * cosine - q * sine
        inside = xp.maximum(wall, xp.maximum(-z, z - self.height))
        low = xp.sqrt(xp.clip(q, 0.0, None) ** 2 + z * z + _TINY)
        high = xp.sqrt(xp.clip(q + lean, 0.0, None) ** 2 + (z - self.height) ** 2 + _TINY)
        outside = xp.where(along < 0, low, xp.where(along > slant, high, wall))
        outside = xp.where((z <= 0) & (q <= 0), -z, outside)
        outside = xp.where((z >= self.height) & (q <= -lean), z - self.height, outside)
        return xp.where(inside <= 0, inside, outside)

    @property
    def _wall(self) -> tuple[float, float, float, float]:
        """Sine and cosine of the taper, how far in the top lies, and the wall's length."""
        angle = math.radians(self.taper)
        lean = self.height * math.tan(angle)
        return math.sin(angle), math.cos(angle), lean, math.hypot(lean, self.height)

    def gradients(self, points: np.ndarray, upstream: np.ndarray) -> SweptGradients:
        points, upstream = np.asarray(points, np.float64), np.asarray(upstream, np.float64)
        q, z = profile_distance(self.profile, points[:, :2]), points[:, 2] + self.height / 2
        if self.has_rims:
            by_q, *by_numbers = self._rim_slopes(q, z)
        else:
            by_q, by_height, by_angle = self._slopes(q, z)
            by_numbers = [by_height, by_angle * math.pi / 180, *np.zeros((4, len(q)))]
        corners, _ = profile_gradients(self.profile, points[:, :2], upstream * by_q)
        return SweptGradients(corners, np.array([upstream @ one for one in by_numbers]))

    def _rim_slopes(self, q: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, ...]:
        """Of the distance by q, the height, the taper (none) and each of `RIMS`."""
        ends = list(zip(self.rims, (-z, z - self.height), strict=True))
        bottom, top = (rim.distance(q, v) for rim, v in ends)
        nearest = (bottom >= top, bottom < top)
        by_q, by_height, none = np.zeros((3, len(q)))
        own = dict.fromkeys(RIMS, none)
        for (rim, v), mine, end in zip(ends, nearest, ("bottom", "top"), strict=True):
            by_u, by_v, by_own = rim.slopes(q, v)
            by_q = np.where(mine, by_u, by_q)
            by_height = np.where(mine, -by_v / 2, by_height)
            if rim.depth:
                own[f"{end}_{'fillet' if rim.fillet else 'chamfer'}"] = np.where(mine, by_own, 0.0)
        return by_q, by_height, none, *own.values()

    def _slopes(self, q: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the distance by q, by the height (which moves both ends apart), and by the taper's angle."""
        (sine, cosine, lean, slant), height = self._wall, self.height
        wall, along = q * cosine + z * sine, z * cosine - q * sine
        inside = np.maximum.reduce([wall, -z, z - height]) <= 0
        ends = np.maximum(-z, z - height)
        flat = np.where(inside, ends > wall, ((z <= 0) & (q <= 0)) | ((z >= height) & (q <= -lean)))
        low = ~inside & ~flat & (along < 0)
        high = ~inside & ~flat & (along > slant)
        by_q = np.where(flat, 0.0, cosine)
        by_height = np.where(flat, -0.5, sine / 2)
        by_angle = np.where(flat, 0.0, z * cosine - q * sine)
        over, up = q + lean, z - height
        below, above = (np.maximum(np.hypot(*pair), _TINY) for pair in ((q, z), (over, up)))
        by_q = np.where(low, q / below, np.where(high, over / above, by_q))
        tangent = lean / height
        rim = (over * tangent - up / 2) / above
        by_height = np.where(low, z / (2 * below), np.where(high, rim, by_height))
        by_angle = np.where(low, 0.0, np.where(high, over * height / cosine**2 / above, by_angle))
        return by_q, by_height, by_angle
