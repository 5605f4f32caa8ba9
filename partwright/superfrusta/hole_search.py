"""A search beside the holes of its shape: it sees patterns of them filled, where they would hide walls, and
what it closes is cut in the end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from partwright.shapes import Shape
from partwright.superfrusta.filling import filled
from partwright.superfrusta.hole_cutting import with_holes
from partwright.superfrusta.hole_patterns import HolePattern, hole_patterns
from partwright.superfrusta.resfit import ResidualFit
from partwright.superfrusta.round_hole_cutting import with_round_holes
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.symmetric_fit import expanded

_MUCH = 0.02  # of the shape's volume: a pattern that holds less hides nothing
_SMALL = 0.01  # of it: a larger hole pays for a part, so that growth finds it
_MOST = 0.15  # of it: a pattern that holds more hides walls however large its holes are


@dataclass
class HoleSearch:
    """shape: whose round holes are to be cut out of what the search finds; none where nothing is to be cut.
    patterns: of holes of other forms, or hidden from it. samples: of the shape as it is. max_parts: that the
    search may have in all."""

    search: ResidualFit
    shape: Shape | None
    patterns: Sequence[HolePattern]
    samples: FitSamples
    max_parts: int | None

    @classmethod
    def of(cls, shape: Shape, search: ResidualFit, start: Rows) -> HoleSearch:
        """Of a search that has not begun. It gets samples of the shape with the holes filled that would
        hide walls, and a part less for each pattern to spend."""
        settings, samples = search.settings, search.samples
        most = settings.max_parts
        wanted = settings.symmetry and settings.carving and settings.family != "solid" and not len(start)
        if not wanted or settings.curve or settings.min_iou is not None:
            return cls(search, None, (), samples, most)
        with search.timed("holes"):
            patterns = hole_patterns(shape, samples)
            if most is not None:
                patterns = patterns[: most // 2]
                search.settings = replace(settings, max_parts=most - len(patterns))
            hiding = [one.filling for one in patterns if hides(one, samples.inside_voxels)]
            if hiding:
                search.samples = filled(samples, np.any(hiding, axis=0))
        return cls(search, shape, patterns, samples, most)

    def cut(self) -> int:
        """The holes, out of the leaves that the search found, which sees the shape as it is from then on.

        How many of the leaves, the last of them, are round holes, whose place and size are known.
        """
        search = self.search
        search.settings = replace(search.settings, max_parts=self.max_parts)
        if self.shape is None:
            return 0
        found = search.leaves
        with search.timed("holes"):
            if self.patterns:
                search.take_samples(self.unfilled(search.samples))
                found = with_holes(search.samples, found, self.patterns, search.settings, search.locked)
            others = len(found)
            found = with_round_holes(self.shape, search.samples, found, search.settings)
        if found is not search.leaves:
            search.leaves, rows = found, expanded(found)
            search.report_progress("holes", search.settings.rounds, rows, 1.0, len(found))
        return len(found) - others

    def unfilled(self, samples: FitSamples) -> FitSamples:
        """Samples of the shape as it is, at the points of others: where something was astray, they are more
        than it had."""
        added = samples.points[len(self.samples.points) :]
        distance = np.concatenate([self.samples.distance, self.samples.measure(added)])
        return replace(self.samples, points=samples.points, distance=distance, weight=samples.weight)


def hides(pattern: HolePattern, whole: int) -> bool:
    """Whether parts are better found as if a pattern's holes were full; whole: voxels of the shape."""
    one, all_ = np.count_nonzero(pattern.hole) / whole, np.count_nonzero(pattern.filling) / whole
    return bool(all_ > _MOST or (all_ > _MUCH and one < _SMALL))
