"""The whole surface of a parted shape by parts, and samples around it (PartSDF, appendix B.4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from partwright.datasets.inputs import PartedShape
from partwright.errors import FamilyError
from partwright.shapes import MeshDistance, Shape
from partwright.shapes.sampling import morton_order, near_surface, sample_triangles
from partwright.shapes.source import Piece, Source

NEAR_SIGMA = (0.005**0.5, 0.0005**0.5)  # unit lengths: the paper's variances 0.005 and 0.0005
NEAR_SHARE = 0.95  # of the samples; the rest is uniform in [-1, 1]^3
_LOOSE = 0.01  # unit lengths beyond the whole, of a part that is not in it
_APART = 0.05  # unit lengths that the whole's surface may lie off its parts


@dataclass(frozen=True)
class LabelledShape:
    """A repaired whole and the part (F,) of each of its faces, as numbers of the family's parts.

    vertices: (V, 3) of each part that it has, by number, unit frame.
    """

    shape: Shape
    label: NDArray[np.int8]
    vertices: dict[int, NDArray[np.float64]]


def label_surface(parted: PartedShape, parts: Sequence[str]) -> LabelledShape:
    """Repair the whole and give each face the part that is nearest to its middle.

    So parts may be open, and what lies hidden where they overlap has no say (PartSDF, section 3.3).

    Raises what `load_shape` raises, and FamilyError for a part that is not among `parts`, one that lies
    wholly inside the others or bounds nothing, or a whole that reaches far beyond its parts.
    """
    strange = [name for name in parted.parts if name not in parts]
    if strange:
        raise FamilyError(
            f"{parted.name}: has {', '.join(strange)}, which the family has not ({', '.join(parts)}); "
            "rename or leave it out"
        )
    shape = Shape(Source(parted.name, parted.whole))
    numbers = {parts.index(name): piece for name, piece in parted.parts.items()}
    label, distance = _nearest_part(shape, numbers)
    if distance.max() > _APART:
        raise FamilyError(
            f"{parted.name}: the whole's surface lies up to {distance.max():.2f} of 1.8 off all parts; give "
            "every part, in the same place and units as the whole"
        )
    for number, piece in numbers.items():
        if not (label == number).any():
            raise FamilyError(f"{parted.name}: {parts[number]} {_why_hidden(shape, piece)}")
    vertices = {number: shape.frame.to_unit(_used(piece)) for number, piece in numbers.items()}
    return LabelledShape(shape, label, vertices)


def sample(
    labelled: LabelledShape, count: int, seed: int
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int8]]:
    """`count` points (N, 3) in any order, their signed distance (N,) and nearest part (N,) (eq. 5).

    95 % are surface points moved by Gaussian noise of variance 0.005 or 0.0005, half of them each; the rest
    is uniform in [-1, 1]^3. The nearest part is that of the nearest triangle, so one query answers both.
    """
    seeds = np.random.SeedSequence(seed).generate_state(4)
    near = round(NEAR_SHARE * count)
    shape = labelled.shape
    surface, _ = sample_triangles(shape.frame.to_unit(shape.vertices), shape.faces, near, int(seeds[0]))
    close = near_surface(surface.astype(np.float32), NEAR_SIGMA, int(seeds[1]))
    around = np.random.default_rng(seeds[2]).uniform(-1, 1, (count - near, 3)).astype(np.float32)
    points = np.concatenate([close, around])
    points = points[morton_order(points)]  # neighbours ask the same branches of the tree
    distance, triangle = shape.unit_nearest(points)
    order = np.random.default_rng(seeds[3]).permutation(count)  # so that any run of rows is a fair subset
    return points[order], distance[order].astype(np.float32), labelled.label[triangle[order]]


def _nearest_part(shape: Shape, parts: dict[int, Piece]) -> tuple[NDArray[np.int8], NDArray[np.float32]]:
    """Part (F,) nearest to the middle of each of the shape's faces, and how far away it is, unit frame."""
    pieces = list(parts.values())
    offsets = np.cumsum([0] + [len(p.vertices) for p in pieces])[:-1]
    vertices = shape.frame.to_unit(np.concatenate([p.vertices for p in pieces]))
    faces = np.concatenate([p.faces + o for p, o in zip(pieces, offsets, strict=True)])
    owner = np.repeat(np.array(list(parts), dtype=np.int8), [len(p.faces) for p in pieces])
    source = MeshDistance(vertices, faces, faces, closed=False)
    middle = shape.frame.to_unit(_middles(shape))
    triangle, distance = source.nearest(middle)
    return owner[triangle], distance


def _why_hidden(shape: Shape, piece: Piece) -> str:
    """Of a part that none of the whole's surface is nearest to."""
    outside, _ = shape.unit_nearest(shape.frame.to_unit(_middles(piece)).astype(np.float32))
    if outside.max() > _LOOSE:  # what bounds nothing is no part of the repaired whole
        return "is an open surface that bounds nothing, as a sheet does; close it or give it a thickness"
    return (
        "lies wholly inside the other parts, so none of the surface is its own; move it out or leave it out"
    )


def _middles(mesh: Piece | Shape) -> NDArray[np.float64]:
    """(F, 3) of the faces."""
    return np.asarray(mesh.vertices[mesh.faces].mean(axis=1))


def _used(piece: Piece) -> NDArray[np.float64]:
    """The vertices (U, 3) that faces use."""
    return piece.vertices[np.unique(piece.faces)]
