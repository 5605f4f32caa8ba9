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
from partwright.datasets.family_names import FEWEST, USUAL, copied_names, missing, rare_parts
from partwright.datasets.poses import mean_rotation
from partwright.datasets.prepared import PreparedFamily, PreparedShape, read_about
from partwright.datasets.preparing import Refused
from partwright.shapes.topology import components, doubled_areas

LEFT_OUT, ODD = "left out", "look at it"
FEW = 20  # shapes: with fewer a model knows these and little else
_SPREADS = 4.0  # times the usual spread
_LARGER, _AWAY, _TURNED = 1.6, 0.25, np.radians(50)  # at least: a factor, unit lengths, an angle
_UNITS = 8.0  # times as small, from which units are suspected: of cm among mm 10, of mm among inches 25
_CRUMB = 0.02  # share of a part's area that a piece of it has at least

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Oddity:
    """Of a part of a shape. text: what is the matter, with {is}, {lies} and {value} to be filled in; where
    it has {parts}, all of the line; value: a number that it is odd by, as it is `written`."""

    part: str
    text: str
    value: float = 0.0
    written: str = "{}"


@dataclass(frozen=True)
class Finding:
    """shape: its name, or "" for the whole family. severity: LEFT_OUT or ODD. text: what is the matter."""

    shape: str
    severity: str
    text: str


def check_family(family: PreparedFamily, refused: Iterable[Refused] = ()) -> list[Finding]:
    """What is odd, shape by shape, those that were left out first; nothing where all is well.

    Of the family: too few shapes, parts that too few have. Of each shape: names that look like a copy's of
    another part's, parts in other length units, openings that had to be closed, a surface that passes through
    itself, parts that nearly all others have, or that come with others of its parts, and it has not, in more
    pieces than is usual, several times as large or small, elsewhere, or turned.
    """
    found = [Finding(one.name, LEFT_OUT, one.reason.removeprefix(f"{one.name}: ")) for one in refused]
    if len(family) < FEW:
        found.append(Finding("", ODD, f"{len(family)} shapes are few: the model will know these, and little "
                                      f"between them; {FEW} or more are better"))  # fmt: skip
    shapes = [family.load(i) for i in range(len(family))]
    names = [shape.name for shape in shapes]
    present = np.array([shape.present.astype(bool) for shape in shapes])
    pieces = np.array([_pieces(shape, len(family.parts)) for shape in shapes])
    found += [Finding("", ODD, text) for text in rare_parts(family.parts, names, present)]
    odd: list[list[Oddity]] = [[] for _ in shapes]
    notes = [_surface(family, i) for i in range(len(shapes))]
    away = np.zeros(len(shapes), dtype=int)
    for p, part in enumerate(family.parts):
        has = np.flatnonzero(present[:, p]).tolist()
        for i, text in missing(family.parts, present, p):
            odd[i].append(Oddity(part, text))
        if len(has) < FEWEST:
            continue
        for i, count, usual in _unusual(pieces[has, p]):
            word = "pieces" if count != 1 else "piece"
            odd[has[i]].append(Oddity(part, f"{{is}} in {count} {word}, in most shapes in {usual}"))
        for i, larger, factor in _sizes(np.stack([shapes[i].scale[p] for i in has]).astype(np.float64)):
            text = f"{{is}} {{value}} times as {'large' if larger else 'small'} as usual"
            odd[has[i]].append(Oddity(part, text, factor, "{:.1f}"))
        placed = _places(np.stack([shapes[i].translation[p] for i in has]).astype(np.float64))
        for i, far in placed:
            text = "{lies} {value} of 1.8 from the usual place"
            odd[has[i]].append(Oddity(part, text, far, "{:.2f}"))
        turned = _turns(np.stack([shapes[i].rotation[p] for i in has]).astype(np.float64))
        for i, degrees in turned:
            text = "{is} turned by {value} degrees against the others"
            odd[has[i]].append(Oddity(part, text, degrees, "{:.0f}"))
        away[[has[i] for i in {i for i, _ in placed + turned}]] += 1
    for i, name in enumerate(names):
        told = copied_names(family.parts, present, i) + notes[i] + in_lines(odd[i])
        if shrunk := sum("times as small" in one.text and one.value > _UNITS for one in odd[i]):
            if shrunk > max(1, present[i].sum() / 2):
                told.insert(0, "most parts are much too small for it: others may be in another length unit")
        elif away[i] > max(1, present[i].sum() / 2):
            told.insert(0, "most parts lie elsewhere: it may stand otherwise than the others")
        found += [Finding(name, ODD, text) for text in told]
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


def in_lines(odd: Sequence[Oddity]) -> list[str]:
    """One line for all parts of a shape that the same is the matter with."""
    alike: dict[str, list[Oddity]] = {}
    for one in odd:
        alike.setdefault(one.text, []).append(one)
    lines = []
    for text, group in alike.items():
        parts, many = ", ".join(one.part for one in group), len(group) > 1
        values = [one.written.format(one.value) for one in sorted(group, key=lambda one: one.value)]
        value = values[0] if values[0] == values[-1] else f"{values[0]} to {values[-1]}"
        words = {"is": "are" if many else "is", "lies": "lie" if many else "lies", "value": value}
        line = text if "{parts}" in text else f"{{parts}} {text}"
        for word, said in {**words, "parts": parts}.items():  # not by `format`: names may have braces
            line = line.replace(f"{{{word}}}", said)
        lines.append(line)
    return lines


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
    if times < USUAL * len(counts):
        return []
    return [(i, int(n), usual) for i, n in enumerate(counts) if n != usual]


def _sizes(scale: Array) -> list[tuple[int, bool, float]]:
    """Rows of half-lengths (N, 3) that are far from usual along some axis; whether larger, and how many
    times."""
    logs = np.log(scale)
    off = logs - np.median(logs, axis=0)
    beyond = np.abs(off) > np.maximum(np.log(_LARGER), _SPREADS * _spread(np.abs(off)))
    found = []
    for i in np.flatnonzero(beyond.any(axis=1)).tolist():
        axis = np.abs(off[i]).argmax()
        found.append((i, bool(off[i, axis] > 0), float(np.exp(np.abs(off[i, axis])))))
    return found


def _places(translation: Array) -> list[tuple[int, float]]:
    """Rows of places (N, 3) that are far from the middle of all, and how far."""
    away = np.linalg.norm(translation - np.median(translation, axis=0), axis=1)
    far = np.flatnonzero(away > np.maximum(_AWAY, _SPREADS * _spread(away)))
    return [(i, float(away[i])) for i in far.tolist()]


def _turns(rotation: Array) -> list[tuple[int, float]]:
    """Rows of quaternions (N, 4) that are turned away from the mean of the half that agrees best, and by how
    many degrees."""
    near = np.abs(rotation @ mean_rotation(rotation))
    mean = mean_rotation(rotation[near >= np.median(near)])
    angle = 2 * np.arccos(np.clip(np.abs(rotation @ mean), 0, 1))
    far = np.flatnonzero(angle > np.maximum(_TURNED, _SPREADS * _spread(angle)))
    return [(i, float(np.degrees(angle[i]))) for i in far.tolist()]


def _spread(off: Array) -> Array:
    """Of absolute differences from a median, as a standard deviation."""
    return np.asarray(1.4826 * np.median(off, axis=0))
