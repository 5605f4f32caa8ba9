"""Which shapes of a prepared family will be trouble to learn from, and why: what stands out from the others.

A part is compared with the same part of the other shapes, by medians, which a few odd shapes do not move.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partwright.atomic_io import write_bytes
from partwright.datasets.poses import mean_rotation
from partwright.datasets.prepared import PreparedFamily, PreparedShape, read_about
from partwright.datasets.preparing import Refused
from partwright.shapes.topology import components, doubled_areas

LEFT_OUT, ODD = "left out", "look at it"
FEWEST = 4  # shapes that tell what is usual
FEW = 20  # shapes: with fewer a model knows these and little else
_USUAL = 0.8  # share of the shapes that have a part, above which one without it is odd
_SPREADS = 4.0  # times the usual spread
_LARGER, _AWAY, _TURNED = 1.6, 0.25, np.radians(50)  # at least: a factor, unit lengths, an angle
_CRUMB = 0.02  # share of a part's area that a piece of it has at least

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Finding:
    """shape: its name, or "" for the whole family. severity: LEFT_OUT or ODD. text: what is the matter."""

    shape: str
    severity: str
    text: str


def check_family(family: PreparedFamily, refused: Iterable[Refused] = ()) -> list[Finding]:
    """What is odd, shape by shape, those that were left out first; nothing where all is well.

    Of each shape: openings that had to be closed, a surface that passes through itself, parts that nearly
    all others have and it has not, in more pieces than is usual, several times as large or small, elsewhere,
    or turned. Of the family: too few shapes, parts that too few have.
    """
    found = [Finding(one.name, LEFT_OUT, one.reason.removeprefix(f"{one.name}: ")) for one in refused]
    if len(family) < FEW:
        found.append(Finding("", ODD, f"{len(family)} shapes are few: the model will know these, and little "
                                      f"between them; {FEW} or more are better"))  # fmt: skip
    shapes = [family.load(i) for i in range(len(family))]
    present = np.array([shape.present.astype(bool) for shape in shapes])
    pieces = np.array([_pieces(shape, len(family.parts)) for shape in shapes])
    odd: list[list[str]] = [_surface(family, i) for i in range(len(shapes))]
    away = np.zeros(len(shapes), dtype=int)
    for p, part in enumerate(family.parts):
        has = np.flatnonzero(present[:, p]).tolist()
        if len(has) < min(FEWEST, len(shapes)):
            text = f"{part} is in {len(has)} of {len(shapes)} shapes, too few to learn it"
            found.append(Finding("", ODD, text))
        if len(has) >= _USUAL * len(shapes):
            for i in np.flatnonzero(~present[:, p]).tolist():
                odd[i].append(f"no {part}, which {len(has)} of {len(shapes)} shapes have")
        if len(has) < FEWEST:
            continue
        for i, count, usual in _unusual(pieces[has, p]):
            word = "pieces" if count != 1 else "piece"
            odd[has[i]].append(f"{part} is in {count} {word}, in most shapes in {usual}")
        for i, text in _sizes(np.stack([shapes[i].scale[p] for i in has]).astype(np.float64)):
            odd[has[i]].append(f"{part} is {text}")
        placed = _places(np.stack([shapes[i].translation[p] for i in has]).astype(np.float64))
        placed += _turns(np.stack([shapes[i].rotation[p] for i in has]).astype(np.float64))
        for i, text in placed:
            odd[has[i]].append(f"{part} {text}")
        away[[has[i] for i in {i for i, _ in placed}]] += 1
    for i, shape in enumerate(shapes):
        if away[i] > max(1, present[i].sum() / 2):
            odd[i].insert(0, "most parts lie elsewhere: it may stand otherwise than the others")
        found += [Finding(shape.name, ODD, text) for text in odd[i]]
    return found


def write_check(path: str | Path, family: PreparedFamily, findings: Sequence[Finding]) -> None:
    """A Markdown table of the findings. Raises OutputError."""
    lines = [f"# {family.name}: {len(family)} shapes of {', '.join(family.parts)}", ""]
    if findings:
        lines += ["| shape | | why |", "|---|---|---|"]
        lines += [f"| {_cell(f.shape) or 'all'} | {f.severity} | {_cell(f.text)} |" for f in findings]
    else:
        lines.append("Nothing stands out.")
    write_bytes(path, ("\n".join(lines) + "\n").encode())


def _cell(text: str) -> str:
    return " ".join(text.replace("|", "\\|").split())


def _surface(family: PreparedFamily, index: int) -> list[str]:
    """What the repair of the whole surface says that is more than tidying."""
    repairs = read_about(family.folder / family.shapes[index].file).get("repairs", [])
    found = [
        f"not watertight: {text}" for text in repairs if text.startswith(("filled", "the surface stays"))
    ]
    return found + [text for text in repairs if text.startswith("the surface passes")]


def _pieces(shape: PreparedShape, parts: int) -> list[int]:
    """In how many pieces each part shows on the surface, crumbs left out."""
    area = doubled_areas(shape.vertices.astype(np.float64), shape.faces)
    counts = []
    for p in range(parts):
        mine = np.flatnonzero(shape.label == p)
        if not len(mine):
            counts.append(0)
            continue
        faces = shape.faces[mine].astype(np.int64)
        piece = components(len(shape.vertices), faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel())
        each = np.bincount(piece[faces[:, 0]], weights=area[mine])
        counts.append(int(np.count_nonzero(each > _CRUMB * area[mine].sum())))
    return counts


def _unusual(counts: NDArray[np.int64]) -> list[tuple[int, int, int]]:
    """(row, count, the usual count) of those that differ from what most have."""
    usual, times = Counter(counts.tolist()).most_common(1)[0]
    if times < _USUAL * len(counts):
        return []
    return [(i, int(n), usual) for i, n in enumerate(counts) if n != usual]


def _sizes(scale: Array) -> list[tuple[int, str]]:
    """Rows of half-lengths (N, 3) that are far from usual along some axis."""
    logs = np.log(scale)
    off = logs - np.median(logs, axis=0)
    beyond = np.abs(off) > np.maximum(np.log(_LARGER), _SPREADS * _spread(np.abs(off)))
    found = []
    for i in np.flatnonzero(beyond.any(axis=1)):
        axis = np.abs(off[i]).argmax()
        factor = float(np.exp(np.abs(off[i, axis])))
        found.append((int(i), f"{factor:.1f} times as {'large' if off[i, axis] > 0 else 'small'} as usual"))
    return found


def _places(translation: Array) -> list[tuple[int, str]]:
    """Rows of places (N, 3) that are far from the middle of all."""
    away = np.linalg.norm(translation - np.median(translation, axis=0), axis=1)
    far = np.flatnonzero(away > np.maximum(_AWAY, _SPREADS * _spread(away)))
    return [(int(i), f"lies {away[i]:.2f} of 1.8 from where it usually does") for i in far]


def _turns(rotation: Array) -> list[tuple[int, str]]:
    """Rows of quaternions (N, 4) that are turned away from the mean of the half that agrees best."""
    near = np.abs(rotation @ mean_rotation(rotation))
    mean = mean_rotation(rotation[near >= np.median(near)])
    angle = 2 * np.arccos(np.clip(np.abs(rotation @ mean), 0, 1))
    far = np.flatnonzero(angle > np.maximum(_TURNED, _SPREADS * _spread(angle)))
    return [(int(i), f"is turned by {np.degrees(angle[i]):.0f} degrees against the others") for i in far]


def _spread(off: Array) -> Array:
    """Of absolute differences from a median, as a standard deviation."""
    return np.asarray(1.4826 * np.median(off, axis=0))
