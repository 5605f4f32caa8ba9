"""The CSG tree: layers of convexes of quadrics, and the assembly that it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from partwright.assembly import Assembly, Node, Part
from partwright.assembly.motion import Motion
from partwright.capri import quadric_rows as rows
from partwright.capri.motions import moved
from partwright.capri.repeated_quadrics import are_repeats, with_repeats
from partwright.fields import Quadric

_MAX_REACH = 4.0  # unit frame: what reaches further was judged by no sample there
Convex = tuple[int, ...]
Layers = tuple[tuple[Convex, ...], ...]


@dataclass(frozen=True)
class Copy:
    """A convex that is another of its layer, `of` its place there, after a motion."""

    of: int
    motion: Motion


@dataclass(frozen=True)
class CsgTree:
    """Unions of intersections, added and subtracted in turn: (L0 - L1) + L2 ... (section 3.2; eq. 5 has two).

    rows (K, 10) in the unit frame; a convex is the indices of the quadrics that it intersects. complement
    (K,) marks rows that are the outside of a convex quadric: subtracting one in a convex counts as a convex.
    copies: for each convex, None or what it is a copy of; its rows are those of that, moved. None of them is
    where it is empty.
    """

    rows: NDArray[np.float64]
    complement: NDArray[np.bool_]
    layers: Layers
    copies: tuple[tuple[Copy | None, ...], ...] = ()

    @property
    def primitives(self) -> int:
        """#P: quadrics, counted in every convex that uses them."""
        return sum(len(convex) for layer in self.layers for convex in layer)

    @property
    def convexes(self) -> int:
        """#C: convexes, and the convex quadrics subtracted within them."""
        return sum(1 + int(self.complement[list(c)].sum()) for layer in self.layers for c in layer)

    def occupancy(self, points: NDArray[np.floating]) -> NDArray[np.bool_]:
        """(N,) whether points (N, 3) of the unit frame lie inside."""
        inside = rows.values(self.rows, points) <= 0
        result = np.zeros(len(points), dtype=bool)
        for k, layer in enumerate(self.layers):
            for convex in layer:
                result[inside[:, list(convex)].all(axis=1)] = k % 2 == 0
        return result

    def closed(self, lower: ArrayLike, upper: ArrayLike) -> CsgTree:
        """Added convexes that do not end, or far off, are cut off at the box (3,), (3,) around the shape.

        Copies are cut where the first of them is, after their motions.
        """
        sides = [rows.plane(-e, float(-c)) for e, c in zip(np.eye(3), np.asarray(lower), strict=True)]
        sides += [rows.plane(e, float(c)) for e, c in zip(np.eye(3), np.asarray(upper), strict=True)]
        table = [*self.rows, *sides]

        def ended(layer: tuple[Convex, ...], copies: Sequence[Copy | None]) -> Iterator[Convex]:
            reach = {i: self._node(layer[i], "").bounds() for i, copy in enumerate(copies) if copy is None}
            for i, (convex, copy) in enumerate(zip(layer, copies, strict=True)):
                open_ = np.flatnonzero(~(np.abs(reach[i if copy is None else copy.of]) < _MAX_REACH))
                if copy is None or not len(open_):
                    ends = [len(self.rows) + int(side) for side in open_]
                else:
                    ends = list(range(len(table), len(table) + len(open_)))
                    table.extend(moved(copy.motion, np.stack([sides[side] for side in open_])))
                yield (*convex, *ends)

        layers = tuple(
            layer if k % 2 else tuple(ended(layer, self.copies[k] if self.copies else (None,) * len(layer)))
            for k, layer in enumerate(self.layers)
        )
        complement = np.r_[self.complement, np.zeros(len(table) - len(self.rows), dtype=bool)]
        return CsgTree(np.stack(table), complement, layers, self.copies)

    def assembly(self) -> Assembly:
        """Difference of two unions of intersections (eq. 5), leaves are quadrics; in the unit frame."""
        whole: Node | None = None
        count = 0
        for k, layer in enumerate(self.layers):
            nodes: list[Node] = []
            for i, convex in enumerate(layer):
                count += 1
                name = f"convex_{count:02d}"
                copy = self.copies[k][i] if self.copies else None
                if copy is not None and not self._drilled_alike(layer[copy.of], convex):
                    nodes.append(copy.motion.of(self._said_once(layer[copy.of], name)))
                elif copy is None and self._has_copies(k, i):
                    nodes.append(self._said_once(convex, name))
                else:
                    nodes.append(self._node(convex, name))
            if not nodes:
                continue
            union: Node = Assembly(tuple(nodes), name="subtracted" if k % 2 else "added")
            whole = union if whole is None else Assembly((whole, union), "difference" if k % 2 else "union")
        assert isinstance(whole, Assembly)
        return whole

    def _has_copies(self, layer: int, index: int) -> bool:
        return bool(self.copies) and any(c is not None and c.of == index for c in self.copies[layer])

    def _said_once(self, convex: Convex, name: str) -> Assembly:
        """A convex with copies: what repeats within it is a leaf with copies before it is copied itself."""
        return with_repeats(self._node(convex, name)) if len(convex) > 1 else self._node(convex, name)

    def _drilled_alike(self, convex: Convex, copy: Convex) -> bool:
        """Whether both are one quadric of one direction, which `with_repeats` joins with all alike."""
        return len(convex) == 1 and are_repeats(self._node(convex, ""), self._node(copy, ""))

    def _node(self, convex: Convex, name: str) -> Assembly:
        """One convex; quadrics whose outside it takes are subtracted from the rest."""
        taken = [k for k in convex if self.complement[k]]
        held = [k for k in convex if not self.complement[k]]
        if not taken or not held:
            return Assembly(tuple(_leaf(self.rows[k]) for k in convex), "intersection", name)
        core = Assembly(tuple(_leaf(self.rows[k]) for k in held), "intersection", name)
        return Assembly((core, *(_leaf(-self.rows[k]) for k in taken)), "difference", f"{name}_cut")


def _leaf(row: NDArray[np.float64]) -> Part:
    return Part(Quadric(tuple(row.tolist())))
