"""Names of parts: every leaf has one, and no two share it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import count

_NUMBERED = re.compile(r"^(.*?)_\d+$", re.DOTALL)


def unique_names(wanted: Sequence[str], stems: Sequence[str]) -> list[str]:
    """One name a part, none twice: the first part that wants a name gets it, a later one the next number.

    A part that wants none ("") is numbered from 1 after its stem: "part_01"; a second "handle" becomes
    "handle_02", a second "leg_03" the first free one of "leg_02", "leg_04" ...
    """
    taken: set[str] = set(wanted)
    given: set[str] = set()
    counters: dict[str, count[int]] = {}
    result = []
    for name, stem in zip(wanted, stems, strict=True):
        if name and name not in given:
            given.add(name)
            result.append(name)
            continue
        if name:
            match = _NUMBERED.match(name)
            stem = match[1] if match else name
        numbers = counters.setdefault(stem, count(2 if name else 1))
        free = next(f for i in numbers if (f := f"{stem}_{i:02d}") not in taken)
        taken.add(free)
        given.add(free)
        result.append(free)
    return result
