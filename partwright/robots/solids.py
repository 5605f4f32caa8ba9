"""Meshes of robots as closed solids: as they are where they close, repaired where they do not."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import (
    FlatShapeError,
    MissingDependencyError,
    OpenShellError,
    PartwrightError,
    RobotError,
    UnreadableFileError,
)
from partwright.meshing.manifolds import closed, surface_of
from partwright.robots.model import Link, MeshUse, mirrored
from partwright.robots.wrapping import wrapped
from partwright.shapes import MeshDistance
from partwright.shapes import Shape as InputShape
from partwright.shapes.reading import read_source, source_of

if TYPE_CHECKING:
    from pathlib import Path

    from manifold3d import Manifold

    from partwright.shapes.source import Source


@dataclass(frozen=True, eq=False)
class Target:
    """What shapes are to stand for, in the link's frame.

    solid: closed. wrap: what contains all triangles: the solid, or more where that was told by a lattice.
    vertices (V, 3), faces (F, 3): the triangles as they were read, which are to be contained. notes: what was
    repaired.
    """

    solid: Manifold
    wrap: Manifold
    vertices: np.ndarray
    faces: np.ndarray
    notes: tuple[str, ...]

    @property
    def loose(self) -> bool:
        """Whether the triangles bound no solid by themselves."""
        return self.wrap is not self.solid and self.wrap.volume() > self.solid.volume()

    @property
    def size(self) -> float:
        """Longest side."""
        return float(np.ptp(self.vertices, axis=0).max())

    def samples(self, count: int, seed: int) -> np.ndarray:
        """(N, 3) points spread evenly over the triangles, and all corners."""
        random = np.random.default_rng(seed)
        a, b, c = self.vertices[self.faces.T]
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        chosen = random.choice(len(area), count, p=area / area.sum())
        u, v = random.random((2, count, 1))
        over = u + v > 1
        u, v = np.where(over, 1 - u, u), np.where(over, 1 - v, v)
        points = a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]
        return np.concatenate([points, self.vertices[np.unique(self.faces)]])


class Solids:
    """Reads each mesh file once."""

    def __init__(self) -> None:
        self._read: dict[tuple[Path, bool], Target] = {}

    def target(self, link: Link, uses: Sequence[MeshUse], sheets: bool = False) -> Target:
        """All of these meshes as one.

        sheets: those without thickness are wrapped, as what is seen often has them, for a label say.

        Raises:
            PartwrightError: one of them cannot be read, or encloses nothing; the message names the link.
        """
        from manifold3d import Manifold, OpType

        read = [self._of(link, use, sheets) for use in uses]
        solid, wrap = (
            Manifold.batch_boolean(
                [one.transform(use.matrix[:3]) for one, use in zip(kind, uses, strict=True)], OpType.Add
            )
            for kind in ([one.solid for one in read], [one.wrap for one in read])
        )
        vertices, faces, first = [], [], 0
        for one, use in zip(read, uses, strict=True):
            vertices.append(one.vertices @ use.matrix[:3, :3].T + use.matrix[:3, 3])
            faces.append((one.faces[:, ::-1] if mirrored(use.matrix) else one.faces) + first)
            first += len(one.vertices)
        notes = dict.fromkeys(note for one in read for note in one.notes)
        return Target(solid, wrap, np.concatenate(vertices), np.concatenate(faces), tuple(notes))

    def _of(self, link: Link, use: MeshUse, sheets: bool) -> Target:
        if not np.isfinite(use.matrix).all() or abs(np.linalg.det(use.matrix[:3, :3])) < 1e-30:
            raise RobotError(f"link {link.name!r}: the scale of {use.source.name} leaves nothing of it")
        key = use.source, sheets
        if key not in self._read:
            try:
                self._read[key] = _read(use, sheets)
            except PartwrightError as error:
                raise type(error)(f"link {link.name!r}: {use.source.name}: {error}") from error
        return self._read[key]


def _read(use: MeshUse, sheets: bool) -> Target:
    """The file's own triangles, and the solid that they bound: as they are, repaired, or wrapped.

    Raises:
        FlatShapeError: they bound none, and are no `sheets` that are to be wrapped.
    """
    source = source_of(use.inline) if use.inline is not None else _source(use.source)
    vertices = np.concatenate([piece.vertices for piece in source.pieces])
    starts = np.cumsum([0, *(len(piece.vertices) for piece in source.pieces)])
    faces = np.concatenate([p.faces + start for p, start in zip(source.pieces, starts, strict=False)])
    with suppress(OpenShellError, *((FlatShapeError,) if sheets else ())):
        shape = InputShape(source)
        solid = _manifold(shape.vertices, shape.faces)
        if solid is not None:
            return Target(solid, solid, vertices, faces, ())
    inner, whole = wrapped(vertices, faces)
    told = f"{use.source.name}: it does not close; what cannot be reached from outside counts as its inside"
    return Target(inner, whole, vertices, faces, (told,))


def _source(path: Path) -> Source:
    """What shapes are read from, and COLLADA by trimesh."""
    if path.suffix.lower() != ".dae":
        return read_source(path)
    try:
        import collada
    except ImportError as error:
        raise MissingDependencyError(
            "COLLADA meshes need pycollada; install it with: pip install 'partwright[robots]'"
        ) from error
    import trimesh

    try:
        scene = trimesh.load_scene(path)
    except (collada.common.DaeError, ValueError, KeyError, TypeError, AttributeError, SyntaxError) as error:
        raise UnreadableFileError(f"{path}: it cannot be read as COLLADA: {error}") from error
    return source_of(scene.to_mesh())


def _manifold(vertices: np.ndarray, faces: np.ndarray) -> Manifold | None:
    from manifold3d import Error

    solid = closed(vertices, faces)
    return solid if solid.status() == Error.NoError and solid.volume() > 0 else None


def largest_deviation(a: Manifold, b: Manifold) -> float:
    """How far the surface of either of two solids reaches beyond the other, as a length, by points about an
    eightieth of the size apart."""
    size = float(np.ptp(np.reshape(a.bounding_box(), (2, 3)), axis=0).max())
    return max(_beyond(a - b, b, size), _beyond(b - a, a, size))


def _beyond(left: Manifold, solid: Manifold, size: float) -> float:
    """left: what is not in the solid; what of its surface is the solid's own is at no distance from it."""
    if left.is_empty():
        return 0.0
    points = surface_of(left.refine_to_length(size / 80))[0]
    vertices, faces = surface_of(solid)
    middle = vertices.mean(axis=0)
    there = MeshDistance((vertices - middle) / size, faces, faces, True)
    return float(there.unsigned((points - middle) / size).max(initial=0.0)) * size
