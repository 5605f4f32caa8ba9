"""An assembly as a text to read: the tree of operations, and each leaf in words and numbers."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly.instance_patterns import Circle, Grid, Line, pattern
from partwright.assembly.metadata import GUESSED, thread_names
from partwright.assembly.placed import placed_quadric
from partwright.assembly.profile_numbers import profile_numbers
from partwright.assembly.repeated_groups import children_once
from partwright.fields import Field, NormalForm, Profile, normal_form
from partwright.fields.extrusion import RIMS

if TYPE_CHECKING:
    from partwright.assembly.tree import Node, Part

_LONG_NAME = 24  # characters, from which on a name is a hash and its beginning is enough
_MAX_CORNERS = 12  # of a path that are printed
_MAX_NUMBERS = 6  # of one parameter that are printed


def describe(node: Node, digits: int = 4) -> str:
    """The tree, a line a node; numbers have this many digits."""
    return "\n".join(_lines(node, digits, "", ""))


def _lines(node: Node, digits: int, first: str, rest: str) -> Iterator[str]:
    if node.is_part:
        yield first + _leaf(node, digits)
        return
    blend = f", blend {_number(node.blend, digits)}" if node.blend else ""
    yield f"{first}{node.operation}{' ' + node.name if node.name else ''}{blend}"
    shown = children_once(node)
    for i, (child, moves) in enumerate(shown):
        last = i == len(shown) - 1
        sign = "- " if node.operation == "difference" and i else ""
        said = _lines(
            child, digits, rest + ("└─ " if last else "├─ ") + sign, rest + ("   " if last else "│  ")
        )
        if moves:
            images = sum(move.mirror for move in moves)
            yield f"{next(said)}, {len(moves) + 1} times" + (f", {images} mirrored" if images else "")
        yield from said


def _leaf(part: Part, digits: int) -> str:
    quadric = placed_quadric(part)
    if quadric is not None:
        own = _quadric(normal_form(quadric), digits)
    else:
        shown = {f.name: getattr(part.field, f.name) for f in dataclasses.fields(part.field) if f.repr}  # type: ignore[arg-type]
        numbers = [f"{k} {_value(value, digits)}" for k, value in shown.items() if value or k not in RIMS]
        if "profile" in shown:
            numbers[1:1] = _profile(part.field, digits)
        own = " ".join([part.field.kind, ", ".join(numbers), f"at {_numbers(part.translation, digits)}"])
    copies = f", {_copies(part, digits)}" if part.instances else ""
    blend = f", blend {_number(part.blend, digits)}" if part.blend else ""
    thread = "".join(f", thread {name}" for name in thread_names(part.metadata))
    guess = ", a guess" if GUESSED in part.metadata else ""
    return f"{part.name + ': ' if part.name else ''}{own}{thread}{copies}{blend}{guess}"


def _profile(field: Field, digits: int) -> list[str]:
    """The numbers of a profile, those that are counted in a row."""
    rows: dict[str, list[float]] = {}
    for name, value in profile_numbers(field).items():
        rows.setdefault(name.rpartition(".")[0], []).append(value)
    rows.pop("profile.radius", None)  # half the diameters
    return [f"{name} {_value(tuple(values), digits)}" for name, values in rows.items()]


def _copies(part: Part, digits: int) -> str:
    found = pattern(part)
    if isinstance(found, Circle):
        circle, at = _number(found.diameter, digits), _numbers(found.centre, digits)
        return f"{found.count} copies on a circle of {circle} about {at}"
    if isinstance(found, Line):
        return f"{found.count} copies, each {_numbers(found.step, digits)} from the last"
    if isinstance(found, Grid):
        rows = [(n, step) for n, step in zip(found.count, found.spacing, strict=True) if n > 1]
        counts = " x ".join(str(n) for n, _ in rows)
        return f"{counts} copies, {' x '.join(_number(step, digits) for _, step in rows)} apart"
    return f"{len(part.copies)} copies"


def _quadric(form: NormalForm, digits: int) -> str:
    """Of a plane its normal and offset; of the others the radii that they have, the centre and the axis."""
    w = form.axes[:, 2]
    if form.name == "plane":
        normal = -w if form.complement else w
        return f"plane {_numbers(normal, digits)} . p <= {_number(float(normal @ form.centre), digits)}"
    outside = "outside of " if form.complement else ""
    radii = form.radii[:1] if form.round and form.level else form.radii
    radii = radii[np.isfinite(radii) & (radii > 0)]
    size = f" radius {_numbers(radii, digits)}," if len(radii) and form.level else ""
    if form.name == "cone":
        size = f" slope {_number(form.widening, digits)},"
    axis = "" if form.name == "sphere" else f", axis {_numbers(w, digits)}"
    return f"{outside}{form.name}{size} centre {_numbers(form.centre, digits)}{axis}"


def _value(value: object, digits: int) -> str:
    """Names as they are, hashes by their beginning; of a long row of numbers only its length."""
    if isinstance(value, str):
        return value if len(value) < _LONG_NAME else f"{value[:12]}..."
    if isinstance(value, tuple) and isinstance(value[0], tuple):
        return _path(value, digits)
    if isinstance(value, tuple) and len(value) > _MAX_NUMBERS:
        return f"of {len(value)} numbers"
    if isinstance(value, Profile):
        return str(value)
    return _numbers(value, digits)


def _path(corners: tuple[tuple[float, ...], ...], digits: int) -> str:
    """Of a pipe's corners each with its bend; of a long row of them only how many."""
    if len(corners) > _MAX_CORNERS:
        return f"of {len(corners)} corners"
    bends = (f" bend {_number(bend, digits)}" if bend else "" for *_, bend in corners)
    return " to ".join(f"{_numbers(c[:3], digits)}{bend}" for c, bend in zip(corners, bends, strict=True))


def _numbers(values: object, digits: int) -> str:
    given = np.atleast_1d(np.asarray(values, dtype=np.float64)).tolist()
    text = [_number(value, digits) for value in given]
    return text[0] if len(text) == 1 else f"({', '.join(text)})"


def _number(value: float, digits: int) -> str:
    return f"{0.0 if abs(value) < 1e-12 else value:.{digits}g}"
