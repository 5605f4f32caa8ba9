"""Parts and assemblies as meshes in their own units and place."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import NoSurfaceError
from partwright.fields import Box, Cylinder, Sphere, SuperFrustum, Torus
from partwright.meshing import assemblies, mesh_assembly, mesh_part, occupancy_grid

HALF_TURN = float(np.sqrt(0.5))


def test_box_part_in_its_place() -> None:
    part = Part(Box((1.0, 2.0, 3.0)), translation=(5.0, 0.0, -1.0), rotation=(HALF_TURN, 0.0, HALF_TURN, 0.0))
    mesh = mesh_part(part, 32)
    assert mesh.is_volume
    assert mesh.volume == pytest.approx(6.0, rel=1e-3)
    np.testing.assert_allclose(mesh.bounds, [[3.5, -1.0, -1.5], [6.5, 1.0, -0.5]], atol=2e-3)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_size_and_place_cost_no_digits(scale: float) -> None:
    part = Part(Cylinder(0.5, 1.0), translation=(0.0, 0.0, 100.0)).scaled(scale)
    for mesh in (mesh_part(part, 32), mesh_assembly(Assembly((part,)), 48)):
        assert mesh.is_volume
        assert mesh.volume / scale**3 == pytest.approx(np.pi / 4, rel=5e-3)
        assert mesh.center_mass[2] / scale == pytest.approx(100.0, abs=1e-3)


@pytest.mark.parametrize(
    ("field", "euler", "volume"),
    [
        (Box((1.0, 1.0, 0.004)), 2, 0.004),
        (Torus(0.5, 0.02), 0, 2 * np.pi**2 * 0.5 * 0.02**2),
        (SuperFrustum((1.0, 1.0, 1.0), roundness=1.0, onion=0.96), 0, np.pi * (0.25 - 0.48**2)),
        (SuperFrustum((0.3, 0.3, 1.0), roundness=1.0, onion=0.9, bulge=0.6), 0, None),
        (SuperFrustum((0.04, 0.3, 1.0), bulge=0.8), 2, None),
    ],
)
def test_thin_hollow_and_bent_parts_are_complete(field: object, euler: int, volume: float | None) -> None:
    mesh = mesh_part(Part(field), 48)  # type: ignore[arg-type]
    assert mesh.is_volume
    assert mesh.euler_number == euler
    assert mesh.body_count == 1
    if volume is not None:
        assert mesh.volume == pytest.approx(volume, rel=0.06)


@settings(max_examples=15)
@given(
    size=st.tuples(*[st.floats(0.05, 1.0)] * 3),
    roundness=st.floats(0, 1),
    dilation=st.floats(0.0, 0.2),
    taper=st.floats(0, 2),
    bulge=st.floats(0, 1),
    onion=st.floats(0, 1),
)
def test_every_superfrustum_is_closed_and_on_its_zero_level(
    size, roundness, dilation, taper, bulge, onion
) -> None:
    field = SuperFrustum(size, roundness, dilation, taper, bulge, onion)
    try:
        mesh = mesh_part(Part(field), 24, sharp=False)
    except NoSurfaceError:
        assert dilation < 0.02  # walls or tips too thin for any grid
        return
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    # Nearly all: an edge through a jump of the field (the medial side of a bend) has no zero to find.
    cell = mesh.extents.max() / 24
    assert np.quantile(np.abs(field(mesh.vertices.astype(np.float32))), 0.95) < 0.1 * cell


def test_union_and_difference() -> None:
    block, hole = Part(Box((2.0, 2.0, 1.0))), Part(Cylinder(0.5, 3.0))
    joined = mesh_assembly(block | hole, 64)
    drilled = mesh_assembly(block - hole, 64)
    assert joined.is_volume
    assert joined.euler_number == 2
    assert joined.volume == pytest.approx(4 + np.pi / 4 * 2, rel=3e-3)
    assert drilled.is_volume
    assert drilled.euler_number == 0
    assert drilled.volume == pytest.approx(4 - np.pi / 4, rel=3e-3)


def test_thin_wall_in_an_assembly() -> None:
    """2 % of the size: thinner than a cell of the resolution that was asked for."""
    plate = Part(Box((1.0, 1.0, 0.02)), rotation=(0.9659258, 0.2588190, 0.0, 0.0))
    mesh = mesh_assembly(Assembly((plate,)), 56)
    assert mesh.is_volume
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(0.02, rel=0.02)


def test_a_thin_wall_that_a_cut_leaves() -> None:
    """Under a cell of the resolution that was asked for, though neither part is thin."""
    turn = (0.8, 0.36, 0.48, 0.0)
    cup = Part(Cylinder(0.5, 1.0), rotation=turn) - Part(
        Cylinder(0.48, 1.0), rotation=turn, translation=tuple(Similarity(rotation=turn)([[0, 0, 0.02]])[0])
    )
    mesh = mesh_assembly(cup, 60, exact=False)
    assert mesh.is_volume
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(np.pi * (0.25 - 0.48**2 * 0.98), rel=0.03)
    thick = Part(Cylinder(0.5, 1.0), rotation=turn) - Part(Cylinder(0.3, 2.0), rotation=turn)
    assert len(mesh_assembly(thick, 60, exact=False).faces) < len(mesh.faces) / 3  # of cells as asked for


def test_what_does_not_reach_a_sheet_is_not_meshed_to_cut_it(monkeypatch: pytest.MonkeyPatch) -> None:
    sheet = Part(Box((1.0, 1.0, 0.001)), translation=(0.0, 0.0, 1.0), name="sheet")
    body = Part(Box((1.0, 1.0, 0.5)), name="body") | sheet
    near = Part(Cylinder(0.2, 0.4), translation=(0.0, 0.0, 1.0), name="near")
    far = Part(Cylinder(0.2, 2.0), translation=(0.0, 0.0, -1.0), name="far")
    meshed = []
    own = assemblies._alone

    def alone(cell: float, sharp: bool, node: Part) -> trimesh.Trimesh:
        meshed.append(node.name)
        return own(cell, sharp, node)

    monkeypatch.setattr(assemblies, "_alone", alone)
    mesh = mesh_assembly(Assembly((body, near, far), "difference"), 32, exact=False)
    assert set(meshed) == {"sheet", "near"}
    assert mesh.is_volume
    _, sheet = sorted(mesh.split(), key=lambda one: one.bounds[1, 2])
    assert sheet.volume == pytest.approx(0.001 * (1 - np.pi * 0.04), rel=0.03)


def test_copies_of_a_part_are_meshed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    own = assemblies.mesh_field
    monkeypatch.setattr(assemblies, "mesh_field", lambda *a, **k: calls.append(a) or own(*a, **k))
    field = SuperFrustum((1.0, 0.8, 0.6), 0.4, 0.01, 0.9, 0.1234, 0.0)
    turned = Part(field, (5.0, 0.0, 0.0), (0.8, 0.6, 0.0, 0.0))
    first, second = mesh_part(Part(field), 16), mesh_part(turned, 16)
    assert len(calls) == 1
    np.testing.assert_allclose(second.vertices, turned.pose(first.vertices), atol=1e-12)
    first.vertices += 1.0  # its own
    np.testing.assert_array_equal(mesh_part(turned, 16).vertices, second.vertices)


def test_a_sheet_is_whole_beside_thick_parts_and_is_cut_with_them() -> None:
    """A wall of a thousandth of the size, where a frame stands on it and a hole goes through both."""
    turn = (0.9659258, 0.2588190, 0.0, 0.0)
    sheet = Part(SuperFrustum((1.0, 1.0, 0.002)), rotation=turn, blend=0.01)
    frame = Part(Box((0.4, 1.0, 0.3)), rotation=turn)
    hole = Part(Cylinder(0.1, 2.0), rotation=turn, blend=1e-3)
    mesh = mesh_assembly(Assembly((Assembly((frame, sheet)), hole), "difference"))
    assert mesh.is_volume
    assert mesh.euler_number == 0
    circle = np.pi * 0.1**2
    assert mesh.volume == pytest.approx(0.4 * 0.3 + 0.6 * 0.002 - circle * 0.3, rel=2e-3)
    whole = mesh_assembly(
        Assembly((Assembly((frame, sheet)), Part(Sphere(0.1), (9, 9, 9), blend=0.1)), "difference")
    )
    assert whole.euler_number == 2
    assert whole.volume == pytest.approx(0.4 * 0.3 + 0.6 * 0.002, rel=2e-3)


def test_what_the_blend_of_a_cut_takes_of_a_sheet_is_not_left_as_a_scrap() -> None:
    """A cut ends just before the sheet does, and its blend takes the rest."""
    sheet = Part(SuperFrustum((2.0, 0.2, 0.004)))
    block = Part(Box((0.4, 0.4, 0.4)), translation=(-1.0, 0.0, 0.0))
    cut = Part(Box((0.78, 1.0, 1.0)), translation=(0.59, 0.0, 0.0), blend=0.2)
    assembly = Assembly((Assembly((block, sheet)), cut), "difference")
    assert assembly.distance(np.array([[0.995, 0.0, 0.0]], np.float32))[0] > 0.01
    mesh = mesh_assembly(assembly, 64)
    assert mesh.is_volume
    assert mesh.body_count == 1
    assert 0.1 < mesh.bounds[1, 0] < 0.21  # the sheet is there up to the cut


def test_sheets_alone_and_copies_that_overlap() -> None:
    sheet = Part(SuperFrustum((1.0, 1.0, 0.002)), instances=(Similarity(translation=(0.5, 0.0, 0.001)),))
    mesh = mesh_assembly(sheet, 48)
    assert mesh.is_volume
    assert mesh.body_count == 1
    assert mesh.volume == pytest.approx(2 * 0.002 - 0.5 * 0.001, rel=5e-3)
    assert mesh_assembly(
        Assembly((Part(Sphere(1.0), blend=0.1), Part(Sphere(1e-9), (0, 0, 3)))), 24
    ).is_volume


def test_crumbs_are_left_out_and_bodies_kept() -> None:
    ball = Part(Sphere(0.5))
    large = Part(Sphere(0.2), translation=(0.9, 0.0, 0.0))
    crumb, pebble = (large & Part(Sphere(r), translation=(0.9, 0.0, 0.0)) for r in (0.01, 0.1))
    assert mesh_assembly(ball | crumb, 32, exact=False).body_count == 1
    assert mesh_assembly(ball | pebble, 32, exact=False).body_count == 2
    assert mesh_assembly(ball | crumb, 32, exact=False).is_volume


def test_nothing_left_is_named() -> None:
    point = Part(SuperFrustum((0.0, 0.0, 0.0)))
    with pytest.raises(NoSurfaceError):
        mesh_part(point)
    with pytest.raises(NoSurfaceError):
        mesh_assembly(point)
    with pytest.raises(NoSurfaceError):
        mesh_part(Part(SuperFrustum((1.0, 0.0, 0.5))))
    with pytest.raises(NoSurfaceError):
        mesh_assembly(Part(Sphere(0.5)) - Part(Sphere(1.0)), 24)


@settings(max_examples=10)
@given(
    places=st.lists(st.tuples(*[st.floats(-0.5, 0.5)] * 3), min_size=1, max_size=4),
    bulge=st.floats(0, 1),
    blend=st.floats(0, 0.2),
)
def test_sparse_occupancy_is_the_dense_one(places, bulge, blend) -> None:
    parts = [Part(SuperFrustum((0.3, 0.5, 0.8), 0.5, bulge=bulge), place, blend=blend) for place in places]
    assembly = Assembly(tuple(parts))
    resolution = 40
    axis = (np.arange(resolution) + 0.5) * 2 / resolution - 1
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float32)
    distance = assembly.distance(points)
    found = occupancy_grid(assembly.distance, resolution).ravel()
    assert (found == (distance < 0))[np.abs(distance) > 1e-6].all()
