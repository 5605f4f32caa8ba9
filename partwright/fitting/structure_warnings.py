"""What a user should be told of how an assembly is built: pieces that float, cuts that are filled again."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from partwright.assembly import Assembly, Node, Part
from partwright.rows import crosses, dots
from partwright.shapes import Shape

if TYPE_CHECKING:
    import trimesh

_CRUMB = 1e-5  # of the volume: smaller pieces are rounding
_POINTS, _FEWEST = 4000, 20  # in the box of a cut, and of those in it that tell anything
_FILLED = 0.5  # of what a cut opens, where the shape is empty
_CLEAR = 0.01  # unit lengths: nearer to the shape's surface nothing is said to be empty


def structure_warnings(shape: Shape, assembly: Assembly, surface: trimesh.Trimesh) -> list[str]:
    """surface: of the assembly, in the shape's own units."""
    return [*_floating(shape, surface), *_filled(shape, assembly)]


def _floating(shape: Shape, surface: trimesh.Trimesh) -> Iterator[str]:
    """Where the input is one body, the result should be one."""
    if len(_bodies(np.asarray(shape.vertices), np.asarray(shape.faces))) != 1:
        return
    found = _bodies(np.asarray(surface.vertices), np.asarray(surface.faces))
    _, *loose = sorted(found, key=lambda body: -body[0])
    if not loose:
        return
    total = sum(volume for volume, _ in found)
    volume, middle = loose[0]
    pieces = "a piece floats" if len(loose) == 1 else f"{len(loose)} pieces float, the largest"
    yield (
        f"{pieces} at the {_place(shape, middle)} with {volume / total:.2g} of the volume: the input is one "
        "body; remove the piece, or try --quality high"
    )


def _bodies(vertices: np.ndarray, faces: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """Volume and middle (3,) of each component that encloses some; those of cavities are negative."""
    from partwright.meshing.small_components import components

    count, piece = components(faces, len(vertices))
    own = piece[faces[:, 0]]
    origin = vertices.mean(axis=0)
    a, b, c = (vertices.take(faces[:, k], axis=0) - origin for k in range(3))
    volume = np.bincount(own, dots(a, crosses(b, c)) / 6, minlength=count)
    kept = np.flatnonzero(volume > _CRUMB * np.abs(volume).max(initial=0.0))
    return [(float(volume[k]), (v := vertices[piece == k]).min(axis=0) / 2 + v.max(axis=0) / 2) for k in kept]


def _filled(shape: Shape, assembly: Assembly) -> Iterator[str]:
    """Cuts that open what another part fills, though the shape is empty there."""
    for node in _differences(assembly):
        first, *cuts = node.children
        within = {part.name for part in node.parts}
        others = [part for part in assembly.parts if part.name not in within]
        for i, cut in enumerate(cuts):
            points = _opened(first, cut, np.random.default_rng(i))
            empty = (
                points[shape.unit_distance(shape.frame.to_unit(points)) > _CLEAR] if len(points) else points
            )
            if len(empty) < _FEWEST:
                continue
            filled = empty[assembly.distance(empty) < 0]
            if len(filled) < _FILLED * len(empty):
                continue
            by = max(others, key=lambda part: int((part.distance(filled) < 0).sum()), default=None)
            whose = f" by {by.name!r}" if by is not None else ""
            name = cut.name or cut.parts[0].name
            yield (
                f"{len(filled) / len(empty):.0%} of what {name!r} takes away is filled again{whose}, at the "
                f"{_place(shape, filled.mean(axis=0))}, where the input is empty"
            )


def _differences(node: Node) -> Iterator[Assembly]:
    if isinstance(node, Part):
        return
    if node.operation == "difference":
        yield node
    for child in node.children:
        yield from _differences(child)


def _opened(first: Node, cut: Node, rng: np.random.Generator) -> np.ndarray:
    """(N, 3) points of the first that the cut takes away."""
    low, high = first.bounds()
    near, far = cut.bounds()
    low, high = np.maximum(low, near), np.minimum(high, far)
    if not (np.isfinite([low, high]).all() and (high > low).all()):
        return np.empty((0, 3))
    points = rng.uniform(low, high, (_POINTS, 3))
    return points[(first.distance(points) < 0) & (cut.distance(points) < 0)]


def _place(shape: Shape, point: np.ndarray) -> str:
    from partwright.metrics.deviation import place_in

    return place_in(shape, shape.frame.to_unit(point))
