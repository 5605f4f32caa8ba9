"""Exact meshes of trees of quadrics: closed, sharp, of the right volume and genus."""

from __future__ import annotations

import math

import numpy as np
import pytest

from partwright.assembly import Assembly, Part, Similarity
from partwright.errors import NoSurfaceError, ParameterError
from partwright.fields import (
    Box,
    Capsule,
    Cone,
    Cylinder,
    Frustum,
    Quadric,
    Solid,
    Sphere,
    SuperFrustum,
    Torus,
    Tube,
)
from partwright.meshing import mesh_assembly, mesh_csg, mesh_part
from partwright.meshing.csg import solid_of
from partwright.meshing.named_solids import named_solid
from partwright.meshing.quadric_solids import quadric_solid
from partwright.meshing.small_components import components

PI = math.pi
TURN = Similarity(2.0, (0.9, 0.1, -0.3, 0.2), (4.0, -1.0, 2.0))


def half_spaces(half: float = 1.0) -> Assembly:
    planes = [Part(Quadric.plane(n, half)) for n in np.vstack([np.eye(3), -np.eye(3)])]
    return Assembly(tuple(planes), "intersection")


NAMED = [
    (Box((1, 2, 3)), 6.0, 0),
    (Cylinder(0.5, 2), PI / 2, 0),
    (Cone(0.5, 2), PI / 6, 0),
    (Frustum(0.5, 0.3, 1), PI / 3 * 0.49, 0),
    (Sphere(0.7), 4 / 3 * PI * 0.343, 0),
    (Capsule(0.3, 1), PI * 0.09 + 4 / 3 * PI * 0.027, 0),
    (Tube(0.5, 0.2, 1), PI * 0.16, 1),
    (Torus(0.6, 0.2), 2 * PI**2 * 0.6 * 0.04, 1),
]


@pytest.mark.parametrize(("solid", "volume", "genus"), NAMED, ids=lambda value: getattr(value, "kind", ""))
def test_named_solids_have_their_volume_and_genus(solid: Solid, volume: float, genus: int) -> None:
    mesh = named_solid(solid, 1e-4)
    assert mesh.volume() == pytest.approx(volume, rel=1e-3)
    assert mesh.volume() <= volume * (1 + 1e-12)  # corners on the surface
    assert mesh.genus() == genus
    lower, upper = np.reshape(mesh.bounding_box(), (2, 3))
    np.testing.assert_allclose([lower, upper], solid.bounds(), atol=1e-4)


QUADRICS = {
    "plane": Quadric.plane((1, 2, 3), 0.1),
    "sphere": Quadric.sphere(0.6),
    "large sphere": Quadric.sphere(3, (0, 0, 3.1)),
    "huge sphere": Quadric.sphere(60, (0, 0, 60.1)),
    "ellipsoid": Quadric.ellipsoid((0.2, 0.5, 0.9)),
    "long ellipsoid": Quadric.ellipsoid((0.2, 0.5, 30)),
    "cylinder": Quadric.cylinder(0.3),
    "elliptic cylinder": Quadric.ellipsoid((0.2, 0.7, np.inf)),
    "flat cylinder": Quadric.ellipsoid((0.2, 70, np.inf)),
    "cone": Quadric.cone(0.4),
    "elliptic cone": Quadric((1, 2, -1, 0, 0, 0, 0)),
    "paraboloid": Quadric((1, 3, 0, 0, 0, -1, 0)),
    "saddle": Quadric((1, -1.5, 0, 0, 0, 1, 0)),
    "hyperboloid of one sheet": Quadric((1, 1, -1, 0, 0, 0, -0.1)),
    "hyperboloid of two sheets": Quadric((1, 2, -1, 0, 0, 0, 0.05)),
    "parabolic cylinder": Quadric((1, 0, 0, 0, 0, 1, 0)),
    "hyperbolic cylinder": Quadric((1, -1, 0, 0, 0, 0, 0.05)),
    "hyperbolic cylinder, between": Quadric((1, -2, 0, 0, 0, 0, -0.05)),
    "parallel planes": Quadric((1, 0, 0, 0, 0, 0, -0.1)),
    "crossing planes": Quadric((1, -2, 0, 0, 0, 0, 0)),
    "nothing": Quadric((1, 1, 1, 0, 0, 0, 1)),
}
BOX = np.array([[-1, -0.8, -0.6], [1, 0.8, 0.6]])
POINTS = np.random.default_rng(0).uniform(*BOX, (100_000, 3))


@pytest.mark.parametrize("inside_out", [False, True])
@pytest.mark.parametrize("name", QUADRICS)
def test_a_quadric_in_a_box_has_its_volume_and_its_surface(name: str, inside_out: bool) -> None:
    from manifold3d import Manifold

    turn = TURN.matrix()[:3, :3] / 2
    quadric = QUADRICS[name].moved(turn, np.array([0.1, -0.2, 0.1]))
    quadric = quadric.complement() if inside_out else quadric
    tolerance = 5e-4
    solid = quadric_solid(quadric, BOX, tolerance) ^ Manifold.cube(tuple(np.ptp(BOX, axis=0)), True)
    full = float(np.prod(np.ptp(BOX, axis=0)))
    share = (quadric.polynomial(POINTS) < 0).mean()
    assert solid.volume() / full == pytest.approx(share, abs=4 * math.sqrt(0.25 / len(POINTS)) + tolerance)
    mesh = solid.to_mesh64()
    vertices = np.asarray(mesh.vert_properties)
    middles = vertices[np.asarray(mesh.tri_verts)].mean(axis=1)
    for points, error in ((vertices, 1e-6), (middles, 2 * tolerance)):
        within = (np.abs(points) < BOX[1] - 1e-6).all(axis=1)
        assert np.abs(quadric(points[within])).max(initial=0.0) < error


def test_a_drilled_cube_is_sharp_and_of_genus_one() -> None:
    solid = (half_spaces() - Part(Quadric.cylinder(0.5))).transformed(TURN)
    mesh = mesh_csg(solid)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 0
    assert mesh.volume == pytest.approx(8 * (8 - PI / 2), rel=1e-3)
    corners = TURN(np.array([[i, j, k] for i in (-1.0, 1) for j in (-1.0, 1) for k in (-1.0, 1)]))
    nearest = np.linalg.norm(mesh.vertices[:, None] - corners, axis=2).min(axis=0)
    np.testing.assert_allclose(nearest, 0, atol=1e-9)
    np.testing.assert_allclose(solid.distance(mesh.vertices), 0, atol=2e-6)


def test_difference_of_unions_of_convexes() -> None:
    left = Assembly((half_spaces(), half_spaces().translated((1.5, 0, 0))))
    right = Assembly((Part(Quadric.sphere(0.5)), Part(Quadric.sphere(0.5, (1.5, 0, 1.0)))))
    solid = solid_of(left - right, 1e-3)
    assert solid.volume() == pytest.approx(4 * 3.5 - 4 / 3 * PI * 0.125 * 1.5, rel=1e-3)
    assert [piece.genus() for piece in solid.decompose()] == [0, 0]  # the cavity is a surface of its own


def test_a_nested_difference_and_copies() -> None:
    ring = Part(Cylinder(1.0, 0.5)) - (Part(Quadric.cylinder(0.5)) - Part(Quadric.cylinder(0.2)))
    assert mesh_csg(ring, 1e-4).volume == pytest.approx(PI * 0.5 * (1 - 0.25 + 0.04), rel=1e-3)
    twice = Part(Quadric.sphere(0.5), instances=(Similarity(translation=(2.0, 0, 0)),))
    assert mesh_assembly(Assembly((twice,))).volume == pytest.approx(2 * 4 / 3 * PI / 8, rel=6e-3)
    assert mesh_part(twice).volume == pytest.approx(2 * 4 / 3 * PI / 8, rel=6e-3)


def test_mesh_assembly_is_exact_where_it_can_be() -> None:
    cube = mesh_assembly(Assembly((Part(Box((1, 2, 3))),)))
    assert len(cube.faces) == 12
    assert len(mesh_assembly(Assembly((Part(Box((1, 2, 3))),)), exact=False).faces) > 1000
    with pytest.raises(ParameterError, match="exact mesh"):
        mesh_assembly(Assembly((Part(SuperFrustum((1, 1, 1), bulge=0.5)),)), exact=True)
    blended = Assembly((Part(Box((1, 1, 1))), Part(Sphere(0.5), (0.5, 0, 0), blend=0.1)))
    assert mesh_assembly(blended).is_watertight
    with pytest.raises(ParameterError, match="blends"):
        mesh_csg(blended)


def test_the_volume_converges_with_the_square_of_the_chord() -> None:
    exact = 4 / 3 * PI
    errors = [exact - solid_of(Part(Quadric.sphere(1.0)), t).volume() for t in (4e-3, 1e-3)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.25)


def test_what_does_not_end_or_is_empty_is_said() -> None:
    with pytest.raises(NoSurfaceError, match="does not end along z"):
        mesh_assembly(Assembly((Part(Quadric.cylinder(1.0)),)))
    with pytest.raises(NoSurfaceError, match="no point in common"):
        mesh_csg(Assembly((half_spaces(), Part(Quadric.sphere(0.5, (9, 0, 0)))), "intersection"))
    with pytest.raises(NoSurfaceError):
        mesh_part(Part(Quadric.plane((0, 0, 1), 1)))


TOUCHING = {
    "boxes side by side": (
        Assembly((Part(Box((1, 1, 1))), Part(Box((1, 0.8, 0.6)), (1, 0, 0)))), 1.48, 0
    ),
    "a hole as deep as its plate": (
        Assembly((Part(Box((1, 1, 1))), Part(Cylinder(0.3, 1))), "difference"), 1 - 0.09 * PI, 1
    ),
    "a shaft that fills its bore": (
        Assembly((
            Assembly((Part(Box((1, 1, 1))), Part(Cylinder(0.3, 1))), "difference"), Part(Cylinder(0.3, 2))
        )),
        1 + 0.09 * PI, 0,
    ),
    "a pocket to the side": (
        Assembly((Part(Box((1, 1, 1))), Part(Box((0.5, 0.5, 0.5)), (0.25, 0, 0.25))), "difference"), 0.875, 0
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TOUCHING)
def test_what_touches_has_no_slit_nor_skin_however_it_is_turned(name: str) -> None:
    whole, volume, genus = TOUCHING[name]
    rng = np.random.default_rng(0)
    for _ in range(20):
        turn, move = rng.normal(size=4), rng.normal(size=3)
        pose = Similarity(1.0, tuple(turn / np.linalg.norm(turn)), tuple(move))
        solid = solid_of(whole.transformed(pose))
        assert (solid.genus(), len(solid.decompose())) == (genus, 1)
        assert solid.volume() == pytest.approx(volume, rel=2e-3)
        mesh = mesh_csg(whole.transformed(pose))
        assert mesh.is_watertight


def test_a_rib_in_a_corner_leaves_no_slit_that_is_open_to_a_side() -> None:
    """Such a slit changes neither how many bodies there are nor their genus, but it has two walls."""
    whole = Assembly((
        Part(Box((6, 4, 1)), (3, 0, 0.5)),
        Part(Box((1, 4, 4)), (0.5, 0, 3)),
        Part(Box((2, 1, 2)), (2, 0, 2)),
    ))  # fmt: skip
    area = (2 * (6 * 4 + 6 * 1 + 4 * 1)) + 2 * 4 * (4 + 1)  # the base, and the walls of the plate
    area += 2 * (2 * 2) + 2 * (2 * 1) - 2 * (2 * 1)  # sides and the other walls of the rib, and its feet
    rng = np.random.default_rng(0)
    for _ in range(20):
        turn, move = rng.normal(size=4), rng.normal(size=3)
        pose = Similarity(1.0, tuple(turn / np.linalg.norm(turn)), tuple(move))
        solid = solid_of(whole.transformed(pose))
        assert solid.volume() == pytest.approx(24 + 16 + 4, rel=1e-4)
        assert solid.surface_area() == pytest.approx(area, rel=1e-3)


def test_components_are_counted_as_by_taking_the_solid_apart() -> None:
    from manifold3d import Manifold, OpType

    rng = np.random.default_rng(0)
    cubes = [Manifold.cube((0.2, 0.2, 0.2)).translate(tuple(rng.uniform(0, 1, 3))) for _ in range(40)]
    for some in (cubes[:1], cubes[:12], cubes):
        solid = Manifold.batch_boolean(some, OpType.Add)
        mesh = solid.to_mesh()
        count, piece = components(np.asarray(mesh.tri_verts), len(mesh.vert_properties))
        assert count == len(solid.decompose()) == len(np.unique(piece))
