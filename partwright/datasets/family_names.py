"""What the names of a family's parts tell: copies, parts that are rare, and parts that one shape lacks."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FEWEST = 4  # shapes that tell what is usual
USUAL = 0.8  # share of shapes that have something, above which one without it is odd
_COPY = re.compile(r"(?P<name>.+?)[._ -]?\d+")  # leg.001 of Blender, leg_1 of readers, leg2 of people

Mask = NDArray[np.bool_]


def rare_parts(parts: Sequence[str], names: Sequence[str], present: Mask) -> list[str]:
    """One line for all parts that the same few shapes, too few to learn from, have.

    names: of the shapes; present (S, P): which parts they have.
    """
    alike: dict[tuple[str, ...], list[str]] = {}
    for p, part in enumerate(parts):
        having = tuple(name for name, has in zip(names, present[:, p], strict=True) if has)
        if len(having) < min(FEWEST, len(names)):
            alike.setdefault(having, []).append(part)
    lines = []
    for having, group in alike.items():
        verb, them = ("are", "them") if len(group) > 1 else ("is", "it")
        text = f"{', '.join(group)} {verb} in {len(having)} of {len(names)} shapes ({', '.join(having)})"
        lines.append(f"{text}, too few to learn {them}")
    return lines


def copied_names(parts: Sequence[str], present: Mask, shape: int) -> list[str]:
    """Parts of a shape whose names, without the number at their end, are another part's that most shapes that
    have one of both have: so programs and readers call a node whose name another node had."""
    lines = []
    for p in np.flatnonzero(present[shape]).tolist():
        match = _COPY.fullmatch(parts[p])
        if match is None or match["name"] not in parts:
            continue
        own = parts.index(match["name"])
        if present[:, p].sum() >= (1 - USUAL) * present[:, own].sum() + 1:
            continue
        beside = "beside" if present[shape, own] else "and no"
        lines.append(
            f"{parts[p]} {beside} {match['name']}: a node's name that came twice, or a copy's; name it "
            "as the other shapes do"
        )
    return lines


def missing(parts: Sequence[str], present: Mask, part: int) -> list[tuple[int, str]]:
    """(shape, a line with {parts}) of those that lack a part that most of all shapes have, or that comes with
    another part that they have: each of the two in most shapes that have the other."""
    count, has = len(present), present[:, part]
    lacking = np.flatnonzero(~has).tolist()
    if has.sum() >= USUAL * count:
        return [(i, f"no {{parts}}, which {has.sum()} of {count} shapes have") for i in lacking]
    found = []
    for i in lacking:
        best: tuple[float, str] = (0.0, "")
        for q in np.flatnonzero(present[i]).tolist():
            both, other = (has & present[:, q]).sum(), present[:, q].sum()
            if both >= max(FEWEST, USUAL * other, USUAL * has.sum()) and both / other > best[0]:
                best = both / other, f"no {{parts}}, which {both} of the {other} shapes with {parts[q]} have"
        if best[1]:
            found.append((i, best[1]))
    return found
