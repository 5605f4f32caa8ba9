"""Regions for new parts from an approximate convex decomposition, CoACD, in place of the morphological one.

Wei et al., Approximate Convex Decomposition for 3D Meshes with Collision-Aware Concavity and Tree Search,
2022 (SuperFrusta, Table 3). Needs the extra "bench".
"""

from __future__ import annotations

import numpy as np
import trimesh
from manifold3d import Manifold, Mesh
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from scipy.spatial import ConvexHull

from partwright.errors import MissingDependencyError, NoSurfaceError
from partwright.meshing import mesh_field
from partwright.shapes.grid import DistanceGrid
from partwright.superfrusta.growing import Region
from partwright.superfrusta.samples import FitSamples, Rows
from partwright.superfrusta.settings import Settings

CONCAVITY = 0.05  # CoACD's own default
SIMPLIFIED = 0.3  # voxels
LEAST_DEPTH, LEAST_VOLUME = 0.15, 2e-4  # as growing's: voxels, and share of the shape
_SEARCH = {
    "mcts_nodes": 10,
    "mcts_iterations": 60,
    "mcts_max_depth": 2,
    "resolution": 1000,
    "max_ch_vertex": 64,
}


def regions(samples: FitSamples, rows: Rows, settings: Settings) -> list[Region]:
    """The convex pieces of the volume that no part explains yet; a stand-in for `growing.regions`.

    At most `settings.regions`, the largest; each tight and wide, as there.
    """
    grid = samples.grid
    residual = np.maximum(grid.values, -samples.grid_field(rows))
    unexplained = residual.ravel() < -LEAST_DEPTH * grid.spacing
    candidates = np.flatnonzero(unexplained)
    places = samples.grid_points[candidates]
    found = []
    for piece in convex_pieces(DistanceGrid(grid.origin, grid.spacing, residual), samples.seed):
        planes = ConvexHull(piece).equations
        inside = (places @ planes[:, :3].T + planes[:, 3] <= 0.5 * grid.spacing).all(axis=1)
        voxels = np.zeros(residual.size, bool)
        voxels[candidates[inside]] = True
        if np.count_nonzero(inside) > LEAST_VOLUME * samples.inside_voxels:
            found.append((voxels, float(-residual.ravel()[voxels].min())))
    found.sort(key=lambda region: -np.count_nonzero(region[0]))
    wanted = found[: settings.regions]
    return [
        Region(voxels, rows, depth, margin, elsewhere)
        for voxels, depth in wanted
        for margin, elsewhere in ((0.2, 0.15), (0.5, 1.0))
    ]


def convex_pieces(grid: DistanceGrid, seed: int) -> list[NDArray[np.float64]]:
    """Corners (n, 3) of each convex piece of {values < 0}."""
    try:
        import coacd
    except ImportError as error:
        raise MissingDependencyError('this row needs CoACD: pip install "partwright[bench]"') from error
    try:
        surface = surface_of(grid)
    except NoSurfaceError:
        return []
    coacd.set_log_level("off")
    given = coacd.Mesh(surface.vertices, surface.faces)
    pieces = coacd.run_coacd(given, threshold=CONCAVITY, preprocess_mode="off", seed=seed, **_SEARCH)
    return [np.asarray(vertices) for vertices, _ in pieces if len(vertices) > 3]


def surface_of(grid: DistanceGrid) -> trimesh.Trimesh:
    """The zero level of values on a grid, between which they are interpolated.

    What is less than 0.15 voxels deep is left out, as in growing: residuals are full of such films. Flat
    places keep few triangles, because CoACD takes long over many.
    """

    def distance(points: NDArray[np.float32]) -> NDArray[np.float32]:
        place = (points - grid.origin) / grid.spacing
        return map_coordinates(grid.values, place.T, order=1, mode="nearest") + np.float32(
            LEAST_DEPTH * grid.spacing
        )

    upper = grid.origin + grid.spacing * (np.array(grid.values.shape) - 1)
    cells = np.array(grid.values.shape) - 1
    fine = mesh_field(distance, grid.origin, upper, cells, lipschitz=4.0, sharp=False)
    solid = Manifold(Mesh(np.float32(fine.vertices), np.uint32(fine.faces))).simplify(
        SIMPLIFIED * grid.spacing
    )
    coarse = solid.to_mesh()
    return trimesh.Trimesh(coarse.vert_properties[:, :3], coarse.tri_verts, process=False)
