"""Whether a new shape hangs together as those of its family do: what an eye would call broken, measured.

Seven things are looked for: a part that is said to be there and has no surface; a piece of a part that is
apart from all others; two parts that lie to each other as in no training shape, as a leg that ends above its
seat; a part that is thinner than in any training shape, as the wall of a tube that is a sieve if looked at
closely; a part that comes through another, as a blade through the wall of its tube; one that stands out of
those that it lies in, as a window above a roof; and one that others cover.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from partwright.partsdf.insets import Inset, Reach, insets, reaches
from partwright.partsdf.meshing import mesh_parts, resolution_for_wall
from partwright.partsdf.model import Model
from partwright.partsdf.nearness import edges_of, from_others, longest_bridge
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.offsets import beyond_range
from partwright.partsdf.piercing import Tip, tips
from partwright.partsdf.pose_range import OFFSET
from partwright.shapes.topology import area_vectors, components

if TYPE_CHECKING:
    import trimesh

# Measured by benchmarks/partsdf_soundness.py, and chosen by looking at pictures of 100 new shapes.
GAP = 0.02  # unit lengths
_PIECE = 0.01  # of its part's surface: what is less is a crumb of the mesh
THROUGH = 0.005  # of a part's surface, beyond what comes through in training shapes
_SEEN = 0.02  # of a part's surface, that an eye sees come through
_COARSE, _FINE = 64, 112  # cells along the unit frame, by the thinnest wall
_JUDGES = 8  # training shapes whose own gaps are looked at
THIN = 0.8  # of the thinnest that a part is in training shapes: what is less has holes, or none can see it
_WALLS = 64  # training shapes whose parts' walls are looked at


@dataclass(frozen=True)
class Soundness:
    """empty: parts without a surface. gap: the widest that is left when all pieces of parts are joined by the
    narrowest, and the parts on its sides. allowed: a gap that is none for this family. offset: how far beyond
    the training shapes' range two parts lie to each other, and these two. Unit lengths. through: what
    of parts came through others, more than in training shapes, the least area first. insets: how all
    parts lie in others. thickness: the least wall of a part, as a share of the
    thinnest that it has in training shapes, and of which part."""

    empty: tuple[str, ...]
    gap: float
    gap_between: tuple[str, ...]
    allowed: float
    offset: float
    offset_between: tuple[str, ...]
    through: tuple[Tip, ...] = ()
    insets: tuple[Inset, ...] = ()
    thickness: float = np.inf
    thinnest: str = ""

    @property
    def seen_through(self) -> tuple[str, ...]:
        """Parts of which an eye sees something come through others, the least area first."""
        return tuple(tip.part for tip in self.through if tip.share > _SEEN)

    @property
    def misplaced(self) -> set[str]:
        """Parts that are seen to come through others, stand out of them or are covered."""
        return {*self.seen_through, *self.standing_out, *self.covered}

    @property
    def standing_out(self) -> tuple[str, ...]:
        """Parts that lie in others, but for more than is seen."""
        return tuple(one.part for one in self.insets if one.stands_out)

    @property
    def covered(self) -> tuple[str, ...]:
        """Parts that others cover more than in any training shape."""
        return tuple(one.part for one in self.insets if one.covered)

    def faults(self) -> list[str]:
        """What is broken or seen to be out of place, a few words each; nothing where it is sound."""
        through = [f"{part} comes through another part" for part in self.seen_through[:1]]
        out = [f"{part} stands out of the others" for part in self.standing_out]
        return self.breaks() + through + out + [f"{part} is covered by others" for part in self.covered]

    def breaks(self) -> list[str]:
        """What is apart, missing, too thin or odd, a few words each."""
        said = [f"{name} has no surface" for name in self.empty]
        if self.gap > self.allowed:
            said.append(f"{' and '.join(dict.fromkeys(self.gap_between))} are {self.gap:.2f} apart")
        if self.thickness < THIN:
            said.append(f"{self.thinnest} is {self.thickness:.2f} times as thick as the thinnest in training")
        return said + _of_layout(self.offset, self.offset_between)

    def of_forms(self, given: Soundness) -> Soundness:
        """The same without what is of its layout, which is that of a given shape: no form may mend that."""
        return replace(self, offset=0.0, offset_between=(), allowed=max(self.allowed, given.gap))

    @property
    def badness(self) -> float:
        """By how much the worst of it exceeds what is allowed, 1 where it just does."""
        amiss = [one.amiss for one in self.insets if one.amiss]
        seen = sum(tip.share for tip in self.through) + sum(amiss) + (1.0 if self.through or amiss else 0.0)
        worst = max(self.gap / self.allowed, self.offset / OFFSET, THIN / self.thickness, seen)
        return 2.0 * len(self.empty) + worst

    @property
    def rank(self) -> tuple[bool, float]:
        """To order by, the best first: whatever is broken comes after all that is not, as what comes through
        another part is no reason to have a broken shape in its place."""
        return bool(self.breaks()), self.badness


class _Trained(NamedTuple):
    """A training shape, the meshes of its parts, and how far their vertices are from the other parts."""

    shape: NeuralShape
    parts: dict[str, trimesh.Trimesh]
    off: dict[str, np.ndarray]


class Judge:
    """Tells how sound shapes of one model are. Its training shapes are looked at once, if need be."""

    def __init__(self, model: Model) -> None:
        self.model = model

    def __call__(self, shape: NeuralShape) -> Soundness:
        """Of a shape in its family's frame, by a mesh of its parts, which takes a few tenths of a second."""
        parts = _meshes(shape)
        gap, between = widest_gap(parts)
        allowed = GAP if gap <= GAP else max(GAP, self._own_gap)
        empty = tuple(name for name in shape.names() if name not in parts)
        off = from_others(shape, parts)
        through = tuple(tip for tip in tips(shape, parts, off) if tip.share > THROUGH)
        if through:
            known = self._own_tips
            through = tuple(tip for tip in through if tip.share > THROUGH + known.get(tip.part, 0.0))
        lying = insets(shape, parts, self._reaches, off)
        thickness, thinnest = self._thickness(shape)
        offset = largest_offset(shape)
        return Soundness(empty, gap, between, allowed, *offset, through, lying, thickness, thinnest)

    def _thickness(self, shape: NeuralShape) -> tuple[float, str]:
        """The least share that a part's wall is of the thinnest one in training shapes, and of which part."""
        walls = zip(shape.names(), shape.walls, strict=True)
        shares = [(wall / self._thinnest[name], name) for name, wall in walls if name in self._thinnest]
        return min(shares, default=(np.inf, ""))

    @cached_property
    def _thinnest(self) -> dict[str, float]:
        """By part, its thinnest wall in some training shapes."""
        least: dict[str, float] = {}
        for name in _spread(self.model.shapes, _WALLS):
            shape = NeuralShape.trained(self.model, name)
            for part, wall in zip(shape.names(), shape.walls, strict=True):
                least[part] = min(least.get(part, np.inf), float(wall))
        return {part: wall for part, wall in least.items() if wall < np.inf}

    @property
    def lying(self) -> tuple[str, ...]:
        """Parts that lie in others in training shapes, as windows in a body."""
        return tuple(name for name, reach in self._reaches.items() if reach.lies_in)

    @cached_property
    def _reaches(self) -> dict[str, Reach]:
        return reaches(self._trained)

    @cached_property
    def _trained(self) -> list[_Trained]:
        """A few training shapes."""
        found = []
        for name in _spread(self.model.shapes, _JUDGES):
            shape = NeuralShape.trained(self.model, name)
            parts = _meshes(shape)
            found.append(_Trained(shape, parts, from_others(shape, parts)))
        return found

    @cached_property
    def _own_gap(self) -> float:
        """The widest gap of training shapes: parts of some families are apart from one another."""
        return max(widest_gap(one.parts)[0] for one in self._trained)

    @cached_property
    def _own_tips(self) -> dict[str, float]:
        """By part, the largest share of its surface that came through others in training shapes."""
        most: dict[str, float] = {}
        for one in self._trained:
            for tip in tips(*one):
                most[tip.part] = max(most.get(tip.part, 0.0), tip.share)
        return most


def _spread(names: Sequence[str], count: int) -> list[str]:
    """At most so many of them, evenly from the first to the last."""
    rows = np.unique(np.linspace(0, len(names) - 1, count).round().astype(int))
    return [names[row] for row in rows]


def widest_gap(parts: dict[str, trimesh.Trimesh]) -> tuple[float, tuple[str, ...]]:
    """The longest edge of the minimum spanning tree of all pieces of closed parts, each from the nearest
    vertex of one to that of another, and the parts at its ends; 0 where there are fewer than two."""
    pieces = [(name, points) for name, mesh in parts.items() for points in _pieces(mesh)]
    if len(pieces) < 2:
        return 0.0, ()
    gap, i, j = longest_bridge([points for _, points in pieces])
    return gap, (pieces[j][0], pieces[i][0])


def layout_faults(shape: NeuralShape) -> list[str]:
    """What is unlike the family in how its parts' boxes lie, a few words; nothing where they are like it."""
    return _of_layout(*largest_offset(shape))


def least_rank(offset: float) -> tuple[bool, float]:
    """What `Soundness.rank` is at least for a shape with such an offset, whatever its surfaces are."""
    return offset > OFFSET, offset / OFFSET


def _of_layout(offset: float, between: tuple[str, ...]) -> list[str]:
    return (
        [f"{' and '.join(between)} lie as in no training shape, by {offset:.2f}"] if offset > OFFSET else []
    )


def largest_offset(shape: NeuralShape) -> tuple[float, tuple[str, ...]]:
    """How far beyond the range of the training shapes the sides of two parts' boxes lie to each other, along
    an axis of the family's frame, unit lengths; and these parts. At most 0 where all are within."""
    model = shape.model
    beyond, first, second = beyond_range(model, shape.poses, shape.present)
    if not beyond.isfinite().any():
        return 0.0, ()
    pair = int(beyond.argmax())
    return float(beyond[pair]), (model.parts[int(first[pair])], model.parts[int(second[pair])])


def _meshes(shape: NeuralShape) -> dict[str, trimesh.Trimesh]:
    return mesh_parts(shape, min(_FINE, resolution_for_wall(shape.thinnest, _COARSE)))


def _pieces(mesh: trimesh.Trimesh) -> list[np.ndarray]:
    """Vertices (N, 3) of a mesh's connected pieces, without crumbs and the walls of cavities."""
    piece = components(len(mesh.vertices), *edges_of(mesh).T)
    owner = piece[mesh.faces[:, 0]]
    corners = mesh.triangles
    normal = area_vectors(corners)
    area = np.bincount(owner, np.linalg.norm(normal, axis=1) / 2)
    volume = np.bincount(owner, np.einsum("fi,fi->f", corners[:, 0], normal))
    kept = (volume > 0) & (area >= _PIECE * area.sum())
    return [np.asarray(mesh.vertices)[piece == i] for i in np.flatnonzero(kept)]
