"""Faces labelled by the part that stands for them (SuperFrusta, section 5)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from partwright.assembly import Assembly
from partwright.errors import SettingError
from partwright.shapes import Shape

_SAMPLE_SPACING = 0.02  # of the shape's longest side: a face's samples are about this far apart,
_FINEST = 16  # but none has more than the square of this
_SAME = 1e-6  # of the longest side: parts that are this much alike in distance are equally near
_CHUNK = 1 << 16  # samples at once, so that many parts times many faces fit into memory


def segment(
    shape: Shape, assembly: Assembly, within: Sequence[str] | Sequence[int] | NDArray | None = None
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Labels (F,) of `shape.input_faces`, and the labels' names: the part of the nearest surface.

    A face is sampled evenly, large faces more often. Each sample votes for the part whose own surface,
    without blends, is nearest; the most votes win, then the smaller mean distance, then the earlier part. The
    wall of a hole belongs to the part that cuts it. Without `within`, names are those of all leaves, and
    label i is leaf i, also where no face has it.

    within: one coarse label a face, strings or integers. Sub-parts never cross them: every label is then a
    pair "COARSE/PART", and only pairs that occur are listed, in the order of coarse labels and of parts.
    Where the assembly joins groups, as fits by node do, and one has a coarse label's name, only its parts
    stand for those faces.

    Raises:
        SettingError: `within` has another length than the shape has faces, or holds no strings or integers.
    """
    return segment_faces(shape.input_vertices, shape.input_faces, assembly, within)


def segment_faces(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    assembly: Assembly,
    within: Sequence[str] | Sequence[int] | NDArray | None = None,
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """`segment` of triangles, in the assembly's units and place."""
    labels, paths = segment_paths(vertices, faces, assembly, within)
    return labels, tuple("/".join(path) for path in paths)


def segment_paths(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    assembly: Assembly,
    within: Sequence[str] | Sequence[int] | NDArray | None = None,
) -> tuple[NDArray[np.int64], list[tuple[str, ...]]]:
    """`segment_faces` with each name as a path: (PART,), or (COARSE, PART)."""
    names = [part.name for part in assembly.parts]
    if within is None:
        whole, every = np.zeros(len(faces), np.int64), np.ones((1, len(names)), bool)
        return _nearest_part(vertices, faces, assembly, whole, every), [(name,) for name in names]
    coarse_names, coarse = np.unique(check_within(within, len(faces)), return_inverse=True)
    allowed = _allowed(assembly, [str(name) for name in coarse_names])
    labels = _nearest_part(vertices, faces, assembly, coarse, allowed)
    pairs, crossed = np.unique(coarse * len(names) + labels, return_inverse=True)
    paths: list[tuple[str, ...]] = [
        (str(coarse_names[pair // len(names)]), names[pair % len(names)]) for pair in pairs
    ]
    divided: NDArray[np.int64] = crossed.astype(np.int64)
    return divided, paths


def node_labels(shape: Shape) -> list[str]:
    """The name of its node for each of `shape.input_faces`: a coarse segmentation that scenes bring along."""
    return [node.name for node in shape.nodes for _ in range(node.start, node.stop)]


def check_within(within: Sequence[str] | Sequence[int] | NDArray, faces: int) -> NDArray:
    """Labels as an array (F,), one a face.

    Raises:
        SettingError: their number is another, or they are no strings or integers.
    """
    coarse = np.asarray(within)
    if coarse.ndim != 1 or coarse.dtype.kind not in "iuU":
        raise SettingError(
            f"within: got {coarse.dtype} of shape {coarse.shape}; expected one string or integer a face"
        )
    if len(coarse) != faces:
        raise SettingError(f"within: got {len(coarse)} labels; the shape has {faces} faces, one label each")
    return coarse


def _allowed(assembly: Assembly, labels: Sequence[str]) -> NDArray[np.bool_]:
    """(C, M) which parts may stand for faces of each label: those of the group of its name, else all."""
    every = {part.name for part in assembly.parts}
    groups = {
        child.name: {part.name for part in child.parts} for child in assembly.children if not child.is_part
    }
    own = [groups.get(label, every) for label in labels]
    return np.array([[part.name in names for part in assembly.parts] for names in own])


def _nearest_part(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    assembly: Assembly,
    coarse: NDArray[np.int64],
    allowed: NDArray[np.bool_],
) -> NDArray[np.int64]:
    """(F,) of those parts that are allowed (C, M) for a face's coarse label (F,)."""
    corners = vertices[faces]
    longest = float(np.ptp(corners, axis=(0, 1)).max())
    edge = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    level = np.clip(np.ceil(edge / (_SAMPLE_SPACING * longest)), 2, _FINEST).astype(int)
    labels = np.empty(len(corners), dtype=np.int64)
    for n in np.unique(level):
        barycentric = _subdivision(int(n))
        members = np.flatnonzero(level == n)
        for chunk in np.array_split(members, -(-len(members) * len(barycentric) // _CHUNK)):
            points = np.einsum("sk,fkx->fsx", barycentric, corners[chunk])
            away = np.abs(assembly.part_distances(points.reshape(-1, 3)))
            away = away.reshape(len(assembly), *points.shape[:2])
            own = allowed[coarse[chunk]].T[:, :, None]
            labels[chunk] = _elected(np.where(own, away, np.inf), _SAME * longest)
    return labels


def _elected(away: NDArray, same: float) -> NDArray[np.int64]:
    """(F,) the winning part of distances (M, F, S)."""
    votes = (away <= away.min(axis=0) + same).mean(axis=2)
    leading = votes >= votes.max(axis=0) - 1e-9
    mean = np.where(leading, away.mean(axis=2), np.inf)
    return np.argmax(mean <= mean.min(axis=0) + same, axis=0)


def _subdivision(n: int) -> NDArray[np.float64]:
    """(n^2, 3) barycentric coordinates of the centres of the n^2 equal triangles of a triangle."""
    up = [(i + 1 / 3, j + 1 / 3) for i in range(n) for j in range(n - i)]
    down = [(i + 2 / 3, j + 2 / 3) for i in range(n - 1) for j in range(n - 1 - i)]
    first = np.array(up + down) / n
    return np.column_stack([first, 1 - first.sum(axis=1)])
