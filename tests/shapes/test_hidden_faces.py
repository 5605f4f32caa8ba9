"""Shapes put together of open bodies, as assets for games are: what is closed, left out, and kept."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from solids import box, together, without

from partwright.errors import FlatShapeError, OpenShellError
from partwright.shapes import Openings, load_shape
from partwright.shapes.shape import NodeLeftOutWarning, Shape
from partwright.shapes.source import Piece, Source
from partwright.shapes.topology import boundary_loops


def open_box(extents, centre, *sides: str) -> trimesh.Trimesh:
    """A box without some of its sides: "+x", "-z" ..."""
    mesh = box(extents, centre)
    axes = {f"{sign}{axis}": (sign == "+", "xyz".index(axis)) for sign in "+-" for axis in "xyz"}
    dropped = np.zeros(12, bool)
    for side in sides:
        positive, axis = axes[side]
        dropped |= mesh.face_normals[:, axis] > 0.9 if positive else mesh.face_normals[:, axis] < -0.9
    return without(mesh, dropped)


def sheet(width: float, depth: float, at: tuple[float, float, float]) -> trimesh.Trimesh:
    """Flat, along x and y."""
    corners = np.array([[0, 0, 0], [width, 0, 0], [width, depth, 0], [0, depth, 0]]) + at
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


HOUSE = (
    box((2, 2, 0.1), (0, 0, -0.05)),
    open_box((1, 1, 0.5), (0, 0, 0.25), "+z", "-z"),
    box((1.2, 1.2, 0.2), (0, 0, 0.6)),
)


def test_walls_between_a_plate_and_a_roof_are_closed_where_those_cover_them() -> None:
    shape = load_shape(together(*HOUSE))
    assert shape.volume == pytest.approx(0.4 + 0.5 + 1.44 * 0.2, rel=1e-9)
    assert shape.confidence == 1.0
    assert shape.openings == Openings()
    assert any(note.startswith("closed 2 openings") for note in shape.repairs)
    assert (shape.signed_distance([[0, 0, 0.05], [0.4, 0.4, 0.45]]) < 0).all()
    with pytest.raises(OpenShellError):  # alone they may be walls of no thickness
        load_shape(HOUSE[1])


def test_an_opening_within_another_body_is_closed() -> None:
    mesh = together(box(), open_box((0.2, 0.2, 1), (0, 0, 0.8), "-z"))
    shape = load_shape(mesh)
    assert shape.volume == pytest.approx(1 + 0.04 * 0.8, rel=1e-9)
    assert shape.confidence == 1.0


@pytest.mark.parametrize(("gap", "certain"), [(1e-3, True), (0.02, False)])
def test_a_panel_before_a_body_is_closed_where_it_nearly_lies_on_it(gap: float, certain: bool) -> None:
    panel = open_box((0.6, 0.6, 0.05), (0, 0, 0.525 + gap), "-z")
    shape = load_shape(together(box(), panel))
    assert (shape.openings == Openings()) == certain
    assert shape.volume == pytest.approx(1 + 0.36 * 0.05, rel=1e-3)


def test_decals_and_the_ground_are_left_out() -> None:
    decals = [sheet(0.2, 0.1, (-0.3 + 0.3 * k, 0.1, 0.51)) for k in range(3)]
    shape = load_shape(together(box(), *decals, sheet(5, 5, (-2.5, -2.5, -0.6))))
    assert shape.volume == pytest.approx(1, rel=1e-9)
    assert shape.confidence == 1.0
    assert "left out 4 loose flat sheets" in shape.repairs
    alone = load_shape(box())
    np.testing.assert_allclose(shape.bounds(), alone.bounds())
    assert shape.frame.scale == pytest.approx(alone.frame.scale)
    np.testing.assert_allclose(shape.unit_mesh[0].min(axis=0), [-0.9] * 3)


def test_a_crumb_beside_loose_sheets_is_not_all_that_is_kept() -> None:
    sides = [sheet(1, 1, (0, 0, 0)), sheet(0.9, 0.9, (0.05, 0.05, 1)), sheet(0.9, 0.9, (0.05, 0.05, 2))]
    mesh = together(*sides, box((0.05, 0.05, 0.05), (3, 0, 0)))
    with pytest.raises(OpenShellError):
        load_shape(mesh)


def test_a_sheet_that_is_the_side_of_something_stays() -> None:
    mesh = together(open_box((1, 1, 1), (0, 0, 0), "+z", "+x"), box((0.1, 0.1, 0.1), (3, 0, 0)))
    lid = sheet(0.998, 0.998, (-0.499, -0.499, 0.5))
    shape = load_shape(together(mesh, lid))
    assert not any("left out" in note for note in shape.repairs)
    loose = [sheet(1, 1, (0, 0, 0)), sheet(1, 1, (0, 0.5, 0.5))]
    loose[1].apply_transform(trimesh.transformations.rotation_matrix(1.5, [1, 0, 0]))
    with pytest.raises((FlatShapeError, OpenShellError)):
        load_shape(together(*loose))


def test_what_opens_onto_the_ground_is_closed_where_up_is_known() -> None:
    mesh = together(open_box((1, 1, 0.1), (0, 0, 0.05), "-z"), box((0.2, 0.2, 0.5), (2, 0, 0.25)))

    def standing(up: str | None) -> Shape:
        pieces = (Piece("mesh", np.asarray(mesh.vertices), np.asarray(mesh.faces)),)
        return Shape(Source("mesh", pieces, None, up))

    assert standing("z").volume == pytest.approx(0.12, rel=1e-9)
    assert standing("z").openings == Openings()
    for other in ("-z", "y"):
        with pytest.raises(OpenShellError):
            standing(other)


def test_a_node_that_hangs_has_no_ground() -> None:
    hanging = open_box((1, 1, 0.2), (0, 0, 2), "-z")
    standing = open_box((1, 1, 0.2), (3, 0, 0.1), "-z")
    pieces = [Piece(name, m.vertices, m.faces) for name, m in (("lamp", hanging), ("step", standing))]
    source = Source("room", (*pieces, Piece("post", *solid((0.1, 0.1, 3), (1, 0, 1.5)))), None, "z")
    with pytest.warns(NodeLeftOutWarning, match="lamp"):
        nodes = Shape(source).split_nodes()
    assert [node.name for node in nodes] == ["step", "post"]
    assert nodes[0].volume == pytest.approx(0.2, rel=1e-9)


def solid(extents, centre) -> tuple[np.ndarray, np.ndarray]:
    mesh = box(extents, centre)
    return mesh.vertices, mesh.faces


def test_an_opening_with_an_island_is_closed_as_a_ring() -> None:
    """Discs over both of its rims would cancel for the winding number, and lie across the hole as surface."""
    tube = trimesh.creation.annulus(0.3, 0.5, 1.0)
    open_ = without(tube, tube.face_normals[:, 2] > 0.9)
    shape = load_shape(together(open_, box((2, 2, 0.1), (0, 0, 0.55))))
    assert shape.volume == pytest.approx(tube.volume + 0.4, rel=1e-9)
    assert shape.signed_distance([[0, 0, 0.4]])[0] == pytest.approx(0.1, abs=1e-6)
    filled = load_shape(open_)
    assert filled.area == pytest.approx(tube.area, rel=1e-9)
    assert filled.openings.count == 1


def test_a_flat_rim_of_any_outline_is_filled_within_it() -> None:
    """A fan from the middle of an L would lie outside of it."""
    outline = np.array([[0, 0], [2, 0], [2, 0.2], [0.2, 0.2], [0.2, 2], [0, 2]])
    prism = trimesh.creation.extrude_polygon(trimesh.path.polygons.Polygon(outline), 1.0)
    shape = load_shape(without(prism, prism.face_normals[:, 2] > 0.9))
    assert shape.volume == pytest.approx(0.76, rel=1e-9)
    assert shape.openings.share == pytest.approx(0.76 / prism.area, rel=1e-6)


def test_a_rim_that_touches_itself_is_filled() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=4)
    ring = np.flatnonzero((mesh.faces == 100).any(axis=1))
    away = mesh.triangles_center[ring] - mesh.vertices[100]
    first, second = np.linalg.svd(mesh.vertices[100][None])[2][1:]
    ring = ring[np.argsort(np.arctan2(away @ first, away @ second))]
    shape = load_shape(without(mesh, np.isin(np.arange(len(mesh.faces)), ring[::2])))
    assert shape.volume == pytest.approx(mesh.volume, rel=1e-4)
    assert shape.openings.count == len(ring) // 2


@given(seed=st.integers(0, 10_000), faces=st.integers(1, 40))
@settings(max_examples=60, deadline=None)
def test_loops_hold_each_half_edge_once_and_no_vertex_twice(seed: int, faces: int) -> None:
    triangles = np.random.default_rng(seed).permuted(np.tile(np.arange(12), (faces, 1)), axis=1)[:, :3]
    half_edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    loops = boundary_loops(half_edges)
    found = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    assert sorted(found.tolist()) == sorted(half_edges.tolist())
    assert all(len(set(loop.tolist())) == len(loop) for loop in loops)


def crate(bottom: bool) -> trimesh.Trimesh:
    """A closed ring of walls, 2 by 2 and 1 high, and a sheet below what they enclose that hangs on them."""
    lines = [-1.0, -0.8, 0.8, 1.0]
    points = np.array([[x, y, z] for z in (-0.5, 0.5) for y in lines for x in lines])
    quads = [] if not bottom else [[5, 9, 10, 6]]
    for row in range(3):
        for column in range(3):
            a = 4 * row + column
            if (row, column) != (1, 1):
                quads += [[a, a + 4, a + 5, a + 1], [a + 16, a + 17, a + 21, a + 20]]
    around = [0, 1, 2, 3, 7, 11, 15, 14, 13, 12, 8, 4]
    within = [5, 9, 10, 6]
    for loop in (around, within):
        quads += [[a, b, b + 16, a + 16] for a, b in zip(loop, np.roll(loop, -1).tolist(), strict=True)]
    faces = np.array([[[a, b, c], [a, c, d]] for a, b, c, d in quads]).reshape(-1, 3)
    return trimesh.Trimesh(points, faces, process=False)


def test_a_floor_between_walls_that_have_a_bottom_stays() -> None:
    floor = sheet(1.6, 1.6, (-0.8, -0.8, -0.4))
    shape = load_shape(together(crate(bottom=True), floor))
    assert not any("loose" in note for note in shape.repairs)
    inside = shape.signed_distance(
        [[0, 0, -0.45], [0.5, 0.5, -0.42], [0, 0, -0.35], [0, 0, 0.3], [0, 0, -0.6]]
    )
    assert (inside[:2] < 0).all()
    assert (inside[2:] > 0).all()
    ring = crate(bottom=False)
    assert ring.volume == pytest.approx(4 - 1.6**2)
    alone = load_shape(together(ring, floor))  # a pane
    assert any("loose" in note for note in alone.repairs)
    assert alone.volume == pytest.approx(ring.volume, rel=1e-6)


@pytest.mark.parametrize("above", [0.0, 1e-5, 1e-3, 0.05])
def test_decals_are_left_out_however_near(above: float) -> None:
    decal = sheet(0.4, 0.4, (-0.2, -0.2, 0.5 + above))
    shape = load_shape(together(box(), decal, box((0.2, 0.2, 0.2), (2, 0, 0))))
    assert shape.volume == pytest.approx(1.008, rel=1e-6)
    assert shape.left_out == pytest.approx(0.16 / (6 + 0.24 + 0.16), rel=1e-6)


def test_two_panes_are_no_body() -> None:
    front, back = sheet(1, 1, (2, 0, 0.3)), sheet(1, 1, (2, 0, 0))
    back.invert()
    assert load_shape(together(box((2, 2, 1)), front, back)).volume == pytest.approx(4.0)


def test_a_closed_plate_stays_however_thin() -> None:
    shape = load_shape(together(box(), box((0.5, 0.5, 5e-5), (0, 0, 2))))
    assert shape.volume == pytest.approx(1 + 0.25 * 5e-5, abs=1e-7)
    assert shape.bounds()[1, 2] == pytest.approx(2, abs=1e-3)


def road_between_kerbs(reach: float) -> trimesh.Trimesh:
    """One open body: along x a kerb, a road on the ground, a kerb, and the road `reach` further."""
    profile = np.array(
        [[0, 0], [0, 0.2], [1, 0.2], [1, 0], [3, 0], [3, 0.2], [4, 0.2], [4, 0], [4 + reach, 0]]
    )
    n = len(profile)
    rows = [np.stack([profile[:, 0], np.full(n, y), profile[:, 1]], axis=1) for y in (0.0, 2.0)]
    low = np.arange(n - 1)
    sides = [np.stack([low, low + 1, low + 1 + n], axis=1), np.stack([low, low + 1 + n, low + n], axis=1)]
    ends = [[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6]]
    ends += [[a + n, c + n, b + n] for a, b, c in ends]
    return trimesh.Trimesh(np.concatenate(rows), np.concatenate([*sides, ends]), process=False)


def test_what_lies_flat_on_the_ground_is_no_body() -> None:
    mesh = road_between_kerbs(5)
    shape = load_shape(mesh, up="z")
    assert shape.volume == pytest.approx(2 * 0.4, rel=1e-9)
    assert shape.bounds()[1, 0] == pytest.approx(4)
    assert "left out what lies flat on the ground" in shape.repairs
    assert shape.left_out == pytest.approx(14 / (14 + 2 * 5.2), rel=1e-6)
    middles = shape.vertices[shape.faces].mean(axis=1)  # no face is left that no part could reach
    assert not ((middles[:, 0] > 1.01) & (middles[:, 0] < 2.99)).any()


def test_what_lies_flat_on_the_ground_may_have_a_thickness() -> None:
    shape = load_shape(road_between_kerbs(5), up="z", thickness=0.02)
    assert shape.volume == pytest.approx(2 * 0.4 + 0.02 * 2 * (2 + 5), rel=1e-3)
    assert shape.bounds()[1, 0] == pytest.approx(9)
