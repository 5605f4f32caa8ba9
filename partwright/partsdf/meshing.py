"""Neural shapes to meshes, coarse to fine: the decoder is asked only where a surface can be.

A cube that is far from all cuboids of parts is empty. One whose centre is farther from zero than `lipschitz`
times its half diagonal holds no surface, so it is left out with the sign of its centre; the others are
halved. The last level goes by half of what the constant is above 1, as few places are that steep, and grows:
wherever a corner's sign is not the one that its neighbour was left out with, the neighbour is looked at, too.
What that can miss is a steep piece of surface that lies apart from all others and is no larger than a cube.
All parts are decoded in one pass, and each keeps what any of them needs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from partwright.errors import NoSurfaceError, SettingError
from partwright.meshing.assemblies import ACROSS
from partwright.meshing.cells import cell_polygons
from partwright.meshing.tables import CORNERS
from partwright.partsdf.neural import NeuralShape
from partwright.partsdf.poses import rotation_matrices

if TYPE_CHECKING:
    import trimesh

Distances = Callable[[np.ndarray], np.ndarray]
Reach = Callable[[np.ndarray, float], np.ndarray]  # places (N, 3), a distance: whether a surface is so near
ShareDone = Callable[[float], None]  # told how much is done, from 0 to 1; what it raises ends the work

COARSEST = 8  # cells along a cube of the first level
FINEST = 2  # cells along a cube whose corners are evaluated
MAX_RESOLUTION = 1024  # cells along the box
_DEFAULT_RESOLUTION, _MAX_RESOLUTION_FOR_WALLS = 128, 256
_MOST_CELLS = 2048  # along the box, however far out parts lie: the first level alone takes a gigabyte there
_BATCH = 1 << 14  # points between two reports of progress
_LAST_EXCESS = 0.5  # of what the constant is above 1, at the last level


_LATTICE = np.stack(np.meshgrid(*[np.arange(FINEST + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
_STEPS = np.concatenate([np.eye(3, dtype=np.int64), -np.eye(3, dtype=np.int64)])


@dataclass(frozen=True)
class Surfaces:
    """whole: the shape's mesh; parts: each part's own, by name, without those that have no surface.
    resolution: cells along [-1, 1]. evaluations: points at which the decoder was asked; dense: points of the
    full grid."""

    whole: trimesh.Trimesh
    parts: dict[str, trimesh.Trimesh]
    resolution: int
    evaluations: int
    dense: int


def mesh_shape(
    shape: NeuralShape,
    resolution: int | None = None,
    parts: bool = True,
    progress: ShareDone | None = None,
) -> Surfaces:
    """Mesh a neural shape in the unit frame.

    resolution: cells along [-1, 1], a multiple of 8; if not given, 128, or up to 256 so that the thinnest
    part's wall is two cells. parts: also mesh each part alone. progress: told the share that is done.

    Raises:
        SettingError: the resolution cannot be used, or parts lie so far out that cells would be too many.
        NoSurfaceError: there is no surface at all, or it is thinner than a cell.
    """

    def distances(points: np.ndarray) -> np.ndarray:
        """(1 + Q, N) or (1, N): the whole shape, then its parts."""
        each = shape.part_distances(points)
        whole = shape.whole(each)[None]
        return np.concatenate([whole, each]) if parts else whole

    if resolution is None:
        resolution = resolution_for_wall(shape.thinnest, _DEFAULT_RESOLUTION)
    lattice = _lattice(shape, distances, resolution, progress)
    meshes = lattice.meshes()
    if meshes[0] is None:
        raise NoSurfaceError(
            f"the shape of {shape.model.name} has no surface, or it is thinner than a cell at resolution "
            f"{resolution}; take a finer one"
        )
    found = {n: m for n, m in zip(shape.names(), meshes[1:], strict=False) if m is not None}
    return Surfaces(meshes[0], found, resolution, lattice.evaluations, lattice.dense)


def mesh_parts(
    shape: NeuralShape, resolution: int, progress: ShareDone | None = None
) -> dict[str, trimesh.Trimesh]:
    """The parts of `mesh_shape` alone, by name; none where no part has a surface. Arguments as there."""
    meshes = _lattice(shape, shape.part_distances, resolution, progress).meshes()
    return {n: m for n, m in zip(shape.names(), meshes, strict=True) if m is not None}


def _lattice(
    shape: NeuralShape, distances: Distances, resolution: int, progress: ShareDone | None
) -> SparseLattice:
    half = bounding_half_side(shape)
    if not half * _checked(resolution) <= _MOST_CELLS:
        raise SettingError(
            f"parts of this shape reach {half:.3g} unit lengths from its middle, where those of "
            f"{shape.model.name} reach about 1; at resolution {resolution} up to "
            f"{_MOST_CELLS / resolution:.3g} can be meshed"
        )
    return SparseLattice(
        distances,
        half,
        resolution,
        shape.model.lipschitz,
        _near_cuboids(shape),
        progress,
    )


@dataclass(frozen=True)
class LabelledSurface:
    """vertices (V, 3), faces (F, 3) and the number of the model's part of each face, label (F,)."""

    vertices: np.ndarray
    faces: np.ndarray
    label: np.ndarray


def labelled_surface(shape: NeuralShape, mesh: trimesh.Trimesh) -> LabelledSurface:
    """The whole shape's mesh (unit frame) with the nearest part of every face, as the metrics want it."""
    numbers = np.flatnonzero(shape.present.numpy())
    nearest = shape.part_distances(mesh.triangles_center.astype(np.float32)).argmin(axis=0)
    return LabelledSurface(np.asarray(mesh.vertices), np.asarray(mesh.faces), numbers[nearest])


def bounding_half_side(shape: NeuralShape) -> float:
    """Half the side of a cube around the origin that holds [-1, 1]^3 and every part's cuboid."""
    half = (shape.model.room * shape.poses.scale)[..., None]
    reach = shape.poses.translation.abs() + (rotation_matrices(shape.poses.rotation).abs() @ half).squeeze(-1)
    return max(1.0, float(reach[shape.present].max()) if shape.model.config.poses else 1.0)


def _near_cuboids(shape: NeuralShape) -> Reach | None:
    """Whether places (N, 3) are so near to a part's cuboid, enlarged as its surface may leave it; None where
    the model knows no cuboids."""
    if not shape.model.config.poses or shape.model.config.one_part:
        return None
    poses = shape.poses.map(lambda t: t[shape.present])
    turn, place = rotation_matrices(poses.rotation).numpy(), poses.translation.numpy()
    room = (shape.model.room[shape.present] * poses.scale).numpy()

    def reach(points: np.ndarray, distance: float) -> np.ndarray:
        near = np.zeros(len(points), dtype=bool)
        for matrix, centre, half in zip(turn, place, room, strict=True):
            near |= (np.abs((points - centre) @ matrix) <= half + distance).all(axis=1)
        return near

    return reach


def resolution_for_wall(wall: float, resolution: float) -> int:
    """Cells along [-1, 1] that put `ACROSS` of them across a wall: at least `resolution`, in eights, and no
    more than 256 for the wall's sake."""
    wanted = max(resolution, min(_MAX_RESOLUTION_FOR_WALLS, ACROSS * 2 / max(wall, 1e-9)))
    return int(min(MAX_RESOLUTION, COARSEST * np.ceil(wanted / COARSEST)))


def _checked(resolution: int) -> int:
    if not COARSEST <= resolution <= MAX_RESOLUTION or resolution % COARSEST:
        raise SettingError(
            f"resolution is {resolution}; expected a multiple of {COARSEST} from {COARSEST} to "
            f"{MAX_RESOLUTION}"
        )
    return resolution


class SparseLattice:
    """K fields on the cells of a cube around the origin that their surfaces can enter."""

    def __init__(
        self,
        distances: Distances,
        half: float,
        resolution: int,
        lipschitz: float,
        reach: Reach | None = None,
        progress: ShareDone | None = None,
    ) -> None:
        self._distances, self._lipschitz, self._progress = distances, lipschitz, progress
        self._reach = reach
        self.cell = 2.0 / resolution
        count = COARSEST * int(np.ceil(half / (COARSEST * self.cell)))  # so that the lattice holds that of 1
        self.origin, self.cells = -count * self.cell, 2 * count
        self.evaluations, self.dense = 0, (self.cells + 1) ** 3
        kept, self._inside, middles = self._refined()
        self._corners, self._values, self._cubes = self._grown(kept, middles)

    def _evaluate(self, lattice: np.ndarray, later: int = 0) -> np.ndarray:
        """(K, N) at lattice coordinates (N, 3), which may lie between corners; beyond the box is empty.

        later: about how many points will be asked for after these.
        """
        total = self.evaluations + len(lattice) + later
        batches = []
        for first in range(0, max(len(lattice), 1), _BATCH):
            batch = lattice[first : first + _BATCH]
            beyond = self.cell * (
                np.abs(batch - self.cells / 2).max(axis=1, initial=0) - (self.cells - 1) / 2
            )
            points = (self.origin + self.cell * batch).astype(np.float32)
            batches.append(np.maximum(self._distances(points), beyond.astype(np.float32)))
            self.evaluations += len(batch)
            if self._progress:
                self._progress(self.evaluations / total)
        return np.concatenate(batches, axis=1)

    def _refined(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Cubes (C, 3) of FINEST cells that a surface may enter, the side (K, G, G, G) of all others, and the
        values (K, C) at the cubes' middles, which are corners of cells."""
        axis = np.arange(self.cells // COARSEST)
        cubes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
        size, inside = COARSEST, None
        while True:
            if self._reach:
                centres = self.origin + self.cell * (cubes + 0.5) * size
                there = self._reach(centres, size * self.cell * 3**0.5 / 2)
                if inside is not None:
                    inside[:, *cubes[~there].T] = False
                cubes = cubes[there]
            values = self._evaluate((cubes + 0.5) * size, _expected(len(cubes), size))
            if inside is None:
                inside = np.zeros((len(values), *[len(axis)] * 3), dtype=bool)
            inside[:, cubes[:, 0], cubes[:, 1], cubes[:, 2]] = values < 0
            lipschitz = self._lipschitz if size > FINEST else 1 + _LAST_EXCESS * (self._lipschitz - 1)
            near = (np.abs(values) <= lipschitz * size * self.cell * 3**0.5 / 2).any(axis=0)
            cubes = cubes[near]
            if size == FINEST:
                return cubes, inside, values[:, near]
            size //= 2
            cubes = (2 * cubes[:, None] + CORNERS).reshape(-1, 3)
            for d in (1, 2, 3):
                inside = inside.repeat(2, axis=d)

    def _grown(self, newest: np.ndarray, middles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Keys (N,) of corners, sorted, their values (K, N), and all cubes (C, 3) whose corners they are; of
        the first, `newest` (C, 3), the values (K, C) at their middles are known."""
        seen = np.zeros(self._inside.shape[1:], dtype=bool)
        seen[tuple(newest.T)] = True
        corners = self._key(newest * FINEST + FINEST // 2)
        order = np.argsort(corners)
        corners, values = corners[order], middles[:, order]
        cubes = newest
        while len(newest):
            keys = np.sort(self._keys(newest))  # several times as fast as what np.unique does
            keys = keys[np.diff(keys, prepend=-1) > 0]
            place = np.searchsorted(corners, keys).clip(max=len(corners) - 1)
            keys = keys[corners[place] != keys]
            corners = np.concatenate([corners, keys])
            order = np.argsort(corners)
            values = np.concatenate([values, self._evaluate(self._lattice(keys))], axis=1)[:, order]
            corners = corners[order]
            newest = self._missed(newest, corners, values, seen)
            cubes = np.concatenate([cubes, newest])
        return corners, values, cubes

    def _missed(
        self, cubes: np.ndarray, corners: np.ndarray, values: np.ndarray, seen: np.ndarray
    ) -> np.ndarray:
        """Neighbours (M, 3) of cubes that were left out with another side than a corner they share has."""
        found = []
        inside = values[:, np.searchsorted(corners, self._keys(cubes))] < 0
        inside = inside.reshape(len(values), len(cubes), -1)
        for step in _STEPS:
            axis = int(np.abs(step).argmax())
            shared = _LATTICE[:, axis] == (FINEST if step[axis] > 0 else 0)
            other = cubes + step
            there = ((other >= 0) & (other < len(seen))).all(axis=1)
            there[there] = ~seen[tuple(other[there].T)]
            other = other[there]
            side = self._inside[:, other[:, 0], other[:, 1], other[:, 2]]
            differs = (inside[:, there][..., shared] != side[..., None]).any(axis=(0, 2))
            found.append(other[differs])
        fresh = np.unique(np.concatenate(found), axis=0)
        seen[tuple(fresh.T)] = True
        return fresh

    def _keys(self, cubes: np.ndarray) -> np.ndarray:
        """(C * 27,) one number a corner of cubes (C, 3)."""
        return (self._key(cubes * FINEST)[:, None] + self._key(_LATTICE)).ravel()  # keys are linear

    def _key(self, lattice: np.ndarray) -> np.ndarray:
        """(N,) of lattice coordinates (N, 3)."""
        x, y, z = lattice.T
        return np.asarray((x * (self.cells + 1) + y) * (self.cells + 1) + z)

    def _lattice(self, keys: np.ndarray) -> np.ndarray:
        side = self.cells + 1
        return np.stack([keys // side**2, keys // side % side, keys % side], axis=1)

    def meshes(self) -> list[trimesh.Trimesh | None]:
        """Each field's zero level as a closed mesh, None where it has none; the box cuts what reaches it."""
        rows = np.searchsorted(self._corners, self._keys(self._cubes)).reshape(
            len(self._cubes), len(_LATTICE)
        )
        return [self._mesh(values, rows) for values in self._values]

    def _mesh(self, values: np.ndarray, rows: np.ndarray) -> trimesh.Trimesh | None:
        import trimesh

        inside = values[rows] < 0
        crossed = inside.any(axis=1) & ~inside.all(axis=1)
        cubes, rows = self._cubes[crossed], rows[crossed]
        if not len(cubes):
            return None
        local = _LATTICE[(_LATTICE < FINEST).all(axis=1)]
        corner = (local[:, None] + CORNERS) @ (FINEST + 1) ** np.arange(2, -1, -1)  # (8 cells, 8 corners)
        cells = (cubes[:, None] * FINEST + local).reshape(-1, 3)
        polygons = cell_polygons(cells, values[rows[:, corner]].reshape(-1, 8))
        if not len(polygons):
            return None
        vertices = self.origin + self.cell * polygons.vertices
        return trimesh.Trimesh(vertices, polygons.triangles(), process=False)


def _expected(cubes: int, size: int) -> int:
    """About how many points are still needed when so many cubes of a size are looked at: a quarter may hold
    a surface, which is in four times as many of half the size; the smallest have nine corners each."""
    points, near = 0, cubes // 4
    while size > FINEST:
        points, near, size = points + 8 * near, 4 * near, size // 2
    return points + 9 * near
