"""Hulls by the kernel against Qhull's, and laws that hold wherever the points are."""

from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from manifold3d import Manifold
from scipy.spatial import ConvexHull

from partwright.meshing.hulls import file_hull, hull_of, hull_volume, split_hull_volumes
from partwright.meshing.manifolds import surface_of


def turned(points: np.ndarray, seed: int = 0) -> np.ndarray:
    return points @ np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]


def lattice(side: int) -> np.ndarray:
    return np.stack(np.meshgrid(*[np.arange(float(side))] * 3, indexing="ij"), axis=-1).reshape(-1, 3)


def rings() -> np.ndarray:
    """(N, 3) a drum whose sides are flat strips with points along their edges."""
    turn = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    return np.concatenate(
        [np.column_stack([np.cos(turn), np.sin(turn), np.full(64, z)]) for z in np.linspace(0, 1, 9)]
    )


def ball(count: int) -> np.ndarray:
    points = np.random.default_rng(1).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


CLOUDS = {
    "cloud": np.random.default_rng(0).normal(size=(500, 3)),
    "ball": ball(700),
    "lattice": lattice(7),
    "turned lattice": turned(lattice(7)),
    "far away": turned(lattice(7)) * 1e-3 + 5,
    "drum": rings(),
    "turned drum": turned(rings()),
    "single precision": turned(rings()).astype(np.float32).astype(float),
    "twice": np.tile(turned(lattice(3)), (2, 1)),
    "thin": np.random.default_rng(2).random((300, 3)) * [1, 1, 1e-6],
}


@pytest.mark.parametrize("name", CLOUDS)
def test_hulls_have_the_volume_of_qhulls_and_contain_all_points(name: str) -> None:
    points = CLOUDS[name]
    expected = ConvexHull(points)
    assert hull_volume(points) == pytest.approx(expected.volume, rel=1e-9 if name != "thin" else 1e-5)
    hull = hull_of(points)
    assert hull.volume() == pytest.approx(expected.volume, rel=1e-6)
    size = np.ptp(points, axis=0).max()
    assert (surface_of(hull)[0] @ expected.equations[:, :3].T + expected.equations[:, 3]).max() < 1e-9 * size
    assert max(outside(hull, points)) < 1e-7 * size


def outside(hull: Manifold, points: np.ndarray) -> np.ndarray:
    """(N,) how far points are above any face that is no sliver."""
    vertices, faces = surface_of(hull)
    a, b, c = vertices[faces.T]
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    real = area > 1e-3 * area.max()
    normal = normal[real] / area[real, None]
    return np.asarray((points @ normal.T - np.einsum("ij,ij->i", normal, a[real])).max(axis=1))


def test_what_lies_in_a_face_or_along_an_edge_is_no_corner() -> None:
    assert hull_of(lattice(6)).num_vert() == 8
    assert hull_of(lattice(6) * [0.1, 7.0, 3.0] - 4).num_vert() == 8
    assert hull_of(rings()).num_vert() == 128


@pytest.mark.parametrize("flat", [lattice(4) * [1, 1, 0], lattice(4) * [0, 1, 0], np.ones((5, 3)), np.eye(3)])
def test_points_in_a_plane_have_no_hull(flat: np.ndarray) -> None:
    assert hull_of(flat).is_empty()
    assert hull_volume(flat) == 0
    assert abs(hull_volume(turned(flat))) < 1e-9


def test_other_arrays_are_refused() -> None:
    with pytest.raises(ValueError, match=r"\(N, 3\)"):
        hull_of(np.zeros((4, 2)))
    with pytest.raises(ValueError, match="finite"):
        hull_volume(np.full((4, 3), np.nan))


@settings(max_examples=150, deadline=None)
@given(arrays(np.int64, st.tuples(st.integers(4, 40), st.just(3)), elements=st.integers(-4, 4)))
def test_hulls_of_small_integers_close_whatever_is_degenerate(points: np.ndarray) -> None:
    """Ties in every direction: each edge is there once each way, and no corner is above any face."""
    points = points.astype(float)
    flat = np.linalg.matrix_rank(points - points[0]) < 3
    hull = hull_of(points)
    assert hull.is_empty() == flat
    if flat:
        return
    vertices, faces = surface_of(hull)
    directed = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    assert len(np.unique(directed, axis=0)) == len(directed)
    assert len(np.unique(np.sort(directed, axis=1), axis=0)) * 2 == len(directed)
    assert len(vertices) - len(directed) // 2 + len(faces) == 2
    a, b, c = vertices[faces.T]
    normal = np.cross(b - a, c - a)
    assert (np.einsum("fi,pfi->pf", normal, points[:, None] - a) <= 1e-9).all()
    assert hull.volume() == pytest.approx(ConvexHull(points).volume)


def in_words(
    vertices: np.ndarray, faces: np.ndarray, edges: np.ndarray, plane: np.ndarray, slack: float
) -> float:
    """What `split_hull_volumes` finds, by Qhull."""
    height = vertices @ plane[:3] - plane[3]
    if height.max() < slack or height.min() > -slack:
        return np.inf
    start, stop = height[edges].T
    crossing = start * stop < 0
    share = (start[crossing] / (start[crossing] - stop[crossing]))[:, None]
    first, last = vertices[edges[crossing].T]
    total = 0.0
    for side in (height, -height):
        used = np.zeros(len(side), bool)
        used[faces[(side[faces] > slack).any(axis=1)]] = True
        own = vertices[used & (side >= -slack)]
        total += ConvexHull(np.concatenate([own, first + share * (last - first)])).volume
    return total


def test_hulls_of_both_sides_of_planes_are_those_of_what_is_cut() -> None:
    solid = Manifold.cube((3, 2, 1)) - Manifold.cylinder(3, 0.6, center=True, circular_segments=24).translate(
        (1, 1, 0)
    )
    vertices, faces = surface_of(solid)
    edges = np.unique(np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    normals = np.concatenate([np.eye(3), ball(8)])
    planes = np.column_stack([normals, normals @ [1.2, 0.9, 0.4]])
    planes = np.concatenate([planes, [[1, 0, 0, 3.0], [0, 0, 1, -2.0], [1, 0, 0, 1.6]]])
    found = split_hull_volumes(vertices, faces, edges, planes, 1e-7)
    assert found == pytest.approx([in_words(vertices, faces, edges, plane, 1e-7) for plane in planes])
    assert np.isinf(found[-3:-1]).all()
    above, below = solid.split_by_plane(tuple(normals[5]), float(planes[5, 3]))
    assert found[5] == pytest.approx(above.hull().volume() + below.hull().volume())


def trimmed(seed: int) -> np.ndarray:
    """Corners of a cube cut by 40 planes, small and away from the origin: many meet nearly in a point."""
    random = np.random.default_rng(seed)
    solid = Manifold.cube((2, 2, 2), True)
    for normal in random.normal(size=(40, 3)):
        solid = solid.trim_by_plane(tuple((normal / np.linalg.norm(normal)).tolist()), -0.8)
    return 0.03 * surface_of(solid)[0] + [0.1, 0.2, 0.05]


STORED = CLOUDS | {f"trimmed {seed}": trimmed(seed) for seed in range(4)}
STORED["small drum"] = 0.02 * turned(rings()) + [0.3, 0.1, 0]
STORED["eight clusters"] = (
    np.array(list(np.ndindex(2, 2, 2)))[:, None] + 1e-7 * np.random.default_rng(3).normal(size=(8, 6, 3))
).reshape(-1, 3)


@pytest.mark.parametrize("name", STORED)
def test_hulls_for_files_are_closed_and_convex_when_read_back(name: str) -> None:
    """From STL, which has single precision; some of these hulls come back concave if left to be rounded."""
    points = STORED[name]
    corners, faces = surface_of(file_hull(points))
    data = trimesh.Trimesh(corners, faces, process=False).export(file_type="stl")
    read = trimesh.load_mesh(io.BytesIO(data), file_type="stl")
    assert read.is_watertight
    assert read.is_convex
    assert (np.unique(read.vertices, axis=0) == np.unique(corners, axis=0)).all()
    size, reach = np.ptp(points, axis=0).max(), np.abs(points).max()
    assert read.volume == pytest.approx(hull_volume(points), abs=6 * 1e-6 * reach * size**2)
    hull = ConvexHull(points)
    assert (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max() < 1e-6 * reach


def test_hulls_for_files_need_no_more_corners_than_the_hull_has() -> None:
    assert file_hull(turned(lattice(7))).num_vert() == 8
    assert file_hull(STORED["eight clusters"]).num_vert() == 8
