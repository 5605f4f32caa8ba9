"""A link that convex hulls contain, and what each alone does: they become others that let go of nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from partwright.approximation.hull_faces import faces_of
from partwright.approximation.piece_joining import boxes_touch
from partwright.meshing.hulls import file_grid, file_hull, hull_of
from partwright.meshing.manifolds import as_mesh, surface_of
from partwright.robots.containment import shape_solid
from partwright.robots.enclosing import corners_beyond, outer_hull
from partwright.robots.model import Shape
from partwright.robots.triangles import clipped

if TYPE_CHECKING:
    from manifold3d import Manifold

_ROOM = 2  # steps of the grid that files' hulls are moved to: how far a plane stays off what is contained
_FACES = 64  # of a hull that was split or joined, at most


@dataclass(frozen=True, eq=False)
class Hull:
    """A convex solid that contains triangles of a link, in the world. shape: what it came from; None where it
    is another one."""

    solid: Manifold
    shape: Shape | None = None

    @property
    def fixed(self) -> bool:
        """Whether it stands for a native solid, which stays."""
        return self.shape is not None and self.shape.mesh is None

    @cached_property
    def planes(self) -> tuple[np.ndarray, np.ndarray]:
        return faces_of(self.solid)

    @cached_property
    def box(self) -> np.ndarray:
        """(2, 3) lower and upper corner."""
        return np.reshape(self.solid.bounding_box(), (2, 3))

    @cached_property
    def corners(self) -> np.ndarray:
        return surface_of(self.solid)[0]

    @cached_property
    def volume(self) -> float:
        return float(self.solid.volume())

    def shares(self, other: Hull) -> float:
        """Volume that both have."""
        if not boxes_touch(self.box, other.box):
            return 0.0
        return float((self.solid ^ other.solid).volume())


State = tuple[dict[Hull, np.ndarray], np.ndarray, dict[Hull, Hull]]


class EnclosedLink:
    """A link's hulls and what they contain, in the world."""

    def __init__(
        self, shapes: Sequence[Shape], triangles: np.ndarray, solid: Manifold, pose: np.ndarray, fine: float
    ) -> None:
        """shapes, the triangles (T, 3, 3) that they contain, and the solid whose inside they are to have,
        which may be coarse: in the link's frame, which `pose` (4, 4) places. fine: a length; how far faces of
        new hulls may be left out."""
        self._pose, self._fine = pose, fine
        self._solid = solid.transform(pose[:3])
        self._room = _ROOM * file_grid(triangles.reshape(-1, 3))
        self._triangles = triangles @ pose[:3, :3].T + pose[:3, 3]
        self._low, self._high = self._triangles.min(axis=1), self._triangles.max(axis=1)
        self._within: dict[Hull, np.ndarray] = {}
        self._cores: dict[Hull, Hull] = {}
        self._insides: WeakKeyDictionary[Hull, Manifold] = WeakKeyDictionary()
        self._owners = np.zeros(len(triangles), int)
        for shape in shapes:
            hull = Hull(shape_solid(shape).transform(pose[:3]), shape)
            self._within[hull] = self._contained(hull)
            self._owners += self._within[hull]

    @property
    def hulls(self) -> list[Hull]:
        return list(self._within)

    @property
    def box(self) -> np.ndarray:
        """(2, 3) lower and upper corner of all hulls."""
        boxes = np.array([hull.box for hull in self._within])
        return np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])

    @property
    def room(self) -> float:
        """A length: how far a plane stays off what is contained."""
        return self._room

    def needed(self, hull: Hull) -> np.ndarray:
        """(N, 3, 3) triangles: what only this hull contains of the link's, and the surface of what only it
        has of the inside."""
        from manifold3d import Manifold, OpType

        near = np.flatnonzero(self._near(hull) & (self._owners - self._within[hull] == 0))
        whole = self._within[hull][near]
        others = [one.solid for one in self._within if one is not hull and boxes_touch(one.box, hull.box)]
        inside = self._inside(hull)
        if not inside.is_empty():
            inside = Manifold.batch_boolean([inside, *others], OpType.Subtract)
        corners, faces = surface_of(inside)
        return np.concatenate(
            [
                self._triangles[near[whole]],
                clipped(self._triangles[near[~whole]], *hull.planes),
                corners[faces],
            ]
        )

    def core(self, hull: Hull) -> Hull:
        """The hull of what only this one contains; empty where that has no volume."""
        if hull not in self._cores:
            self._cores[hull] = Hull(hull_of(self.needed(hull).reshape(-1, 3)))
        return self._cores[hull]

    def trim(self, hull: Hull, normal: np.ndarray, offset: float) -> Hull:
        """Takes off a hull what is beyond a plane; what is left of it."""
        solid = hull.solid.trim_by_plane(tuple((-normal).tolist()), -offset)
        if solid.is_empty() or solid.volume() >= hull.volume:
            return hull
        less = Hull(solid)
        self._insides[less] = self._inside(hull).trim_by_plane(tuple((-normal).tolist()), -offset)
        lost = np.reshape(hull.solid.trim_by_plane(tuple(normal.tolist()), offset).bounding_box(), (2, 3))
        within = self._within[hull].copy()
        near = np.flatnonzero(within)
        within[near] = (self._triangles[near] @ normal <= offset).all(axis=1)
        self._put(hull, lost, [(less, within, self.core(hull))])
        return less

    def split(self, hull: Hull, sides: Sequence[Hull]) -> list[Hull]:
        """Takes hulls of few faces for one: each around a side of all that only this one contains."""
        around = [Hull(outer_hull(side.solid, self._fine, _FACES, self._room) ^ hull.solid) for side in sides]
        self._insides |= {one: self._inside(hull) ^ one.solid for one in around}
        self._put(
            hull,
            hull.box,
            [(one, self._contained(one), side) for one, side in zip(around, sides, strict=True)],
        )
        return around

    def join(self, a: Hull, b: Hull, both: Hull) -> None:
        """Takes a hull that contains two for them."""
        self._put(a, a.box, [])
        self._put(b, b.box, [(both, self._contained(both), None)])

    def state(self) -> State:
        """What `restore` takes."""
        return dict(self._within), self._owners.copy(), dict(self._cores)

    def restore(self, state: State) -> None:
        self._within, self._owners, self._cores = state

    def both(self, a: Hull, b: Hull) -> Hull:
        """A hull of few faces that contains two."""
        return Hull(outer_hull(hull_of(np.concatenate([a.corners, b.corners])), self._fine, _FACES, 0.0))

    def result(self) -> list[Shape]:
        """The shapes as files have them."""
        back = np.linalg.inv(self._pose)
        return [
            hull.shape or Shape("", mesh=as_mesh(file_hull(hull.corners @ back[:3, :3].T + back[:3, 3])))
            for hull in self._within
        ]

    def _put(self, hull: Hull, lost: np.ndarray, by: Sequence[tuple[Hull, np.ndarray, Hull | None]]) -> None:
        """Takes others in the place of a hull, with what they contain and their cores. lost: a box (2, 3)
        around what it had and they do not; cores of hulls there are forgotten, which may alone have it
        now."""
        self._owners -= self._within.pop(hull)
        self._cores.pop(hull, None)
        for one, within, _ in by:
            self._within[one] = within
            self._owners += within
        self._cores = {one: core for one, core in self._cores.items() if not boxes_touch(one.box, lost)}
        self._cores |= {one: core for one, _, core in by if core is not None}

    def _inside(self, hull: Hull) -> Manifold:
        """What a hull has of the solid."""
        if hull not in self._insides:
            self._insides[hull] = self._solid ^ hull.solid
        return self._insides[hull]

    def _near(self, hull: Hull) -> np.ndarray:
        return ((self._low <= hull.box[1]) & (self._high >= hull.box[0])).all(axis=1)

    def _contained(self, hull: Hull) -> np.ndarray:
        """(T,) whether a hull contains the whole triangle."""
        within = ((self._low >= hull.box[0]) & (self._high <= hull.box[1])).all(axis=1)
        near = np.flatnonzero(within)
        within[near] = (corners_beyond(hull.planes, self._triangles[near]) <= 0).all(axis=1)
        return within
