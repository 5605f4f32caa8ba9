"""Some parts of an assembly fitted again: what the fit starts from, and what stays as people know it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Self

import numpy as np

from partwright.assembly import Assembly, Part
from partwright.assembly.exchange import with_leaves
from partwright.errors import SettingError
from partwright.fitting import Start
from partwright.studio.messages import Fit

_SAME = 0.3  # of what two boxes fill together, for the parts in them to count as the same


@dataclass(frozen=True)
class Refit:
    """before: the assembly; free: names of its parts that may change.

    A fit knows no repeated parts, so it starts from all copies as parts of their own, under other names.
    """

    before: Assembly
    free: list[str]
    start: Start
    copies: dict[str, list[str]]
    """Of each part that is locked and repeated, the names that its copies have in the start."""

    @classmethod
    def of(cls, assembly: Assembly, message: Fit) -> Self:
        """Raises SettingError where every part is locked."""
        names = [part.name for part in assembly.parts]
        chosen = {name for name in message.names if name in names}
        free = [name for name in names if (name in chosen) == (message.mode == "only")]
        if not free:
            raise SettingError("every part is locked, so there is nothing to refit")
        spread = assembly.expanded()
        leaves = iter(spread.parts)
        locked: list[str] = []
        copies: dict[str, list[str]] = {}
        for part in assembly.parts:
            mine = [next(leaves).name for _ in part.copies]
            if part.name not in free:
                locked += mine
                if len(mine) > 1:
                    copies[part.name] = mine
        return cls(assembly, free, Start(spread, tuple(locked)), copies)

    def restored(self, fitted: Assembly) -> Assembly:
        """Locked parts as they were, solids and copies; others that are still there under their names, with
        what was known of them."""
        for name in self.start.locked:
            if any(part.name == name for part in fitted.parts):
                fitted = fitted.replace_part(name, self.start.assembly[name])
        for name, mine in self.copies.items():
            there = [one for one in mine if any(part.name == one for part in fitted.parts)]
            if len(there) != len(mine):
                continue
            fitted = fitted.replace_part(mine[0], self.before[name])
            for one in mine[1:]:
                fitted = fitted.without(one)
        return self._named(fitted)

    def _named(self, fitted: Assembly) -> Assembly:
        kept = {part.name for part in self.before.parts} - set(self.free)
        new = [part for part in fitted.parts if part.name not in kept]
        pairs = sorted(
            ((_shared(self.before[name], part), name, part.name) for name in self.free for part in new),
            reverse=True,
        )
        known: dict[str, str] = {}  # new name -> former one
        for share, name, now in pairs:
            if share > _SAME and name not in known.values() and now not in known:
                known[now] = name

        def former(part: Part) -> Part:
            if part.name not in known:
                return part
            name = known[part.name]
            return dataclasses.replace(
                part, name=name, metadata={**self.before[name].metadata, **part.metadata}
            )

        return with_leaves(fitted, former)


def _shared(a: Part, b: Part) -> float:
    """Intersection over union of their boxes."""
    low_a, high_a = a.bounds()
    low_b, high_b = b.bounds()
    inner = np.prod(np.maximum(np.minimum(high_a, high_b) - np.maximum(low_a, low_b), 0))
    both = np.prod(high_a - low_a) + np.prod(high_b - low_b) - inner
    return float(inner / both) if np.isfinite(both) and both > 0 else 0.0
