"""The pipe: a round rod, or a tube, along a path of straight runs and bends."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property
from reprlib import repr as brief
from typing import Any, ClassVar, Self

import numpy as np

from partwright.errors import ParameterError
from partwright.fields.base import LARGEST, Array, Field, checked, normalise, number
from partwright.fields.bent_path import NEAR, Bend, Run, bent_corners, bent_path, like, with_fitting_bends
from partwright.fields.operations import is_tensor, library

Corner = tuple[float, float, float, float]

_TINY = 1e-30
_MOST_CORNERS = 500
_APART = 0.98  # of the diameter, that places of the path have to be apart which are not beside one another


@dataclass(frozen=True)
class Pipe(Field):
    """What a disc, or a ring, covers that is moved along a path and stays across it; its ends are flat.

    path: corners (x, y, z), or (x, y, z, bend): the path runs straight from one to the next and takes the
    corner in an arc of radius `bend`, as tubes are bent. The first and the last, where it ends, have none.
    Half a turn is two corners.
    radius: of the disc; every bend is wider. thickness: of the wall of a tube; 0 where it is solid.

    The distance is exact.

    Raises:
        ParameterError: fewer than two corners or more than 500; the radius is not positive; a wall is
            thicker than it; a bend is not wider than the radius, does not fit between its neighbours, or
            turns by more than 175 degrees; or the pipe runs into itself.
    """

    kind: ClassVar[str] = "pipe"
    path: tuple[Corner, ...]
    radius: float
    thickness: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", _corners(self.path))
        normalise(self, radius=number(self, "radius", 0.0, LARGEST, above=True))
        normalise(self, thickness=number(self, "thickness", 0.0, LARGEST))
        if self.thickness >= self.radius:
            raise ParameterError(
                f"pipe: thickness is {self.thickness:g}; expected less than the radius {self.radius:g}; "
                "of a solid rod it is 0"
            )
        narrow = [
            piece.radius for piece in self.pieces if isinstance(piece, Bend) and piece.radius <= self.radius
        ]
        if narrow:
            raise ParameterError(
                f"pipe: a bend is {narrow[0]:g}; expected more than the radius {self.radius:g}"
            )
        self._check_clearance()

    @property
    def corners(self) -> np.ndarray:
        """(K, 4) of x, y, z and bend."""
        return np.array(self.path)

    def with_corners(self, corners: np.ndarray, share: float = 0.0) -> Pipe:
        """Along another path: corners (K, 4) of x, y, z and bend. Bends that take more than the leg between
        them, by up to this share of it, are made to fit."""
        return dataclasses.replace(self, path=path_of(with_fitting_bends(corners, share)))

    @property
    def bent_corners(self) -> tuple[Corner, ...]:
        """Those of the path without any at which it goes straight on."""
        return tuple(map(tuple, bent_corners(self.corners).tolist()))

    @cached_property
    def pieces(self) -> tuple[Run | Bend, ...]:
        """Of the path, in order: each goes over smoothly into the next."""
        return bent_path(self.corners)

    @property
    def length(self) -> float:
        """Of the path."""
        return sum(piece.length for piece in self.pieces)

    @property
    def bore(self) -> float:
        """Radius of the hollow inside; 0 of a solid rod."""
        return self.radius - self.thickness if self.thickness else 0.0

    @cached_property
    def ends(self) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
        """Middles of the flat ends (3,), and unit vectors out of them."""
        first, last = self.pieces[0], self.pieces[-1]
        share = np.array([0.0, 1.0])
        return (
            (first.at(share)[0], -first.directions(share)[0]),
            (last.at(share)[1], last.directions(share)[1]),
        )

    def _places(self, step: float) -> np.ndarray:
        """(K, 3) places along the path that are at most `step` apart, the ends among them."""
        found: list[np.ndarray] = []
        for piece in self.pieces:
            share = np.linspace(0.0, 1.0, max(1, math.ceil(piece.length / step)) + 1)
            found.append(piece.at(share[1 if found else 0 :]))
        return np.concatenate(found)

    def _check_clearance(self) -> None:
        """Bends wider than the radius keep the pipe from itself nearby; this looks further along the path."""
        step = max(self.radius / 2, self.length / 2000)
        places = self._places(step)
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
        for i, place in enumerate(places):
            later = along - along[i] > math.pi * self.radius + step
            if later.any():
                apart = np.linalg.norm(places[later] - place, axis=1)
                if apart.min() < 2 * _APART * self.radius:
                    x, y, z = places[later][apart.argmin()]
                    raise ParameterError(
                        f"pipe: it runs into itself near ({x:.6g}, {y:.6g}, {z:.6g}); "
                        "expected a thinner pipe or wider bends"
                    )

    def __call__(self, points: Array) -> Array:
        if is_tensor(points):
            return self._distance(points)
        return self._distance(np.asarray(points, dtype=np.float64)).astype(np.float32)

    def _distance(self, points: Any) -> Any:
        """(N,) at points (N, 3), float64 or tensors.

        The nearest place of the walls lies across a foot on the path; where there is none, as beyond its
        ends, it is on a flat end."""
        xp, near = library(points), NEAR * self.length
        squared = self.pieces[0].squared(points, near)
        for piece in self.pieces[1:]:
            squared = xp.minimum(squared, piece.squared(points, near))
        wall = self._across(xp.sqrt(squared + _TINY))
        flat = [self._from_end(points, place, out) for place, out in self.ends]
        ends = xp.minimum(flat[0], flat[1])
        return xp.where(wall < 0, xp.maximum(wall, -ends), xp.minimum(wall, ends))

    def _across(self, reach: Any) -> Any:
        """Signed distance to the section, at distances from its middle."""
        outer = reach - self.radius
        return library(reach).maximum(outer, self.bore - reach) if self.thickness else outer

    def _from_end(self, points: Any, place: np.ndarray, out: np.ndarray) -> Any:
        """(N,) distance, without sign, to a flat end."""
        xp = library(points)
        off = points - like(points, place)
        above = off @ like(points, out)
        reach = xp.sqrt(xp.clip((off * off).sum(-1) - above * above, 0.0, None) + _TINY)
        beyond = xp.clip(self._across(reach), 0.0, None)
        return xp.sqrt(beyond * beyond + above * above + _TINY)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        reach = self.support(np.vstack([-np.eye(3), np.eye(3)]))
        return -reach[:3], reach[3:]

    def support(self, directions: np.ndarray, level: float = 0.0) -> np.ndarray:
        directions = np.asarray(directions, dtype=np.float64)
        reach = [self._disc_support(directions, place, out) for place, out in self.ends]
        for piece in self.pieces:
            if isinstance(piece, Bend):  # the wall of a bend is highest across the place where the path is
                x, y = directions @ piece.outwards, directions @ piece.along
                turn = np.arctan2(y, x)
                there = (turn >= 0) & (turn <= piece.angle)
                spoke, flat = directions @ piece.centre, np.hypot(x, y)
                across = np.linalg.norm(directions, axis=1) * self.radius
                reach.append(np.where(there, spoke + piece.radius * flat + across, -np.inf))
            for share in (0.0, 1.0):
                at, way = piece.at(np.array([share]))[0], piece.directions(np.array([share]))[0]
                reach.append(self._disc_support(directions, at, way))
        return np.asarray(np.maximum.reduce(reach) + level)

    def _disc_support(self, directions: np.ndarray, place: np.ndarray, out: np.ndarray) -> np.ndarray:
        above = directions @ out
        flat = np.sqrt(np.maximum((directions**2).sum(axis=1) - above**2, 0.0))
        return np.asarray(directions @ place + self.radius * flat)

    @property
    def lipschitz(self) -> float:
        return 1.0

    @property
    def wall(self) -> float:
        return self.thickness or 2 * self.radius

    def scaled(self, factor: float) -> Self:
        factor = checked(f"{self.kind}: scale factor", factor, 0.0, LARGEST, above=True)
        path = path_of(factor * self.corners)
        return dataclasses.replace(
            self, path=path, radius=factor * self.radius, thickness=factor * self.thickness
        )

    def to_dict(self) -> dict[str, Any]:
        path = [list(corner if corner[3] else corner[:3]) for corner in self.path]
        own = {"kind": self.kind, "path": path, "radius": self.radius}
        return own | ({"thickness": self.thickness} if self.thickness else {})


def path_of(corners: np.ndarray) -> tuple[Corner, ...]:
    """Corners (K, 4) of x, y, z and bend as a path."""
    return tuple((x, y, z, bend) for x, y, z, bend in corners.tolist())


def _corners(given: object) -> tuple[Corner, ...]:
    if not isinstance(given, tuple | list | np.ndarray) or not 2 <= len(given) <= _MOST_CORNERS:
        raise ParameterError(
            f"pipe: path is {brief(given)}; expected corners (x, y, z, bend), two at least and at most "
            f"{_MOST_CORNERS}"
        )
    return tuple(_corner(corner, i, 0 < i < len(given) - 1) for i, corner in enumerate(given))


def _corner(given: object, i: int, inner: bool) -> Corner:
    if not isinstance(given, tuple | list | np.ndarray) or len(given) not in (3, 4):
        raise ParameterError(f"pipe: path[{i}] is {brief(given)}; expected x, y, z and perhaps a bend")
    x, y, z = (checked(f"pipe: path[{i}]", value, -LARGEST, LARGEST) for value in given[:3])
    bend = checked(f"pipe: bend of path[{i}]", given[3] if len(given) > 3 else 0.0, 0.0, LARGEST)
    return x, y, z, bend if inner else 0.0
