"""Fits of what has screw threads: they are taken out before, and said of the parts that stand for them."""

from __future__ import annotations

import dataclasses
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import count
from typing import Any

import numpy as np
from manifold3d import Manifold, Mesh

from partwright.approximation.sketches.threads import Thread, without_threads
from partwright.assembly import Assembly, Part
from partwright.assembly.metadata import THREAD, thread_key
from partwright.meshing.manifolds import surface_of
from partwright.methods import Fitted
from partwright.shapes import Shape, length_text, load_shape
from partwright.superfrusta.thread_standards import standard_thread

_NEAR = 0.08  # of the thread's depth, that a part's wall may be away from its crests
_ALONG, _AROUND = 7, 8  # places that are looked at
_DIGITS = 4
_TOLD_APART = "_kind", "_hand", "_diameter", "_pitch", "_length"  # by which threads of a part are told apart
_ALIKE = 0.03  # of a number, by which it is measured differently on threads that are alike


def plain_shape(shape: Shape) -> tuple[Shape, list[Thread]]:
    """The shape without its threads, and these in its own units; itself where it has none."""
    vertices, faces = shape.unit_mesh
    closed = Manifold(Mesh(vertices.astype(np.float32), faces.astype(np.uint32)))
    body, threads = without_threads(closed)
    if not threads:
        return shape, []
    corners, triangles = surface_of(body)
    plain = load_shape((shape.frame.from_unit(corners), triangles), shape.unit, shape.up)
    plain.name = shape.name
    return plain, [_in_own_units(thread, shape) for thread in threads]


def _in_own_units(thread: Thread, shape: Shape) -> Thread:
    scale = shape.frame.scale
    return dataclasses.replace(
        thread,
        axis=shape.frame.from_unit(thread.axis[None])[0],
        pitch=thread.pitch / scale,
        inner=thread.inner / scale,
        outer=thread.outer / scale,
        length=thread.length / scale,
    )


def with_threads(fitted: Fitted, threads: Sequence[Thread]) -> Fitted:
    """The fit with metadata of parts whose walls are the crests of threads, and a line for those of a part
    that are alike."""
    whole = fitted.assembly
    counts: Counter[str] = Counter()
    for thread in threads:
        part = _wall(whole, thread)
        said = description(thread, whole.unit)
        kind, depth = f"{said['thread_kind']} thread {said['thread']}", thread.outer - thread.inner
        counts[
            f"{part.name if part is not None else fitted.assembly.name}: {kind}, drawn plain, as wide as its "
            f"crests: its grooves, {length_text(depth, whole.unit, 2)} deep, count as deviation"
        ] += 1
        if part is not None:
            noted = dataclasses.replace(part, metadata=_noted(part.metadata, said))
            whole = whole.replace_part(part.name, noted)
    lines = [f"{line} ({count} times)" if count > 1 else line for line, count in counts.items()]
    return dataclasses.replace(fitted, assembly=whole, warnings=(*fitted.warnings, *lines))


def _noted(metadata: Mapping[str, Any], said: Mapping[str, str | float]) -> dict[str, Any]:
    """With what is said of a thread: under `thread_2` and so on where there is another on the part already,
    as at the ends of a stud, but not where one is like it, as in holes that are copies."""
    for key in map(thread_key, count(1)):
        own = {key + name.removeprefix(THREAD): value for name, value in said.items()}
        if key not in metadata:
            return {**metadata, **own}
        if all(_is_like(metadata.get(key + end), own[key + end]) for end in _TOLD_APART):
            break
    return dict(metadata)


def _is_like(one: object, other: str | float) -> bool:
    if isinstance(one, float) and isinstance(other, float):
        return abs(one - other) <= _ALIKE * abs(other)
    return one == other


def description(thread: Thread, unit: str | None) -> dict[str, str | float]:
    """What a drawing says of a thread: `thread` (its standard name, or diameter x pitch), `thread_kind`
    (external or internal), `thread_hand`; `thread_diameter`, `thread_pitch`, `thread_length` in own units."""
    diameter, pitch = _rounded(2 * thread.outer), _rounded(abs(thread.pitch))
    name = standard_thread(2 * thread.outer, abs(thread.pitch), unit)
    return {
        "thread": name or f"{diameter:g} x {pitch:g}",
        "thread_kind": "internal" if thread.internal else "external",
        "thread_diameter": diameter,
        "thread_pitch": pitch,
        "thread_length": _rounded(thread.length),
        "thread_hand": "left" if thread.pitch < 0 else "right",
    }


def _wall(whole: Assembly, thread: Thread) -> Part | None:
    """The smallest part whose surface is at the crests, if there is one."""
    crest = thread.inner if thread.internal else thread.outer
    x, y, z, middle = thread.frame.T
    turns = 2 * math.pi * np.arange(_AROUND)[:, None] / _AROUND
    ring = crest * (np.cos(turns) * x + np.sin(turns) * y)
    along = thread.length * np.linspace(-0.3, 0.3, _ALONG)[:, None, None] * z
    points = (middle + along + ring).reshape(-1, 3)
    most = max(_NEAR * (thread.outer - thread.inner), 1e-3 * thread.outer)
    walls = [part for part in whole.parts if float(np.median(np.abs(part.distance(points)))) < most]
    return min(walls, key=lambda part: float(np.prod(np.ptp(part.bounds(), axis=0))), default=None)


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")
