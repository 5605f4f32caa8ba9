"""Which shapes of a prepared family will be trouble to learn from, and why: what stands out from the others.

A part is compared with the same part of the other shapes, by medians, which a few odd shapes do not move.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from partwright.atomic_io import write_bytes
from partwright.datasets.family_names import FEWEST, USUAL, copied_names, missing, rare_parts
from partwright.datasets.poses import Poses, mean_rotation
from partwright.datasets.prepared import PreparedFamily, PreparedShape, read_about
from partwright.datasets.preparing import Refused
from partwright.shapes.topology import components, doubled_areas

LEFT_OUT, ODD = "left out", "look at it"
FEW = 20  # shapes: with fewer a model knows these and little else
_SPREADS = 4.0  # times the usual spread
_LARGER, _AWAY, _TURNED = 1.6, 0.25, np.radians(50)  # at least: a factor, unit lengths, an angle
_UNITS = 6.0  # times as small along all axes: of mm among cm it is 10, less as shapes differ
_CRUMB = 0.02  # share of a part's area that a piece of it has at least

Array = NDArray[np.float64]


class _Kind(Enum):
    SHRUNK = auto()  # along all axes, as by another length unit
    ELSEWHERE = auto()  # or turned
    OTHER = auto()


@dataclass(frozen=True)
class _Oddity:
    """Of a part of a shape. text: what is the matter, with {is}, {lies} and {value} to be filled in; where
    it has {parts}, all of the line; value: a number that it is odd by, as it is `written`."""

    part: str
    text: str
    value: float = 0.0
    written: str = "{}"
    kind: _Kind = _Kind.OTHER


@dataclass(frozen=True)
class Finding:
    """shape: its name, or "" for the whole family. severity: LEFT_OUT or ODD. text: what is the matter."""

    shape: str
    severity: str
    text: str


def check_family(family: PreparedFamily, refused: Iterable[Refused] = ()) -> list[Finding]:
    """What is odd, shape by shape, those that were left out first; nothing where all is well.

    Of the family: too few shapes, parts that too few have. Of each shape: names that look like a copy's of
    another part's, parts in other length units, openings that had to be closed, what of its files was not
    read, a surface that passes through itself, parts that nearly all others have, or that come with others
    of its parts, and it has not, in more pieces than is usual, several times as large or small, elsewhere,
    or turned.
    """
    found = [Finding(one.name, LEFT_OUT, one.reason.removeprefix(f"{one.name}: ")) for one in refused]
    if len(family) < FEW:
        found.append(Finding("", ODD, f"{len(family)} shapes are few: the model will know these, and little "
                                      f"between them; {FEW} or more are better"))  # fmt: skip
    shapes = [family.load(i) for i in range(len(family))]
    names = [shape.name for shape in shapes]
    present = np.array([shape.present.astype(bool) for shape in shapes])
    found += [Finding("", ODD, text) for text in rare_parts(family.parts, names, present)]
    for i, odd in enumerate(_oddities(family.parts, shapes, present)):
        told = _of_most(odd, int(present[i].sum())) + copied_names(family.parts, present, i)
        told += _surface(family, i) + _in_lines(odd)
        found += [Finding(names[i], ODD, text) for text in told]
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


def _oddities(
    parts: Sequence[str], shapes: Sequence[PreparedShape], present: NDArray[np.bool_]
) -> list[list[_Oddity]]:
    """Of each shape, part by part. present (S, P): which parts they have."""
    odd: list[list[_Oddity]] = [[] for _ in shapes]
    pieces = np.array([_pieces(shape, len(parts)) for shape in shapes])
    for p, part in enumerate(parts):
        for i, text in missing(parts, present, p):
            odd[i].append(_Oddity(part, text))
        has = np.flatnonzero(present[:, p]).tolist()
        if len(has) < FEWEST:
            continue
        poses = [shapes[i].poses for i in has]
        for row, one in [*_in_pieces(part, pieces[has, p]), *_by_pose(part, p, poses)]:
            odd[has[row]].append(one)
    return odd


def _in_pieces(part: str, counts: NDArray[np.int64]) -> Iterator[tuple[int, _Oddity]]:
    for row, count, usual in _unusual(counts):
        word = "pieces" if count != 1 else "piece"
        yield row, _Oddity(part, f"{{is}} in {count} {word}, in most shapes in {usual}")


def _by_pose(part: str, number: int, poses: Sequence[Poses]) -> Iterator[tuple[int, _Oddity]]:
    """number: of the part; poses: of each shape that has it."""

    def rows(name: str) -> Array:
        return np.stack([getattr(one, name)[number] for one in poses]).astype(np.float64)

    for row, larger, factor, kind in _sizes(rows("scale")):
        text = f"{{is}} {{value}} times as {'large' if larger else 'small'} as usual"
        yield row, _Oddity(part, text, factor, "{:.1f}", kind)
    for row, far in _places(rows("translation")):
        text = "{lies} {value} of 1.8 from the usual place"
        yield row, _Oddity(part, text, far, "{:.2f}", _Kind.ELSEWHERE)
    for row, degrees in _turns(rows("rotation")):
        text = "{is} turned by {value} degrees against the others"
        yield row, _Oddity(part, text, degrees, "{:.0f}", _Kind.ELSEWHERE)


def _of_most(odd: Sequence[_Oddity], parts: int) -> list[str]:
    """A line on what is the matter with more than half of a shape's parts, and so with the shape."""
    half = max(1, parts / 2)

    def many(kind: _Kind) -> bool:
        return len({one.part for one in odd if one.kind is kind}) > half

    if many(_Kind.SHRUNK):
        return ["most of its parts are many times too small against the rest: they may be in another length "
                "unit"]  # fmt: skip
    if many(_Kind.ELSEWHERE):
        return ["most parts lie elsewhere: it may stand otherwise than the others"]
    return []


def _in_lines(odd: Sequence[_Oddity]) -> list[str]:
    """One line for all parts of a shape that the same is the matter with."""
    alike: dict[str, list[_Oddity]] = {}
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
    """What the repair of the whole surface says that is more than tidying, and what was not read of it."""
    about = read_about(family.folder / family.shapes[index].file)
    repairs = about.get("repairs", [])
    found = [
        f"not watertight: {text}" for text in repairs if text.startswith(("filled", "the surface stays"))
    ]
    found += [text for text in repairs if text.startswith("the surface passes")]
    return found + about.get("unread", [])


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


def _sizes(scale: Array) -> list[tuple[int, bool, float, _Kind]]:
    """Rows of half-lengths (N, 3) that are far from usual along some axis; whether larger, how many times,
    and SHRUNK where it is much smaller along all axes."""
    logs = np.log(scale)
    off = logs - np.median(logs, axis=0)
    beyond = np.abs(off) > np.maximum(np.log(_LARGER), _SPREADS * _spread(np.abs(off)))
    shrunk = (off < -np.log(_UNITS)).all(axis=1)
    found = []
    for i in np.flatnonzero(beyond.any(axis=1)).tolist():
        axis = np.abs(off[i]).argmax()
        kind = _Kind.SHRUNK if shrunk[i] else _Kind.OTHER
        found.append((i, bool(off[i, axis] > 0), float(np.exp(np.abs(off[i, axis]))), kind))
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
