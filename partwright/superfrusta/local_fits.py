"""Fits of one place, while all other parts stay: one part in two, several in one, one more within a box.

They work on samples and a grid of that place alone, so that a small part is seen as well as a large one,
whatever the quality.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from partwright.assembly import Assembly, Part
from partwright.assembly.exchange import added, exchanged
from partwright.assembly.parts_from_rows import parts_from_rows
from partwright.assembly.rows import rows as rows_of
from partwright.errors import SettingError
from partwright.fields.columns import ROTATION, UNSIGNED, Column
from partwright.methods import Checkpoint, Progress, Run
from partwright.shapes import Shape
from partwright.superfrusta.flat_tree import flattened
from partwright.superfrusta.growing import Region, fit_regions
from partwright.superfrusta.merging import owners
from partwright.superfrusta.objective import score
from partwright.superfrusta.refining import POLISH, TOUCH_UP, refine
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings
from partwright.superfrusta.solid_kinds import is_solid, solid

_FEWEST = 24  # voxels that a part can be fitted to
_SMALLEST_SHARE = 0.08  # of the voxels, for a piece to be worth a part
_FILLED = 0.25  # of what is missing in a box, for a part to be what was meant


@dataclass(frozen=True)
class LocalFit:
    """An assembly beside the shape that it stands for.

    Raises SettingError, in all that it does, where the assembly is no tree of unions and differences of
    SuperFrusta and named solids.
    """

    shape: Shape
    assembly: Assembly
    settings: Settings
    run: Run

    def split(self, name: str) -> Assembly:
        """Two parts in place of the one of this name: the best of some ways to share out what it stands for.

        Copies of a repeated part are split alike.

        Raises:
            SettingError: no part has that name, or none of the shape is for it to share out.
        """
        at = self._index(name)
        samples = self._samples(*_box_of([self.leaves[at][0]]))
        mine = owners(samples, self.rows) == at
        if np.count_nonzero(mine) < _FEWEST:
            raise SettingError(f"{name} stands for nothing of the shape, so there is nothing to share out")
        others = np.delete(self.rows, at, axis=0)
        pieces = [
            np.isin(np.arange(len(mine)), np.flatnonzero(mine)[which])
            for halves in _partitions(samples, mine, self.rows[at])
            for which in (halves, ~halves)
        ]
        regions = [
            Region(
                piece, others, _depth(samples, piece), 0.2, 0.15, self.rows[[at], ROTATION], self._sign(at)
            )
            for piece in pieces
        ]
        self._tell("split", 0.2)
        fitted = fit_regions(samples, regions, self.settings, self.settings.overlap)
        self._tell("split", 0.6)
        trials = [
            self._refined(samples, np.insert(np.delete(self.rows, at, 0), [at, at], pair, 0), [at, at + 1])
            for pair in fitted.reshape(-1, 2, fitted.shape[1])
        ]
        best = max(trials, key=lambda rows: score(samples, rows))
        both = self._parts(best[at : at + 2], self.assembly[name])
        return exchanged(self.assembly, name, both)

    def merge(self, names: Sequence[str]) -> Assembly:
        """One part in place of these, under the name of the first.

        Raises:
            SettingError: they are fewer than two, take part in different ways, or stand for nothing.
        """
        parts = [part for part in self.assembly.parts if part.name in names]
        if len(parts) < 2:
            raise SettingError("merging takes at least two parts")
        if len({part.instances for part in parts}) > 1:
            raise SettingError("parts with different copies cannot be one; make the copies parts first")
        at = [self._index(part.name) for part in parts]
        if len({self._sign(i) for i in at}) > 1:
            raise SettingError("a part that is added and one that is taken away cannot be one")
        samples = self._samples(*_box_of([self.leaves[i][0] for i in at]))
        mine = np.isin(owners(samples, self.rows), at)
        if np.count_nonzero(mine) < _FEWEST:
            raise SettingError(f"{', '.join(names)} stand for nothing of the shape; there is nothing to fit")
        others = np.delete(self.rows, at, axis=0)
        region = Region(
            mine, others, _depth(samples, mine), 0.2, 0.15, self.rows[at, ROTATION], self._sign(at[0])
        )
        self._tell("merge", 0.3)
        one = fit_regions(samples, [region], self.settings, self.settings.overlap)
        rows = np.insert(others, at[0], one, axis=0)
        (merged,) = self._parts(self._refined(samples, rows, [at[0]])[[at[0]]], parts[0])
        result = self.assembly.replace_part(parts[0].name, merged)
        for part in parts[1:]:
            result = result.without(part.name)
        if len(result) != len(self.assembly) - len(parts) + 1:
            raise SettingError("others are taken away from one of these; take the first of its group with it")
        return result

    def fill(self, box: Sequence[float]) -> Assembly:
        """One part more, for what is missing of the shape within the box (lowest, then highest corner).

        What lies outside of the box counts as outside of the shape, so the part stays within it.

        Raises:
            SettingError: the box is none, nothing is missing in it, or what is missing is too thin.
        """
        given = np.array(box, dtype=np.float64)
        if given.shape != (6,) or not np.isfinite(given).all() or (given[:3] >= given[3:]).any():
            raise SettingError(f"box: expected its lowest and its highest corner, got {list(box)}")
        low, high = self.shape.frame.to_unit(given.reshape(2, 3))
        samples = _within(self._samples(low, high), low, high)
        there = samples.grid.values.ravel() < 0
        if not there.any():
            raise SettingError("nothing of the shape is in the box; draw it around what is missing")
        missing = there & (samples.grid_field(self.rows).ravel() > 0)
        if np.count_nonzero(missing) < _FEWEST:
            raise SettingError("nothing is missing in the box: the parts fill what there is of the shape")
        self._tell("box", 0.3)
        region = Region(missing, self.rows, _depth(samples, missing), 0.2, 1.0)
        one = fit_regions(samples, [region], self.settings)
        rows = np.concatenate([self.rows, one])
        rows = self._refined(samples, rows, [len(rows) - 1])
        filled = samples.covered_by(rows[-1:], samples.grid_points[missing])[0]
        if filled.mean() < _FILLED:
            raise SettingError("what is missing in the box is too thin, or too much in pieces, for one part")
        (part,) = self._parts(rows[-1:], None)
        return added(self.assembly, part)

    @cached_property
    def leaves(self) -> list[tuple[Part, bool]]:
        """All copies in the unit frame in the order of the fold, and whether each is added."""
        unit = self.assembly.translated([-c for c in self.shape.frame.centre]).scaled(self.shape.frame.scale)
        return [(copy, plus) for part, plus in flattened(unit) for copy in part.copies]

    @cached_property
    def rows(self) -> Rows:
        parts = [part for part, _ in self.leaves]
        for part in parts:
            if part.field.superfrustum() is None:
                raise SettingError(
                    f"{part.name} is of kind {part.field.kind}; these fits know SuperFrusta and named solids"
                )
        signs = np.array([[1.0 if plus else -1.0] for _, plus in self.leaves])
        return np.hstack([rows_of(parts), signs]).astype(np.float32)

    def _index(self, name: str) -> int:
        """Row of the part, or of the first of its copies."""
        names = [part.name for part, _ in self.leaves]
        if name not in names:
            raise SettingError(f"no part is named {name!r}; the names are: {', '.join(dict.fromkeys(names))}")
        return names.index(name)

    def _sign(self, row: int) -> float:
        return float(self.rows[row, Column.SIGN])

    def _samples(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> FitSamples:
        """The fit's own samples, and more of them and another grid between two corners of the unit frame."""
        whole = FitSamples.of(self.shape, self.settings, self.run, Checkpoint(self.run.cancel))
        return whole.about(low, high)

    def _refined(self, samples: FitSamples, rows: Rows, moving: Sequence[int]) -> Rows:
        free = np.isin(np.arange(len(rows)), moving)
        for stages in (TOUCH_UP, POLISH):
            rows = refine(samples, rows, stages, self.settings, free)
        return rows

    def _parts(self, rows: Rows, of: Part | None) -> list[Part]:
        """Rows as parts in own units; they repeat as the part does that they are of, and have its name."""
        frame = self.shape.frame
        result = []
        for part, row in zip(parts_from_rows(rows[:, :UNSIGNED]), rows, strict=True):
            if self.settings.family == "solid" and is_solid(row):
                part = replace(part, field=solid(row))
            part = part.scaled(1 / frame.scale).translated(frame.centre)
            result.append(replace(part, name=of.name, instances=of.instances) if of else part)
        return result

    def _tell(self, stage: str, fraction: float) -> None:
        self.run.told(Progress(stage, 1, 1, len(self.assembly), 0.0, fraction))


def _box_of(parts: Sequence[Part]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    boxes = [part.bounds() for part in parts]
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


def _within(samples: FitSamples, low: NDArray[np.float64], high: NDArray[np.float64]) -> FitSamples:
    """Samples of what the shape and a box share."""
    middle, half = (low + high) / 2, (high - low) / 2

    def box(points: NDArray[np.float32]) -> NDArray[np.float32]:
        off = np.abs(points - middle) - half
        outside = np.linalg.norm(np.maximum(off, 0), axis=1)
        return (outside + np.minimum(off.max(axis=1), 0)).astype(np.float32)

    grid = samples.grid
    shared = np.maximum(grid.values.ravel(), box(samples.grid_points)).reshape(grid.values.shape)
    return replace(
        samples,
        distance=np.maximum(samples.distance, box(samples.points)),
        grid=replace(grid, values=shared),
        measure=lambda points: np.maximum(samples.measure(points), box(points)),
    )


def _depth(samples: FitSamples, voxels: NDArray[np.bool_]) -> float:
    """The largest depth of the shape in these voxels."""
    return float(np.abs(samples.grid.values.ravel()[voxels]).max(initial=samples.grid.spacing))


def _partitions(
    samples: FitSamples, mine: NDArray[np.bool_], row: NDArray[np.float32]
) -> list[NDArray[np.bool_]]:
    """Ways to share the voxels (X * Y * Z,) that are `mine` out to two, as masks of them.

    At the middle along each principal axis; in two clusters; and what the part covers from what it misses.
    """
    points = samples.grid_points[mine].astype(np.float64)
    local = points - points.mean(axis=0)
    axes = np.linalg.eigh(local.T @ local)[1]
    ways = [along < np.median(along) for along in (local @ axes).T]
    ways.append(kmeans2(local, 2, seed=0, minit="++")[1] == 0)
    ways.append(samples.covered_by(row[None], samples.grid_points[mine])[0])
    enough = [way for way in ways if _SMALLEST_SHARE < way.mean() < 1 - _SMALLEST_SHARE]
    return enough or ways[:1]
